// The stages of Solver::step(). Included by solver.hpp only.
#pragma once

namespace grainpair {

/// Sorts points by cell, cuts them into strips, and finds the nodes they can reach until the next sorting.
template <class K, class S, class E>
void Solver<K, S, E>::bin_points() {
  const std::size_t n = points_.size();
  std::vector<std::size_t> cell(n);
  for (std::size_t p = 0; p < n; ++p) cell[p] = cell_of(points_.x[p]);
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return cell[a] < cell[b]; });
  points_.reorder(order);
  body_->reorder(order);

  const auto column = [&](std::size_t p) { return static_cast<int>(points_.x[p][0] * grid_.axes[0].inverse_h); };
  strips_.clear();
  for (int first = 0, p = 0; first < setup_.cells[0] && p < static_cast<int>(n); first += strip_width) {
    const int begin = p;
    while (p < static_cast<int>(n) && column(static_cast<std::size_t>(p)) < first + strip_width) ++p;
    strips_.push_back({static_cast<std::size_t>(begin), static_cast<std::size_t>(p)});
  }
  for (int d = 0; d < dim; ++d) {
    int low = setup_.cells[d], high = 0;
    for (std::size_t p = 0; p < n; ++p) {
      const int c = static_cast<int>(points_.x[p][d] * grid_.axes[d].inverse_h);
      low = std::min(low, c), high = std::max(high, c);
    }
    active_begin_[d] = std::max(low - 2, 0);
    active_end_[d] = std::min(high + 2 + S::support, grid_.axes[d].nodes);
  }
  std::size_t cells = 1;
  for (int d = 0; d < dim; ++d) cells *= static_cast<std::size_t>(active_end_[d] - active_begin_[d]);
  rates_.resize(averages_rates() ? cells : 0), pressures_.resize(averages_pressures() ? cells : 0);
  for (std::size_t p = 0; p < n; ++p) cell_[p] = static_cast<double>(active_cell_of(points_.x[p]));
  drift_ = 0.0;
}

template <class K, class S, class E>
void Solver<K, S, E>::clear_grid() {
  for_each_active_column([&](int i) {
    for_each_node_of_column(i, [](Node<dim>& node, const auto&) {
      node.motion.setZero();
      node.change.setZero();
      node.mass = 0.0;
    });
  });
}

/// Mass, momentum and internal force of the points to the nodes:
///   m_i = sum_p w_ip m_p,  (m v)_i = sum_p w_ip m_p (v_p + C_p (X_i - x_p)),  f_i = sum_p V_p sigma_p grad w_ip
/// where C_p is the point's own gradient or B_p D_p^-1, D_p = sum_i w_ip (X_i - x_p)(X_i - x_p)^T, diagonal for
/// tensor-product functions. (Compression is positive, hence the sign of f.)
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
      if constexpr (Carried != Affine::none) {
        const auto carried = points_.affine.load(block);
        for (int d = 0; d < dim; ++d) momentum_slope[d] = mass * carried[d];
      }
      if (forces == Forces::with) {
        const auto stress = volume(block) * plus_isotropic(points_.sigma.load(block), block.load(points_.pressure_correction));
        for (int d = 0; d < dim; ++d)
          for (int i = 0; i < dim; ++i) force_slope[d][i] = component(stress, i, d);
        if constexpr (K::axisymmetric) force[0] = stress[2] / points_.x.load(block)[0];
      }
    }
    const auto at = neighbours(blocks);
    auto all = narrow<GivenOf, E>(given);
    if constexpr (Carried == Affine::moment)
      for (int d = 0; d < dim; ++d) all.momentum_slope[d] = at.n[d].inverse_inertia * all.momentum_slope[d];
    give(all, at);
  });
}

