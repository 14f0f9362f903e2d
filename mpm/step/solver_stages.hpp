// The stages of Solver::step(). Included by solver.hpp only.
#pragma once

namespace grainpair {

/// The law's state at the start, and what it says of it.
template <class K, class S, class E>
void Solver<K, S, E>::initialise(const std::vector<InitialState>& initial) {
  body_->resize(initial.size());
  constexpr std::size_t most = 64;
  Batch batch(most, false);
  for (std::size_t first = 0; first < initial.size(); first += most) {
    batch.size = std::min(most, initial.size() - first);
    body_->initialise(first, std::span(initial).subspan(first, batch.size), batch);
    std::copy_n(batch.regime.begin(), batch.size, &points_.regime[first]);
    for_each_block({first, first + batch.size}, [&](const auto& block) {
      const auto row = block.from(first);
      const auto sigma = batch.sigma.load(row);
      const auto energies = batch.energies.load(row);
      points_.sigma.store(sigma, block);
      block.store(trace(sigma) * (1.0 / 3.0), stage_.pressure);
      block.store(row.load(batch.granular_temperature), points_.granular_temperature);
      block.store(energies.fluctuation, points_.fluctuation);
      block.store(energies.plastic, points_.plastic),
          block.store(energies.collisional, points_.collisional);
      ledger_.stored += reduce(block.load_once(points_.mass) * energies.stored);
      stage_.template limit_step<true>(block, stage_.specific_volume(block),
                                       batch.stability.load(row), fastest_);
    });
  }
}

/// Sorts points by cell, cuts them into strips, and finds the nodes they can reach until the next
/// sorting.
template <class K, class S, class E>
void Solver<K, S, E>::bin_points() {
  const std::size_t n = points_.size();
  std::vector<std::size_t> cell(n);
  for (std::size_t p = 0; p < n; ++p) cell[p] = cell_of(points_.x[p]);
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return cell[a] < cell[b]; });
  put_fours_first(order, cell);
  stage_.reorder(order);
  body_->reorder(order);

  const auto column = [&](std::size_t p) {
    return static_cast<int>(points_.x[p][0] * grid_.axes[0].inverse_h);
  };
  strips_.clear();
  for (int first = 0, p = 0; first < setup_.cells[0] && p < static_cast<int>(n);
       first += strip_width) {
    const int begin = p;
    while (p < static_cast<int>(n) && column(static_cast<std::size_t>(p)) < first + strip_width)
      ++p;
    strips_.push_back({static_cast<std::size_t>(begin), static_cast<std::size_t>(p)});
  }
  for (int d = 0; d < dim; ++d) {
    int low = setup_.cells[d], high = 0;
    for (std::size_t p = 0; p < n; ++p) {
      const int c = static_cast<int>(points_.x[p][d] * grid_.axes[d].inverse_h);
      low = std::min(low, c), high = std::max(high, c);
    }
    stage_.box.begin[d] = std::max(low - 2, 0);
    stage_.box.end[d] = std::min(high + 2 + S::support, grid_.axes[d].nodes);
  }
  const std::size_t cells = stage_.box.cells();
  stage_.rates.resize(setup_.numerics.averages_rates() ? cells : 0),
      stage_.pressures.resize(setup_.numerics.averages_pressures() ? cells : 0);
  for_each_strip([&](std::size_t s) {
    for_each_block(strips_[s],
                   [&](const auto& block) { stage_.give_pressure(block, stage_.cell(block)); });
  });
  drift_ = 0.0;
}

/// Within each strip: as many points of a cell as fill a Wide stay together, what cells have left
/// over follows at the end. In a flowing column, whose cells hold three points or five, all blocks
/// but the last would else straddle cells and share no nodes.
template <class K, class S, class E>
void Solver<K, S, E>::put_fours_first(std::vector<std::uint32_t>& order,
                                      const std::vector<std::size_t>& cell) const {
  std::size_t strip_cells = strip_width;
  for (int d = 1; d < dim; ++d) strip_cells *= static_cast<std::size_t>(setup_.cells[d]);
  std::vector<std::uint32_t> arranged, left_over;
  arranged.reserve(order.size());
  for (auto next = order.begin(); next != order.end();) {
    const std::size_t here = cell[*next];
    const auto end = std::find_if(next, order.end(), [&](auto p) { return cell[p] != here; });
    const auto whole =
        next + (end - next) / static_cast<int>(Wide::size()) * static_cast<int>(Wide::size());
    arranged.insert(arranged.end(), next, whole);
    left_over.insert(left_over.end(), whole, end);
    next = end;
    if (next == order.end() || cell[*next] / strip_cells != here / strip_cells) {
      arranged.insert(arranged.end(), left_over.begin(), left_over.end());
      left_over.clear();
    }
  }
  order.swap(arranged);
}