/// What gate and walls make of a nodal velocity.
template <class K, class S, class E>
[[gnu::noinline]] auto Solver<K, S, E>::constrained_here(Vec v, const std::array<int, dim>& node, double time) const -> Vec {
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

/// v_new = v + dt (f/m + g), then the walls. Work of each force is taken with the mean of old and final velocity, so
/// that it equals the change of nodal kinetic energy exactly. The walls act twice: first on what the points' momenta ask
/// for, which the walls had refused already at the end of the last step: what that costs is the transfer's doing, not
/// theirs. Fixed walls and rollers then do no work, and the wall's account holds friction alone.
template <class K, class S, class E>
void Solver<K, S, E>::accelerate(double dt) {
  struct Work {
    double gain = 0.0, wall = 0.0;  // of kinetic energy; taken by the walls
  };
  std::vector<Work> columns(static_cast<std::size_t>(active_end_[0]));
  for_each_active_column([&](int i) {
    Work sum;
    for_each_node_of_column(i, [&](Node<dim>& node, const auto& index) {
      const double m = node.mass;
      if (m <= 0.0) {
        node.motion.setZero();
        node.change.setZero();
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
    });
    columns[static_cast<std::size_t>(i)] = sum;
  });
  for (const Work& c : columns) {
    ledger_.transfer += c.gain;  // the points book the other halves of both mappings
    ledger_.wall += c.wall;
    ledger_.time_integration -= c.gain + c.wall;  // work of force and gravity, until law and potential energy book theirs
  }
}

/// Momenta to velocities, without forces: for gradients taken from the points' own momenta.
template <class K, class S, class E>
void Solver<K, S, E>::constrain(double time_offset) {
  for_each_active_column([&](int i) {
    for_each_node_of_column(i, [&](Node<dim>& node, const auto& index) {
      if (node.mass > 0.0) node.motion = constrained(Vec(node.motion / node.mass), index, time_ + time_offset);
    });
  });
}

/// v <- sum_{l < m} (I - S+ S)^l v on the nodes; see transfer/xpic.hpp. Uses `change` for the running term.
template <class K, class S, class E>
void Solver<K, S, E>::sharpen_velocity() {
  std::vector<Vec> term(points_.size());
  const auto sweep = [&](auto&& f) {
    for_each_active_column([&](int i) { for_each_node_of_column(i, f); });
  };
  std::vector<Vec> sum(grid_.nodes.size());
  const auto index_of = [&](const Node<dim>& node) { return static_cast<std::size_t>(&node - grid_.nodes.data()); };
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
        for_each_weight(p, [&](Node<dim>& node, double w) { node.change += (w * points_.mass[p]) * term[p]; });
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
  });
}

/// Once for every node, not for every point that takes them.
template <class K, class S, class E>
void Solver<K, S, E>::narrow_velocities() {
  for_each_active_column([&](int i) {
    for_each_node_of_column(i, [&](const Node<dim>& node, const auto&) {
      velocities_[static_cast<std::size_t>(&node - grid_.nodes.data())] = FloatNode<dim>(node);
    });
  });
}

/// From the nodes to the points: new velocity, affine part and displacement, or grad v, or both in one pass over the nodes.
template <class K, class S, class E>
void Solver<K, S, E>::gather(Gathered what, double dt) {
  const Filter filter{relaxed(dt, setup_.numerics.relaxation_time), relaxed(dt, setup_.numerics.gradient_relaxation_time)};
  std::vector<Sums> sums(strips_.size());
  if (what != Gathered::velocity) rates_.clear();
  if constexpr (halves == 2) narrow_velocities();
  with_affine([&](auto carried) {
    for_each_strip([&](std::size_t s) { sums[s] = gather_strip<carried.value>(strips_[s], what, filter, dt); });
  });
  if (what != Gathered::gradient) {
    double before = 0.0, after = 0.0;
    max_speed_ = 0.0;
    for (const Sums& s : sums) {
      before += s.kinetic_before, after += s.kinetic_after;
      max_speed_ = std::max(max_speed_, s.speed);
    }
    ledger_.transfer += before - after;
    ledger_.kinetic = after;
    drift_ += max_speed_ * dt;
  }
  if (what != Gathered::velocity && setup_.numerics.averaging == VolumetricAveraging::nodal) average_over_nodes(volumetric_rate_);
}

template <class K, class S, class E>
template <Affine Carried>
[[gnu::flatten]] auto Solver<K, S, E>::gather_strip(const Strip& strip, Gathered what, const Filter& filter, double dt) -> Sums {
  Wide kinetic_before = 0.0, kinetic_after = 0.0, speed = 0.0;
  const auto take_velocity = [&](const auto& block, const VecOf<Wide>& of_grid, const VecOf<Wide>& increment) {
    const auto old = points_.v.load(block);
    const VecOf<Wide> v = transferred(setup_.numerics.transfer, old, of_grid, increment, filter.velocity);
    points_.v.store(v, block);
    const Wide half_mass = 0.5 * block.load_once(points_.mass);
    kinetic_before += half_mass * old.squaredNorm();
    kinetic_after += half_mass * v.squaredNorm();
    displacement_.store(dt * of_grid, block);
    for (int d = 0; d < dim; ++d) speed = larger(speed, abs(of_grid[d]));
  };
  const auto take_gradient = [&](const auto& block, const VecOf<Wide>& of_grid, const MatOf<Wide>& gradient) {
    Wide divergence = 0.0;
    for (int d = 0; d < dim; ++d) divergence += gradient[d][d];
    if constexpr (K::axisymmetric) {
      const Wide hoop = of_grid[0] / points_.x.load(block)[0];
      block.store(hoop, hoop_);
      divergence += hoop;
    }
    velocity_gradient_.store(gradient, block);
    if (setup_.numerics.averaging != VolumetricAveraging::cell) block.store(-divergence, volumetric_rate_);
    if (averages_rates()) {
      const Wide v = volume(block), e = block.load(points_.void_ratio);
      const Wide mixed = select(e < loosest_mixed_, block.load_once(points_.mass), Wide(0.0));
      rates_.give(block.load(cell_), {v, -(v * divergence), mixed, mixed * e});
    }
  };
  const auto take_affine = [&](const auto& blocks, const auto& at, const CollectedOf<E>& all) {
    if constexpr (Carried == Affine::moment) store_halves<E>(all.moment, blocks, points_.affine);
    if constexpr (Carried == Affine::gradient) {
      Eigen::Matrix<E, dim, dim> own, increment, grid_gradient;
      MatOf<E> gradient = load_halves<E>(points_.affine, blocks);
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
      store_halves<E>(gradient, blocks, points_.affine);
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
    }
    if (what != Gathered::velocity) {
      const auto gradient = widen<MatOf, E>(all.slope);
#pragma GCC unroll 2
      for (std::size_t h = 0; h < halves; ++h) take_gradient(blocks[h], v[h], gradient[h]);
    }
  });
  Sums sum;
  sum.kinetic_before = reduce(kinetic_before), sum.kinetic_after = reduce(kinetic_after), sum.speed = hmax(speed);
  return sum;
}

/// Moves the points; a point that would leave the grid ends the run, named.
template <class K, class S, class E>
void Solver<K, S, E>::move() {
  std::vector<Sums> sums(strips_.size());
  pressures_.clear();
  for_each_strip([&](std::size_t s) {
    Wide potential = 0.0;
    for_each_block(strips_[s], [&](const auto& block) {
      const auto x = points_.x.load(block) + displacement_.load(block);
      points_.x.store(x, block);
      Wide height = 0.0, cell = 0.0;
      Mask<Wide> inside(true);
      for (int d = 0; d < dim; ++d) {
        const auto& axis = grid_.axes[d];
        height -= setup_.gravity[d] * x[d];
        inside = inside && x[d] >= 0.0 && x[d] < axis.cells * axis.h;
        cell = cell * static_cast<double>(active_end_[d] - active_begin_[d]) + trunc(x[d] * axis.inverse_h) - static_cast<double>(active_begin_[d]);
      }
      potential += block.load_once(points_.mass) * height;
      cell = select(inside, cell, Wide(0.0));
      block.store(cell, cell_);
      give_pressure(block, cell);
      if (!all(inside))
        for (std::size_t lane = 0; lane < block.count; ++lane)
          if (!inside[lane]) sums[s].escaped = static_cast<std::ptrdiff_t>(block(lane));
    });
    sums[s].potential = reduce(potential);
  });
  double potential = 0.0;
  for (const Sums& s : sums) {
    potential += s.potential;
    if (s.escaped >= 0) {
      const auto p = static_cast<std::size_t>(s.escaped);
      const Vec3 x = position(p);
      throw SolverError(fmt::format("point {}: left the grid at ({:.4g}, {:.4g}, {:.4g}) m, t = {:.4g} s (speed {:.3g} m/s) "
                                    "lengthen geometry.floor_length, or lower mpm.time_step_fraction if the speed is absurd",
                                    points_.id[p], x[0], x[1], x[2], time_, velocity(p).norm()));
    }
  }
  ledger_.time_integration += ledger_.potential - potential;
  ledger_.potential = potential;
}