template <class K, class S, class E>
void Solver<K, S, E>::clear_grid() {
  for_each_active_column([&](int i) {
    clear_cells(stage_.rates, i);
    for_each_node_of_column(i, [](Node<dim>& node, const auto&) {
      node.motion.setZero();
      node.change.setZero();
      node.mass = 0.0;
    });
  });
}

/// Mass, momentum and internal force of the points to the nodes:
///   m_i = sum_p w_ip m_p,  (m v)_i = sum_p w_ip m_p (v_p + C_p (X_i - x_p)),  f_i = sum_p V_p
///   sigma_p grad w_ip
/// where C_p is the point's own gradient or B_p D_p^-1, D_p = sum_i w_ip (X_i - x_p)(X_i - x_p)^T,
/// diagonal for tensor-product functions. (Compression is positive, hence the sign of f.)
template <class K, class S, class E>
void Solver<K, S, E>::scatter(Forces forces) {
  with_affine([&](auto carried) {
    for_each_strip([&](std::size_t s) { scatter_strip<carried.value>(strips_[s], forces); });
  });
}

template <class K, class S, class E>
template <Affine Carried>
[[gnu::flatten]] void Solver<K, S, E>::scatter_strip(const Strip& strip, Forces forces) {
  for_each_blocks<E>(strip.begin, strip.end, [&](const auto& blocks) {
    std::array<GivenOf<Wide>, halves> given;
#pragma GCC unroll 2
    for (std::size_t h = 0; h < given.size(); ++h) {
      const auto& block = blocks[h];
      auto& [mass, momentum, force, momentum_slope, force_slope] = given[h];
      mass = block.load_once(points_.mass);
      momentum = mass * points_.v.load(block);
      force = VecOf<Wide>::Zero();
      momentum_slope.fill(VecOf<Wide>::Zero()), force_slope.fill(VecOf<Wide>::Zero());
      if (forces == Forces::with) {
        const auto stress = stage_.volume(block) * stage_.felt_stress(block);
        for (int d = 0; d < dim; ++d)
          for (int i = 0; i < dim; ++i) force_slope[d][i] = component(stress, i, d);
        if constexpr (K::axisymmetric) force[0] = stress[2] / points_.x.load(block)[0];
      }
    }
    const auto at = neighbours(blocks);
    auto all = narrow<GivenOf, E>(given);
    if constexpr (Carried != Affine::none) {
      const MatOf<E> carried = points_.affine.template load_blocks<E>(blocks);
      for (int d = 0; d < dim; ++d)
        all.momentum_slope[d] =
            (Carried == Affine::moment ? at.n[d].inverse_inertia * all.mass : all.mass) *
            carried[d];
    }
    give(all, at);
  });
}

/// What gate and walls make of a nodal velocity.
template <class K, class S, class E>
[[gnu::noinline]] auto Solver<K, S, E>::constrained_here(Vec v, const std::array<int, dim>& node,
                                                         double time) const -> Vec {
  if (setup_.gate.present && v[0] > 0.0 &&
      setup_.gate.closes(grid_.axes[0].node_position[static_cast<std::size_t>(node[0])],
                         grid_.axes[1].node_position[static_cast<std::size_t>(node[1])], time))
    v[0] = 0.0;
  for (int d = dim - 1; d >= 0; --d) {
    if (node[d] > 0 && node[d] < grid_.axes[d].nodes - 1) continue;
    if (node[d] == 0) v = setup_.walls[d][0].apply(v, d, 1.0);
    if (node[d] == grid_.axes[d].nodes - 1) v = setup_.walls[d][1].apply(v, d, -1.0);
  }
  return v;
}