/// Void ratio from det F, then the law; books what it held, dissipated, and took as work. A point that has come to fill its
/// cell is detached: it has nothing left to push against. The law sees the part of its strain that led there, and from then
/// on none, and its stress stays its own; what that stress did to the grid beyond is booked as the detachment's.
template <class K, class S, class E>
void Solver<K, S, E>::update_stress(double dt) {
  std::vector<Sums> sums(strips_.size());
  const double mixing_rate = relaxed(dt, setup_.numerics.void_ratio_relaxation_time) / dt;
  for_each_strip_at_once([&](std::size_t s) {
    for_each_chunk(strips_[s], [&](const Strip& chunk, Update& update) {
      if (sums[s].escaped >= 0) return;
      deform(chunk, dt, mixing_rate, update, sums[s]);
      body_->update(chunk.begin, update.batch);
      book(chunk, dt, update, sums[s]);
    });
  });
  const EnergyLedger before = ledger_;
  ledger_.stored = ledger_.fluctuation = 0.0;
  fastest_ = {};
  for (const Sums& s : sums) {
    if (s.escaped >= 0) {
      const auto p = static_cast<std::size_t>(s.escaped);
      throw SolverError(fmt::format("point {}: volume inverted (void ratio {:.3g}) at ({:.4g}, {:.4g}) m, t = {:.4g} s lower "
                                    "mpm.time_step_fraction",
                                    points_.id[p], points_.void_ratio[p], position(p)[0], position(p)[1], time_ + dt));
    }
    ledger_.stored += s.stored;
    ledger_.fluctuation += s.fluctuation;
    ledger_.plastic += s.plastic;
    ledger_.collisional += s.collisional;
    ledger_.detached += s.detached;
    if (s.fastest.rate > fastest_.rate) fastest_ = s.fastest;
    ledger_.mixing -= s.mixing;  // work that the points took and the grid did not give
    ledger_.time_integration += s.mixing - s.detached;
  }
  // The grid gave its own figure for this work when it accelerated; what the two do not agree on is the integrator's.
  const double absorbed = (ledger_.stored + ledger_.fluctuation + ledger_.plastic + ledger_.collisional) -
                          (before.stored + before.fluctuation + before.plastic + before.collisional);
  ledger_.time_integration -= absorbed;
}

/// What the law is to see of the step, and the void ratios it leads to. Points of a cell share its rate of volume change, and
/// their void ratios relax to its mean, mass-weighted, so that the volume of the cell stays; the law sees the strain. Without this
/// they would keep for ever what their void ratios differ by; on a critical-state locus 1e-5 of it is 1 kPa, and one point in
/// four carries the load of all. Points more than twice as loose as any was at the start are not in contact with the others and
/// do not mix.
template <class K, class S, class E>
[[gnu::flatten]] void Solver<K, S, E>::deform(const Strip& chunk, double dt, double mixing_rate, Update& update, Sums& sum) {
  std::copy_n(&points_.regime[chunk.begin], update.batch.size, update.batch.regime.begin());
  for_each_block(chunk, [&](const auto& block) {
    const Wide e = block.load(points_.void_ratio);
    Wide volumetric_rate = 0.0;
    if (setup_.numerics.averaging != VolumetricAveraging::cell) volumetric_rate = block.load(volumetric_rate_);
    if (averages_rates()) {
      const auto mean = rates_.take(block.load(cell_));
      if (setup_.numerics.averaging == VolumetricAveraging::cell) volumetric_rate = mean.value;
      const Wide mixing = select(e < loosest_mixed_, mixing_rate * (e - mean.other_value) / (1.0 + e), Wide(0.0));
      block.from(chunk.begin).store(mixing, update.mixing.data());
      volumetric_rate += mixing;
    }
    const auto gradient = velocity_gradient_.load(block);
    Wide hoop = 0.0;
    if constexpr (K::axisymmetric) hoop = block.load(hoop_);
    const auto L = [&](int i, int j) {  // dv_i/dx_j
      if (K::axisymmetric && i == 2 && j == 2) return hoop;
      return i < dim && j < dim ? gradient[static_cast<std::size_t>(j)][i] : Wide(0.0);
    };
    constexpr double r = 1.0 / std::numbers::sqrt2;
    DeformationOf<Wide> step;
    step.D = {-L(0, 0), -L(1, 1), -L(2, 2),  // compression positive
              -r * (L(0, 1) + L(1, 0)), -r * (L(1, 2) + L(2, 1)), -r * (L(2, 0) + L(0, 2))};
    step.D = plus_isotropic(step.D, (volumetric_rate - trace(step.D)) * (1.0 / 3));
    step.spin << 0.5 * (L(2, 1) - L(1, 2)), 0.5 * (L(0, 2) - L(2, 0)), 0.5 * (L(1, 0) - L(0, 1));
    step.dt = dt;
    // 1 + e_new = det(I + dt L) (1 + e)
    const Wide J = stretched_volume(dt * step.D, dt * step.spin);
    step.void_ratio_old = e;
    step.void_ratio = (1.0 + step.void_ratio_old) * J - 1.0;
    const Wide loosest = loosest_void_ratio(points_.x.load(block), block.load(points_.mass));
    if (const auto fills = step.void_ratio >= loosest; any(fills)) {
      const auto log = [](const Wide& a) { return each_lane([](double b) { return std::log(b); }, a); };
      const Wide room = log((1.0 + loosest) / (1.0 + step.void_ratio_old));
      const Wide share = select(fills, select(room > 0.0, room / log(J), Wide(0.0)), Wide(1.0));
      const Wide volume = block.load_once(points_.mass) * (1.0 + step.void_ratio_old) * specific_volume_;
      sum.detached += reduce(dt * (1.0 - share) * volume * points_.sigma.load(block).dot(step.D));
      step.void_ratio = select(fills, loosest, step.void_ratio);
      step.D = share * step.D;
      for (std::size_t lane = 0; lane < Wide::size(); ++lane)
        if (fills[lane]) update.detached.push_back(block(lane) - chunk.begin);
    }
    if (!all(step.void_ratio > 0.0))
      for (std::size_t lane = 0; lane < Wide::size(); ++lane)
        if (!(step.void_ratio[lane] > 0.0)) sum.escaped = static_cast<std::ptrdiff_t>(block(lane));
    block.store(step.void_ratio, points_.void_ratio);
    block.store(block.load(points_.deviatoric_strain) + dt * std::sqrt(2.0 / 3.0) * deviator(step.D).norm(),
                points_.deviatoric_strain);
    update.batch.steps.store(step, block.from(chunk.begin), Where::step);
  });
}

/// What the law made of it, to the points and to the sums. What a law without fluctuations leaves at zero is not touched.
template <class K, class S, class E>
[[gnu::flatten]] void Solver<K, S, E>::book(const Strip& chunk, double dt, Update& update, Sums& sum) {
  Batch& batch = update.batch;
  for (const std::size_t i : update.detached) batch.sigma[i].setZero();
  std::copy_n(batch.regime.begin(), batch.size, &points_.regime[chunk.begin]);
  const bool fluctuates = body_->fluctuates(), mixes = averages_rates();
  EnergiesOf<Wide> total;
  Wide mixed = 0.0;
  for_each_block(chunk, [&](const auto& block) {
    const auto row = block.from(chunk.begin);
    const auto now = batch.energies.load(row);
    const auto sigma = batch.sigma.load(row, Where::tensor);
    points_.sigma.store(sigma, block, Where::tensor);
    block.store(now.stored, points_.stored);
    block.store(block.load(points_.plastic) + now.plastic, points_.plastic);
    const Wide m = block.load_once(points_.mass), pressure = trace(sigma) * (1.0 / 3.0);
    if (mixes) mixed += 0.5 * dt * volume(block) * (block.load(pressure_) + pressure) * row.load(update.mixing.data());
    if (mixes || setup_.numerics.averaging != VolumetricAveraging::none) block.store(pressure, pressure_);
    total.stored += m * now.stored;
    total.plastic += m * now.plastic;
    if (fluctuates) {
      block.store(row.load(batch.granular_temperature), points_.granular_temperature);
      block.store(now.fluctuation, points_.fluctuation);
      block.store(block.load(points_.collisional) + now.collisional, points_.collisional);
      total.fluctuation += m * now.fluctuation;
      total.collisional += m * now.collisional;
    }
    auto stability = batch.stability.load(row);
    if (!fluctuates) stability.viscosity = 0.0;
    limit_step(block, stability, sum.fastest);
  });
  sum.stored += reduce(total.stored);
  sum.fluctuation += reduce(total.fluctuation);
  sum.plastic += reduce(total.plastic);
  sum.collisional += reduce(total.collisional);
  sum.mixing += reduce(mixed);
}