/// v_new = v + dt (f/m + g), then the walls. Work of each force is taken with the mean of old and
/// final velocity, so that it equals the change of nodal kinetic energy exactly. The walls act
/// twice: first on what the points' momenta ask for, which the walls had refused already at the end
/// of the last step: what that costs is the transfer's doing, not theirs. Fixed walls and rollers
/// then do no work, and the wall's account holds friction alone.
template <class K, class S, class E>
[[gnu::flatten]] void Solver<K, S, E>::accelerate(double dt) {
  work_.assign(static_cast<std::size_t>(stage_.box.end[0]), {});
  for_each_active_column([&](int i) {
    clear_cells(stage_.pressures, i);  // the forces have taken them
    Work sum;
    for_each_node_of_column(i, [&](Node<dim>& node, const auto& index) {
      const double m = node.mass;
      if (m <= 0.0) {
        node.motion.setZero();
        node.change.setZero();
        narrow_velocity(node);
        return;
      }
      const double inverse = 1.0 / m;
      const Vec mapped = inverse * node.motion;
      const Vec old = constrained(mapped, index, time_);
      const Vec free = old + dt * (inverse * node.change + setup_.gravity);
      const Vec v = constrained(free, index, time_ + dt);
      const Vec momentum = (0.5 * m) * (old + v);
      sum.gain += momentum.dot(v - old);
      sum.wall += momentum.dot(free - v);
      node.motion = v;
      node.change = v - mapped;
      narrow_velocity(node);
    });
    work_[static_cast<std::size_t>(i)] = sum;
  });
  for (const Work& c : work_) {
    ledger_.transfer += c.gain;  // the points book the other halves of both mappings
    ledger_.wall += c.wall;
    ledger_.time_integration -=
        c.gain + c.wall;  // work of force and gravity, until law and potential energy book theirs
  }
}

/// Momenta to velocities, without forces: for gradients taken from the points' own momenta.
template <class K, class S, class E>
void Solver<K, S, E>::constrain(double time_offset) {
  for_each_active_column([&](int i) {
    for_each_node_of_column(i, [&](Node<dim>& node, const auto& index) {
      if (node.mass > 0.0)
        node.motion = constrained(Vec(node.motion / node.mass), index, time_ + time_offset);
      narrow_velocity(node);
    });
  });
}

/// v <- sum_{l < m} (I - S+ S)^l v on the nodes; see transfer/xpic.hpp. Uses `change` for the
/// running term.
template <class K, class S, class E>
void Solver<K, S, E>::sharpen_velocity() {
  std::vector<Vec> term(points_.size());
  const auto sweep = [&](auto&& f) {
    for_each_active_column([&](int i) { for_each_node_of_column(i, f); });
  };
  std::vector<Vec> sum(grid_.nodes.size());
  const auto index_of = [&](const Node<dim>& node) {
    return static_cast<std::size_t>(&node - grid_.nodes.data());
  };
  sweep([&](Node<dim>& node, const auto&) { sum[index_of(node)] = node.motion; });
  for (int l = 1; l < setup_.numerics.xpic_order; ++l) {
    // S: the term at the points
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
        term[p].setZero();
        for_each_weight(p, [&](const Node<dim>& node, double w) { term[p] += w * node.motion; });
      }
    });
    sweep([&](Node<dim>& node, const auto&) { node.change.setZero(); });
    // S+: back to the nodes, mass-weighted
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p)
        for_each_weight(
            p, [&](Node<dim>& node, double w) { node.change += (w * points_.mass[p]) * term[p]; });
    });
    sweep([&](Node<dim>& node, const auto& index) {
      if (node.mass <= 0.0) return;
      node.motion = constrained(Vec(node.motion - node.change / node.mass), index, time_);
      sum[index_of(node)] += node.motion;
    });
  }
  sweep([&](Node<dim>& node, const auto&) {
    node.motion = sum[index_of(node)];
    node.change.setZero();
    narrow_velocity(node);
  });
}

/// From the nodes to the points: new velocity, affine part and displacement, or grad v, or both in
/// one pass over the nodes.
template <class K, class S, class E>
void Solver<K, S, E>::gather(Gathered what, double dt) {
  const Filter filter{relaxed(dt, setup_.numerics.relaxation_time),
                      relaxed(dt, setup_.numerics.gradient_relaxation_time)};
  sums_.assign(strips_.size(), {});
  with_affine([&](auto carried) {
    for_each_strip([&](std::size_t s) {
      sums_[s] = gather_strip<carried.value>(strips_[s], what, filter, dt);
    });
  });
  if (what != Gathered::gradient) {
    double before = 0.0, after = 0.0;
    max_speed_ = 0.0;
    for (const Sums& s : sums_) {
      before += s.kinetic_before, after += s.kinetic_after;
      max_speed_ = std::max(max_speed_, s.speed);
    }
    ledger_.transfer += before - after;
    ledger_.kinetic = after;
    drift_ += max_speed_ * dt;
  }
  if (what != Gathered::velocity && setup_.numerics.averaging == VolumetricAveraging::nodal)
    average_over_nodes(stage_.volumetric_rate);
}