/// Granular temperature flows, q = -kappa grad T, between the points and through no wall:
///   T_i = sum_p w_ip m_p T_p / m_i,  m_i de_i = dt sum_p V_p grad w_ip . q_p,  de_p = sum_i w_ip de_i  [J/kg].
/// The functions' slopes cancel at every point, so that nothing is gained or lost; where a point is asked for more than
/// it holds, what that creates is booked. Explicit, in sub-steps of half the largest stable, 3/2 rho h^2/(4 dim kappa).
template <class K, class S, class E>
void Solver<K, S, E>::conduct(double dt) {
  const double h = setup_.numerics.h;
  std::vector<double> rates(strips_.size());  // kappa/rho [m2/s]
  for_each_strip([&](std::size_t s) {
    for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
      scratch_[p] = body_->conductivity(p, points_.void_ratio[p]) * volume(p);
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
      for_each_weight(p, [&](const Node<dim>& node, double, const Vec& slope) { flux -= node.motion[0] / node.mass * slope; });
      flux *= scratch_[p] * dt / static_cast<double>(rounds);
      for_each_weight(p, [&](Node<dim>& node, double, const Vec& slope) { node.change[0] += slope.dot(flux); });
    });
    std::vector<Sums> sums(strips_.size());
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
        double energy = 0.0;
        for_each_weight(p, [&](const Node<dim>& node, double w) { energy += w * node.change[0] / node.mass; });
        points_.granular_temperature[p] = body_->heat(p, energy);
        const double held = 1.5 * points_.granular_temperature[p], change = held - points_.fluctuation[p];
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

/// The internal force takes the pressure through the same average as the volumetric rate, so that the work of the two
/// is the same: sum V p avg(tr D) = sum V avg(p) tr D.
template <class K, class S, class E>
void Solver<K, S, E>::share_pressure() {
  const auto correct = [&](const auto& block, const Wide& mean) {
    block.store(mean - block.load(pressure_), points_.pressure_correction);
  };
  switch (setup_.numerics.averaging) {
    case VolumetricAveraging::none: return;
    case VolumetricAveraging::cell:
      return for_each_block_at_once([&](const auto& block) { correct(block, pressures_.take(block.load(cell_)).value); });
    case VolumetricAveraging::nodal:
      scratch_ = pressure_;
      average_over_nodes(scratch_);
      return for_each_block_at_once([&](const auto& block) { correct(block, block.load(scratch_)); });
  }
}

/// Points to nodes and back, volume-weighted: avg_p = sum_i w_ip (sum_q w_iq V_q a_q)/(sum_q w_iq V_q).
template <class K, class S, class E>
void Solver<K, S, E>::average_over_nodes(std::vector<double>& field) {
  // `change` is free between stages: its first number holds the weight, its second the value
  for_each_active_column(
      [&](int i) { for_each_node_of_column(i, [](Node<dim>& node, const auto&) { node.change.setZero(); }); });
  for_each_point([&](std::size_t p) {
    const double v = volume(p);
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
    ledger_.stored += m * points_.stored[p];
    ledger_.fluctuation += m * points_.fluctuation[p];
    max_speed_ = std::max(max_speed_, points_.v[p].cwiseAbs().maxCoeff());
  }
}

/// Largest stable step of a Kelvin-Voigt point on the grid [Belytschko2014, Eq. 6.2.19 with damping]:
///   dt = 2/omega (sqrt(1 + xi^2) - xi),  omega = 2 c sqrt(dim)/h,  xi = nu omega/(2 c^2),  nu = viscosity/density
/// (A point alone is stiffer than the bulk: c^2 sum_k dw_k^2/w_k summed over the axes, of quadratic B-splines up to
/// 6 dim c^2/h^2; its limit is sqrt(2/3) of this one.)
template <class K, class S, class E>
template <class B>
void Solver<K, S, E>::limit_step(const B& block, const StabilityOf<Wide>& of, Fastest& fastest) const {
  const double k = largest_wave_number_;
  const Wide inverse_density = (1.0 + block.load(points_.void_ratio)) * specific_volume_;
  const Wide c2 = of.modulus * inverse_density, damping = 0.5 * k * (of.viscosity * inverse_density);
  // 2/omega (sqrt(1 + xi^2) - xi) = 2/(k (sqrt(c^2 + (nu k/2)^2) + nu k/2)), without dividing by c
  const Wide rate = k * (sqrt(c2 + damping * damping) + damping);
  if (!any(rate > fastest.rate)) return;
  for (std::size_t lane = 0; lane < Wide::size(); ++lane)
    if (rate[lane] > fastest.rate) {
      const std::size_t p = block(lane);
      fastest = {rate[lane],
                 damping[lane] * damping[lane] > c2[lane] ? Limit::viscous
                 : points_.regime[p] == 3                 ? Limit::critical_state
                                                          : Limit::elastic,
                 points_.id[p]};
    }
}

/// That of the fastest point, and no point may cross more than a fifth of a cell per step. A law may lose all its stress, and
/// with it all that limits the step; what it meets when contact comes back is not known before, but the step that was stable at
/// the start, four times, still finds it in time.
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