template <class K, class S, class E>
template <Affine Carried>
[[gnu::flatten]] auto Solver<K, S, E>::gather_strip(const Strip& strip, Gathered what,
                                                    const Filter& filter, double dt) -> Sums {
  Wide kinetic_before = 0.0, kinetic_after = 0.0, speed = 0.0;
  const auto take_velocity = [&](const auto& block, const VecOf<Wide>& of_grid,
                                 const VecOf<Wide>& increment) {
    const auto old = points_.v.load(block);
    const VecOf<Wide> v =
        transferred(setup_.numerics.transfer, old, of_grid, increment, filter.velocity);
    points_.v.store(v, block);
    const Wide half_mass = 0.5 * block.load_once(points_.mass);
    kinetic_before += half_mass * old.squaredNorm();
    kinetic_after += half_mass * v.squaredNorm();
    for (int d = 0; d < dim; ++d) speed = larger(speed, abs(of_grid[d]));
  };
  const auto take_gradient = [&](const auto& block, const VecOf<Wide>& of_grid,
                                 const MatOf<Wide>& gradient) {
    Wide divergence = 0.0;
    for (int d = 0; d < dim; ++d) divergence += gradient[d][d];
    if constexpr (K::axisymmetric) {
      const Wide hoop = of_grid[0] / points_.x.load(block)[0];
      block.store(hoop, stage_.hoop);
      divergence += hoop;
    }
    stage_.give_rate(block, divergence);
  };
  const auto take_affine = [&](const auto& blocks, const auto& at, const CollectedOf<E>& all) {
    if constexpr (Carried == Affine::moment)
      points_.affine.template store_blocks<E>(all.moment, blocks);
    if constexpr (Carried == Affine::gradient) {
      Eigen::Matrix<E, dim, dim> own, increment, grid_gradient;
      MatOf<E> gradient = points_.affine.template load_blocks<E>(blocks);
      for (int d = 0; d < dim; ++d) {
        const E inverse = at.n[d].inverse_inertia;
        for (int i = 0; i < dim; ++i) {
          own(i, d) = gradient[d][i];
          increment(i, d) = inverse * all.moment_increment[d][i];
          grid_gradient(i, d) = inverse * all.moment[d][i];
        }
      }
      own = AffineFlip::gradient(own, increment, grid_gradient, filter.gradient, dt);
      for (int d = 0; d < dim; ++d)
        for (int i = 0; i < dim; ++i) gradient[d][i] = own(i, d);
      points_.affine.template store_blocks<E>(gradient, blocks);
    }
  };
  for_each_blocks<E>(strip.begin, strip.end, [&](const auto& blocks) {
    const auto at = neighbours(blocks);
    const CollectedOf<E> all = collected<Carried != Affine::none>(at);
    const auto v = widen<VecOf, E>(all.v);
    if (what != Gathered::gradient) {
      const auto dv = widen<VecOf, E>(all.dv);
#pragma GCC unroll 2
      for (std::size_t h = 0; h < halves; ++h) take_velocity(blocks[h], v[h], dv[h]);
      take_affine(blocks, at, all);
      stage_.grid_velocity.template store_blocks<E>(all.v, blocks);
    }
    if (what != Gathered::velocity) {
      const auto gradient = widen<MatOf, E>(all.slope);
      stage_.velocity_gradient.template store_blocks<E>(all.slope, blocks);
#pragma GCC unroll 2
      for (std::size_t h = 0; h < halves; ++h) take_gradient(blocks[h], v[h], gradient[h]);
    }
  });
  Sums sum;
  sum.kinetic_before = reduce(kinetic_before), sum.kinetic_after = reduce(kinetic_after),
  sum.speed = hmax(speed);
  return sum;
}

/// What points make of their velocity gradients (point_stage.hpp); a point that turns inside out or
/// leaves the grid ends the run, named.
template <class K, class S, class E>
void Solver<K, S, E>::update_points(double dt, Moves moves) {
  point_sums_.assign(strips_.size(), {});
  if (moves == Moves::no) stage_.pressures.clear();  // else accelerate() has
  stage_.begin(dt, moves == Moves::yes);
  for_each_strip([&](std::size_t s) { body_->advance(stage_, strips_[s], point_sums_[s]); });
  const EnergyLedger before = ledger_;
  ledger_.stored = ledger_.fluctuation = 0.0;
  fastest_ = {};
  for (const PointSums& s : point_sums_) {
    if (s.inverted >= 0) {
      const auto p = static_cast<std::size_t>(s.inverted);
      throw SolverError(
          Failure::inverted,
          "point {}: volume inverted (void ratio {:.3g}) at ({:.4g}, {:.4g}) m, t = {:.4g} s lower "
          "mpm.time_step_fraction",
          points_.id[p], points_.void_ratio[p], position(p)[0], position(p)[1], time_);
    }
    const double mixing = reduce(s.mixing);
    ledger_.stored += reduce(s.energies.stored);
    ledger_.fluctuation += reduce(s.energies.fluctuation);
    ledger_.plastic += reduce(s.energies.plastic);
    ledger_.collisional += reduce(s.energies.collisional);
    ledger_.detached += s.detached;
    if (s.fastest.rate > fastest_.rate) fastest_ = s.fastest;
    ledger_.mixing -= mixing;  // work that the points took and the grid did not give
    ledger_.time_integration += mixing - s.detached;
  }
  // The grid gave its own figure for this work when it accelerated; what the two do not agree on is
  // the integrator's.
  const double absorbed =
      (ledger_.stored + ledger_.fluctuation + ledger_.plastic + ledger_.collisional) -
      (before.stored + before.fluctuation + before.plastic + before.collisional);
  ledger_.time_integration -= absorbed;
  if (moves == Moves::yes) book_places();
}

/// Where the law has already answered.
template <class K, class S, class E>
void Solver<K, S, E>::move_points() {
  point_sums_.assign(strips_.size(), {});
  stage_.pressures.clear();
  for_each_strip([&](std::size_t s) {
    for_each_block(strips_[s], [&](const auto& block) {
      stage_.give_pressure(block, stage_.move(block, point_sums_[s]));
    });
  });
  book_places();
}

template <class K, class S, class E>
void Solver<K, S, E>::book_places() {
  double potential = 0.0;
  for (const PointSums& s : point_sums_) {
    potential += reduce(s.potential);
    if (s.escaped >= 0) {
      const auto p = static_cast<std::size_t>(s.escaped);
      const Vec3 x = position(p);
      throw SolverError(
          Failure::ejected,
          "point {}: left the grid at ({:.4g}, {:.4g}, {:.4g}) m, t = {:.4g} s (speed {:.3g} m/s) "
          "lengthen geometry.floor_length, or lower mpm.time_step_fraction if the speed is absurd",
          points_.id[p], x[0], x[1], x[2], time_, velocity(p).norm());
    }
  }
  ledger_.time_integration += ledger_.potential - potential;
  ledger_.potential = potential;
}

/// Granular temperature flows, q = -kappa grad T, between the points and through no wall:
///   T_i = sum_p w_ip m_p T_p / m_i,  m_i de_i = dt sum_p V_p grad w_ip . q_p,  de_p = sum_i w_ip
///   de_i  [J/kg].
/// The functions' slopes cancel at every point, so that nothing is gained or lost; where a point is
/// asked for more than it holds, what that creates is booked. Explicit, in sub-steps of half the
/// largest stable, 3/2 rho h^2/(4 dim kappa).
template <class K, class S, class E>
void Solver<K, S, E>::conduct(double dt) {
  const double h = setup_.numerics.h;
  scratch_.resize(points_.size());
  std::vector<double> rates(strips_.size());  // kappa/rho [m2/s]
  for_each_strip([&](std::size_t s) {
    for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
      scratch_[p] = body_->conductivity(p, points_.void_ratio[p]) * stage_.volume(p);
      rates[s] = std::max(rates[s], scratch_[p] / points_.mass[p]);
    }
  });
  const double fastest = *std::max_element(rates.begin(), rates.end());
  const auto rounds = static_cast<long>(std::ceil(dt * fastest * 4.0 * dim / (0.5 * 1.5 * h * h)));
  for (long round = 0; round < rounds; ++round) {
    clear_grid();
    for_each_point([&](std::size_t p) {
      const double m = points_.mass[p];
      for_each_weight(p, [&](Node<dim>& node, double w) {
        node.mass += w * m;
        node.motion[0] += w * m * points_.granular_temperature[p];
      });
    });
    for_each_point([&](std::size_t p) {
      Vec flux = Vec::Zero();  // times volume and time [J m]
      for_each_weight(p, [&](const Node<dim>& node, double, const Vec& slope) {
        flux -= node.motion[0] / node.mass * slope;
      });
      flux *= scratch_[p] * dt / static_cast<double>(rounds);
      for_each_weight(
          p, [&](Node<dim>& node, double, const Vec& slope) { node.change[0] += slope.dot(flux); });
    });
    std::vector<Sums> sums(strips_.size());
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
        double energy = 0.0;
        for_each_weight(
            p, [&](const Node<dim>& node, double w) { energy += w * node.change[0] / node.mass; });
        points_.granular_temperature[p] = body_->heat(p, energy);
        const double held = 1.5 * points_.granular_temperature[p],
                     change = held - points_.fluctuation[p];
        points_.fluctuation[p] = held;
        points_.conducted[p] += change;
        sums[s].gained += points_.mass[p] * change;
        sums[s].conducted += points_.mass[p] * std::max(change, 0.0);
      }
    });
    double conducted = 0.0, gained = 0.0;
    for (const Sums& s : sums) gained += s.gained, conducted += s.conducted;
    ledger_.fluctuation += gained;
    ledger_.conduction -= gained;
    ledger_.conducted += conducted;
  }
}

/// Pressures averaged over nodes; cell means need nothing but what points have given.
template <class K, class S, class E>
void Solver<K, S, E>::share_pressure() {
  if (setup_.numerics.averaging != VolumetricAveraging::nodal) return;
  stage_.shared_pressure = stage_.pressure;
  average_over_nodes(stage_.shared_pressure);
}

/// Points to nodes and back, volume-weighted: avg_p = sum_i w_ip (sum_q w_iq V_q a_q)/(sum_q w_iq
/// V_q).
template <class K, class S, class E>
void Solver<K, S, E>::average_over_nodes(std::vector<double>& field) {
  // `change` is free between stages: its first number holds the weight, its second the value
  for_each_active_column([&](int i) {
    for_each_node_of_column(i, [](Node<dim>& node, const auto&) { node.change.setZero(); });
  });
  for_each_point([&](std::size_t p) {
    const double v = stage_.volume(p);
    for_each_weight(p, [&](Node<dim>& node, double w) {
      node.change[0] += w * v;
      node.change[1] += w * v * field[p];
    });
  });
  for_each_point([&](std::size_t p) {
    double mean = 0.0;
    for_each_weight(p, [&](const Node<dim>& node, double w) {
      if (node.change[0] > 0.0) mean += w * node.change[1] / node.change[0];
    });
    field[p] = mean;
  });
}

/// Energies held at the start.
template <class K, class S, class E>
void Solver<K, S, E>::measure_held_energy() {
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const double m = points_.mass[p];
    ledger_.kinetic += 0.5 * m * points_.v[p].squaredNorm();
    ledger_.potential -= m * setup_.gravity.dot(points_.x[p]);
    ledger_.fluctuation += m * points_.fluctuation[p];
    max_speed_ = std::max(max_speed_, points_.v[p].cwiseAbs().maxCoeff());
  }
}

/// That of the fastest point, and no point may cross more than a fifth of a cell per step. A law
/// may lose all its stress, and with it all that limits the step; what it meets when contact comes
/// back is not known before, but the step that was stable at the start, four times, still finds it
/// in time.
template <class K, class S, class E>
TimeStep Solver<K, S, E>::stable_step() const {
  TimeStep out{std::numeric_limits<double>::infinity(), Limit::none, 0};
  if (fastest_.rate > 0.0) out = {2.0 / fastest_.rate, fastest_.limit, fastest_.point};
  if (4.0 * first_limit_ < out.dt) out = {4.0 * first_limit_, Limit::none, 0};
  out.dt *= setup_.numerics.time_step_fraction;
  if (max_speed_ > 0.0) out.dt = std::min(out.dt, 0.2 * setup_.numerics.h / max_speed_);
  return out;
}

}  // namespace grainpair
