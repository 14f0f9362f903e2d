// The stages of Solver::step(). Included by solver.hpp only.
#pragma once

namespace grainpair {

/// Sorts points by cell, cuts them into strips, and finds the nodes they can reach until the next sorting.
template <class K, class S>
void Solver<K, S>::bin_points() {
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
  cell_weight_.assign(cells, 0.0);
  cell_value_.assign(cells, 0.0);
  drift_ = 0.0;
}

template <class K, class S>
void Solver<K, S>::clear_grid() {
  for_each_active_column([&](int i) {
    for_each_node_of_column(i, [](Node& node, const auto&) {
      node.motion = Lanes{};
      node.change = Lanes{};
    });
  });
}

/// Mass, momentum and internal force of the points to the nodes:
///   m_i = sum_p w_ip m_p,  (m v)_i = sum_p w_ip m_p (v_p + C_p (X_i - x_p)),  f_i = sum_p V_p sigma_p grad w_ip
/// where C_p is the point's own gradient or B_p D_p^-1, D_p = sum_i w_ip (X_i - x_p)(X_i - x_p)^T, diagonal for
/// tensor-product functions. (Compression is positive, hence the sign of f.)
template <class K, class S>
template <bool Momentum, bool Force>
void Solver<K, S>::scatter() {
  with_affine([&](auto carried) {
    for_each_strip([&](std::size_t s) { scatter_strip<Momentum, Force, carried.value>(strips_[s]); });
  });
}

template <class K, class S>
template <bool Momentum, bool Force, Affine Carried>
void Solver<K, S>::scatter_strip(const Strip& strip) {
  constexpr bool affine = Carried != Affine::none;
  for (std::size_t p = strip.begin; p < strip.end; ++p) {
    const AxisWeights n = weights(p);
    const double m = points_.mass[p];
    const Lanes base = lanes(m * points_.v[p], m);
    std::array<Lanes, dim> slope{};  // of the point's momentum along each axis
    if constexpr (affine) {
      for (int d = 0; d < dim; ++d)
        slope[d] = lanes(points_.affine[p].col(d) * (Carried == Affine::moment ? m / inertia(n[d]) : m));
    }
    std::array<Lanes, dim> traction;  // V sigma e_d
    Lanes hoop = Lanes{};
    if constexpr (Force) {
      const double v = volume(p);
      SymTensor sigma = points_.sigma[p];
      sigma.template head<3>().array() += points_.pressure_correction[p];
      const Mat3 stress = to_matrix(v * sigma);
      for (int d = 0; d < dim; ++d) traction[d] = lanes(Vec(stress.col(d).template head<dim>()));
      if constexpr (K::axisymmetric) hoop[1] = stress(2, 2) / points_.x[p][0];
    }
    // along the last axis, for a given weight, slope and momentum of the axes before it
    const auto row = [&](Node* node, double w, const Lanes& momentum, const Lanes& gradient) {
      const auto& last = n[dim - 1];
      for (int k = 0; k < S::support; ++k) {
        if constexpr (Momentum) {
          if constexpr (affine)
            node[k].motion += (w * last.w[k]) * (momentum + last.xi[k] * slope[dim - 1]);
          else
            node[k].motion += (w * last.w[k]) * momentum;
        }
        if constexpr (Force) node[k].change += last.w[k] * gradient + (w * last.dw[k]) * traction[dim - 1];
      }
    };
    for (int i = 0; i < S::support; ++i) {
      Node* const plane = &grid_.nodes[static_cast<std::size_t>((n[0].first + i) * grid_.stride[0])];
      const Lanes along_x = affine ? base + n[0].xi[i] * slope[0] : base;
      const double w = n[0].w[i];
      if constexpr (dim == 2) {
        Lanes gradient = Lanes{};
        if constexpr (Force) gradient = n[0].dw[i] * traction[0] + w * hoop;
        row(plane + n[1].first, w, along_x, gradient);
      } else {
        for (int j = 0; j < S::support; ++j) {
          Lanes gradient = Lanes{};
          if constexpr (Force)
            gradient = (n[0].dw[i] * n[1].w[j]) * traction[0] + (w * n[1].dw[j]) * traction[1];
          row(plane + (n[1].first + j) * grid_.stride[1] + n[2].first, w * n[1].w[j],
              affine ? along_x + n[1].xi[j] * slope[1] : along_x, gradient);
        }
      }
    }
  }
}

/// What the walls make of a nodal velocity.
template <class K, class S>
auto Solver<K, S>::constrained(Vec v, const std::array<int, dim>& node, double time) const -> Vec {
  if (setup_.gate.present && v[0] > 0.0 &&
      setup_.gate.closes(grid_.axes[0].node_position[static_cast<std::size_t>(node[0])],
                         grid_.axes[1].node_position[static_cast<std::size_t>(node[1])], time))
    v[0] = 0.0;
  for (int d = dim - 1; d >= 0; --d) {
    if (node[d] == 0) v = setup_.walls[d][0].apply(v, d, 1.0);
    if (node[d] == grid_.axes[d].nodes - 1) v = setup_.walls[d][1].apply(v, d, -1.0);
  }
  return v;
}

/// v_new = v + dt (f/m + g), then the walls. Work of each force is taken with the mean of old and final velocity, so
/// that it equals the change of nodal kinetic energy exactly. The walls act twice: first on what the points' momenta ask
/// for, which the walls had refused already at the end of the last step: what that costs is the transfer's doing, not
/// theirs. Fixed walls and rollers then do no work, and the wall's account holds friction alone.
template <class K, class S>
void Solver<K, S>::accelerate(double dt) {
  struct Work {
    double before = 0.0, after = 0.0, internal = 0.0, gravity = 0.0, wall = 0.0;
  };
  std::vector<Work> columns(static_cast<std::size_t>(active_end_[0]));
  for_each_active_column([&](int i) {
    Work sum;
    for_each_node_of_column(i, [&](Node& node, const auto& index) {
      const double m = node.motion[0];
      if (m <= 0.0) {
        node.motion = Lanes{};
        node.change = Lanes{};
        return;
      }
      const Vec mapped = unlanes(node.motion) / m;
      const Vec old = constrained(mapped, index, time_);
      const Vec force = unlanes(node.change);
      const Vec free = old + dt * (force / m + setup_.gravity);
      const Vec v = constrained(free, index, time_ + dt);
      const Vec mean = 0.5 * (old + v);
      sum.before += 0.5 * m * old.squaredNorm();
      sum.after += 0.5 * m * v.squaredNorm();
      sum.internal += dt * force.dot(mean);
      sum.gravity += dt * m * setup_.gravity.dot(mean);
      sum.wall -= m * (v - free).dot(mean);
      node.motion = lanes(v, m);
      node.change = lanes(v - mapped);
    });
    columns[static_cast<std::size_t>(i)] = sum;
  });
  for (const Work& c : columns) {
    ledger_.transfer += c.after - c.before;  // the points book the other halves of both mappings
    ledger_.wall += c.wall;
    ledger_.time_integration -= c.internal + c.gravity;  // until law and potential energy book theirs
  }
}

/// Momenta to velocities, without forces: for gradients taken from the points' own momenta.
template <class K, class S>
void Solver<K, S>::constrain(double time_offset) {
  for_each_active_column([&](int i) {
    for_each_node_of_column(i, [&](Node& node, const auto& index) {
      const double m = node.motion[0];
      const Vec v = m > 0.0 ? constrained(Vec(unlanes(node.motion) / m), index, time_ + time_offset) : Vec(Vec::Zero());
      node.motion = lanes(v, m);
    });
  });
}

/// v <- sum_{l < m} (I - S+ S)^l v on the nodes; see transfer/xpic.hpp. Uses `change` for the running term.
template <class K, class S>
void Solver<K, S>::sharpen_velocity() {
  std::vector<Vec> term(points_.size());
  const auto sweep = [&](auto&& f) {
    for_each_active_column([&](int i) { for_each_node_of_column(i, f); });
  };
  std::vector<Lanes> sum(grid_.nodes.size());
  const auto index_of = [&](const Node& node) { return static_cast<std::size_t>(&node - grid_.nodes.data()); };
  sweep([&](Node& node, const auto&) { sum[index_of(node)] = node.motion; });
  for (int l = 1; l < setup_.numerics.xpic_order; ++l) {
    // S: the term at the points
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
        Lanes value = Lanes{};
        for_each_weight(weights(p), [&](const Node& node, double w) { value += w * node.motion; });
        term[p] = unlanes(value);
      }
    });
    sweep([&](Node& node, const auto&) { node.change = Lanes{}; });
    // S+: back to the nodes, mass-weighted; change[0] is not needed, the nodal mass is known
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
        const Lanes value = lanes(points_.mass[p] * term[p]);
        for_each_weight(weights(p), [&](Node& node, double w) { node.change += w * value; });
      }
    });
    sweep([&](Node& node, const auto& index) {
      const double m = node.motion[0];
      if (m <= 0.0) return;
      const Vec next = constrained(unlanes(node.motion) - Vec(unlanes(node.change) / m), index, time_);
      node.motion = lanes(next, m);
      sum[index_of(node)] += lanes(next);
    });
  }
  sweep([&](Node& node, const auto&) {
    node.motion = sum[index_of(node)];
    node.change = Lanes{};
  });
}

/// From the nodes to the points: new velocity, affine part and displacement (Velocity), grad v (Gradient), or both in one
/// pass over the nodes.
template <class K, class S>
template <bool Velocity, bool Gradient>
void Solver<K, S>::gather(double dt) {
  const auto towards_grid = [&](double tau) { return tau > 0.0 ? -std::expm1(-dt / tau) : 0.0; };
  const Filter filter{towards_grid(setup_.numerics.relaxation_time), towards_grid(setup_.numerics.gradient_relaxation_time)};
  std::vector<Sums> sums(strips_.size());
  const auto sweep = [&](auto carried) {
    for_each_strip([&](std::size_t s) {
      sums[s] = gather_strip<Velocity, Gradient, carried.value>(strips_[s], filter, dt);
    });
  };
  if constexpr (Velocity)
    with_affine(sweep);
  else
    sweep(std::integral_constant<Affine, Affine::none>{});
  if constexpr (Velocity) {
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
  if constexpr (Gradient) {
    average_volumetric_rate();
    mix_void_ratios(dt);
  }
}

template <class K, class S>
template <bool Velocity, bool Gradient, Affine Carried>
auto Solver<K, S>::gather_strip(const Strip& strip, const Filter& filter, double dt) -> Sums {
  constexpr bool moments = Carried != Affine::none, moment_increments = Carried == Affine::gradient;
  /// What one pass collects: v and its increment, the first moments of both and the slope of v along each axis.
  struct Collected {
    Lanes v{}, dv{};
    std::array<Lanes, dim> moment{}, moment_increment{}, slope{};
    /// Adds `inner`, the sums along the axes after `axis`, at node k of that axis.
    void add(const Weights<S::support>& n, int k, const Collected& inner, int axis) {
      v += n.w[k] * inner.v;
      if constexpr (Velocity) dv += n.w[k] * inner.dv;
      if constexpr (moments) moment[axis] += (n.w[k] * n.xi[k]) * inner.v;
      if constexpr (moment_increments) moment_increment[axis] += (n.w[k] * n.xi[k]) * inner.dv;
      if constexpr (Gradient) slope[axis] += n.dw[k] * inner.v;
      for (int d = axis + 1; d < dim; ++d) {
        if constexpr (moments) moment[d] += n.w[k] * inner.moment[d];
        if constexpr (moment_increments) moment_increment[d] += n.w[k] * inner.moment_increment[d];
        if constexpr (Gradient) slope[d] += n.w[k] * inner.slope[d];
      }
    }
  };
  Sums sum;
  for (std::size_t p = strip.begin; p < strip.end; ++p) {
    const AxisWeights n = weights(p);
    const auto row = [&](const Node* node) {  // along the last axis
      Collected out;
      for (int k = 0; k < S::support; ++k) {
        Collected at_node;
        at_node.v = node[k].motion;
        at_node.dv = node[k].change;
        out.add(n[dim - 1], k, at_node, dim - 1);
      }
      return out;
    };
    Collected all;
    for (int i = 0; i < S::support; ++i) {
      const Node* const plane = &grid_.nodes[static_cast<std::size_t>((n[0].first + i) * grid_.stride[0])];
      if constexpr (dim == 2) {
        all.add(n[0], i, row(plane + n[1].first), 0);
      } else {
        Collected middle;
        for (int j = 0; j < S::support; ++j)
          middle.add(n[1], j, row(plane + (n[1].first + j) * grid_.stride[1] + n[2].first), 1);
        all.add(n[0], i, middle, 0);
      }
    }
    const Vec grid_velocity = unlanes(all.v);
    if constexpr (Velocity) {
      Vec& v_p = points_.v[p];
      const double m = points_.mass[p];
      sum.kinetic_before += 0.5 * m * v_p.squaredNorm();
      v_p = transferred(setup_.numerics.transfer, v_p, grid_velocity, Vec(unlanes(all.dv)), filter.velocity);
      sum.kinetic_after += 0.5 * m * v_p.squaredNorm();
      if constexpr (Carried == Affine::moment)
        for (int d = 0; d < dim; ++d) points_.affine[p].col(d) = unlanes(all.moment[d]);
      if constexpr (Carried == Affine::gradient) {
        Mat increment, grid_gradient;
        for (int d = 0; d < dim; ++d) {
          const double inverse = 1.0 / inertia(n[d]);
          increment.col(d) = inverse * unlanes(all.moment_increment[d]);
          grid_gradient.col(d) = inverse * unlanes(all.moment[d]);
        }
        points_.affine[p] = AffineFlip::gradient(points_.affine[p], increment, grid_gradient, filter.gradient, dt);
      }
      displacement_[p] = dt * grid_velocity;
      sum.speed = std::max(sum.speed, grid_velocity.cwiseAbs().maxCoeff());
    }
    if constexpr (Gradient) {
      const auto L = [&](int i, int j) {  // dv_i/dx_j
        if (K::axisymmetric && i == 2 && j == 2) return grid_velocity[0] / points_.x[p][0];
        return i < dim && j < dim ? all.slope[static_cast<std::size_t>(j)][i + 1] : 0.0;
      };
      constexpr double r = 1.0 / std::numbers::sqrt2;
      Deformation& step = deformation_[p];
      step.D << -L(0, 0), -L(1, 1), -L(2, 2),  // compression positive
          -r * (L(0, 1) + L(1, 0)), -r * (L(1, 2) + L(2, 1)), -r * (L(2, 0) + L(0, 2));
      step.spin << 0.5 * (L(2, 1) - L(1, 2)), 0.5 * (L(0, 2) - L(2, 0)), 0.5 * (L(1, 0) - L(0, 1));
    }
  }
  return sum;
}

/// Replaces tr D by its average, if asked.
template <class K, class S>
void Solver<K, S>::average_volumetric_rate() {
  if (setup_.numerics.averaging == VolumetricAveraging::none) return;
  for (std::size_t p = 0; p < points_.size(); ++p) scratch_[p] = trace(deformation_[p].D);
  average(scratch_);
  for (std::size_t p = 0; p < points_.size(); ++p)
    deformation_[p].D.template head<3>().array() += (scratch_[p] - trace(deformation_[p].D)) / 3.0;
}

/// Void ratios of the points of a cell relax to their mean, mass-weighted, so that the volume of the cell stays; the law sees
/// the strain. Points of one cell share its rate of volume change and keep for ever what their void ratios differ by; on
/// a critical-state locus 1e-5 of it is 1 kPa, and one point in four carries the load of all. Points more than twice
/// as loose as any was at the start are not in contact with the others and take no part.
template <class K, class S>
void Solver<K, S>::mix_void_ratios(double dt) {
  const double tau = setup_.numerics.void_ratio_relaxation_time;
  if (tau <= 0.0) return;
  const double filter = -std::expm1(-dt / tau);
  const auto for_each_mixed = [&](auto&& f) {
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p)
        if (points_.void_ratio[p] < loosest_mixed_) f(p, active_cell_of(points_.x[p]));
    });
  };
  std::fill(cell_weight_.begin(), cell_weight_.end(), 0.0);
  std::fill(cell_value_.begin(), cell_value_.end(), 0.0);
  std::fill(mixing_.begin(), mixing_.end(), 0.0);
  for_each_mixed([&](std::size_t p, std::size_t cell) {
    cell_weight_[cell] += points_.mass[p];
    cell_value_[cell] += points_.mass[p] * points_.void_ratio[p];
  });
  for_each_mixed([&](std::size_t p, std::size_t cell) {
    const double e = points_.void_ratio[p], mean = cell_value_[cell] / cell_weight_[cell];
    mixing_[p] = filter * (e - mean) / ((1.0 + e) * dt);
    deformation_[p].D.template head<3>().array() += mixing_[p] / 3.0;
  });
}

/// Moves the points; a point that would leave the grid ends the run, named.
template <class K, class S>
void Solver<K, S>::move(double dt) {
  std::vector<Sums> sums(strips_.size());
  for_each_strip([&](std::size_t s) {
    Sums& sum = sums[s];
    for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
      points_.x[p] += displacement_[p];
      sum.potential -= points_.mass[p] * setup_.gravity.dot(points_.x[p]);
      for (int d = 0; d < dim; ++d)
        if (!(points_.x[p][d] >= 0.0 && points_.x[p][d] < grid_.axes[d].cells * grid_.axes[d].h))
          sum.escaped = static_cast<std::ptrdiff_t>(p);
    }
  });
  double potential = 0.0;
  for (const Sums& s : sums) {
    potential += s.potential;
    if (s.escaped >= 0) {
      const auto p = static_cast<std::size_t>(s.escaped);
      const Vec3 x = position(p);
      throw SolverError(fmt::format("point {}: left the grid at ({:.4g}, {:.4g}, {:.4g}) m, t = {:.4g} s (speed {:.3g} m/s) "
                                    "lengthen geometry.floor_length, or lower mpm.time_step_fraction if the speed is absurd",
                                    points_.id[p], x[0], x[1], x[2], time_ + dt, velocity(p).norm()));
    }
  }
  ledger_.time_integration += ledger_.potential - potential;
  ledger_.potential = potential;
}

/// Void ratio from det F, then the law; books what it held, dissipated, and took as work. A point that has come to fill its
/// cell is detached: it has nothing left to push against. The law sees the part of its strain that led there, and from then
/// on none, and its stress stays its own; what that stress did to the grid beyond is booked as the detachment's.
template <class K, class S>
void Solver<K, S>::update_stress(double dt) {
  std::vector<Sums> sums(strips_.size());
  std::vector<Stability> stability(points_.size());
  for_each_strip([&](std::size_t s) {
    const auto [begin, end] = strips_[s];
    Sums& sum = sums[s];
    for (std::size_t p = begin; p < end; ++p) {
      Deformation& step = deformation_[p];
      // 1 + e_new = det(I + dt L) (1 + e); D is -sym L, and the spin completes it
      Mat3 increment = -dt * to_matrix(step.D);
      const Vec3 w = dt * step.spin;
      increment(0, 1) -= w[2], increment(1, 0) += w[2];
      increment(0, 2) += w[1], increment(2, 0) -= w[1];
      increment(1, 2) -= w[0], increment(2, 1) += w[0];
      const double J = (Mat3::Identity() + increment).determinant();
      step.dt = dt;
      step.void_ratio_old = points_.void_ratio[p];
      step.void_ratio = (1.0 + step.void_ratio_old) * J - 1.0;
      if (const double loosest = loosest_void_ratio(p); step.void_ratio >= loosest) {
        const double room = std::log((1.0 + loosest) / (1.0 + step.void_ratio_old));
        const double share = room > 0.0 ? room / std::log(J) : 0.0;
        sum.detached += dt * (1.0 - share) * volume(p) * points_.sigma[p].dot(step.D);
        step.void_ratio = loosest;
        step.D *= share;
      }
      if (!(step.void_ratio > 0.0)) sum.escaped = static_cast<std::ptrdiff_t>(p);
      points_.void_ratio[p] = step.void_ratio;
      points_.deviatoric_strain[p] += dt * std::sqrt(2.0 / 3.0) * deviator(step.D).norm();
      scratch_[p] = trace(points_.sigma[p]) / 3.0;
    }
    if (sum.escaped >= 0) return;
    const auto n = end - begin;
    const auto part = [&](auto& v) { return std::span(v).subspan(begin, n); };
    body_->update(begin, {part(deformation_), part(points_.sigma), part(step_energies_), part(work_),
                          part(points_.granular_temperature), part(stability), part(points_.regime)});
    store_update(begin, end, stability);
    for (std::size_t p = begin; p < end; ++p) {
      if (points_.void_ratio[p] >= loosest_void_ratio(p)) points_.sigma[p].setZero();
      const double m = points_.mass[p];
      sum.mixing += dt * volume(p) * 0.5 * (scratch_[p] + trace(points_.sigma[p]) / 3.0) * mixing_[p];
      sum.stored += m * points_.stored[p];
      sum.fluctuation += m * points_.fluctuation[p];
      sum.plastic += m * step_energies_[p].plastic;
      sum.collisional += m * step_energies_[p].collisional;
    }
  });
  const EnergyLedger before = ledger_;
  ledger_.stored = ledger_.fluctuation = 0.0;
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
    ledger_.mixing -= s.mixing;  // work that the points took and the grid did not give
    ledger_.time_integration += s.mixing - s.detached;
  }
  // The grid gave its own figure for this work when it accelerated; what the two do not agree on is the integrator's.
  const double absorbed = (ledger_.stored + ledger_.fluctuation + ledger_.plastic + ledger_.collisional) -
                          (before.stored + before.fluctuation + before.plastic + before.collisional);
  ledger_.time_integration -= absorbed;
}

template <class K, class S>
void Solver<K, S>::store_update(std::size_t begin, std::size_t end, const std::vector<Stability>& stability) {
  for (std::size_t p = begin; p < end; ++p) {
    points_.stored[p] = step_energies_[p].stored;
    points_.fluctuation[p] = step_energies_[p].fluctuation;
    points_.plastic[p] += step_energies_[p].plastic;
    points_.collisional[p] += step_energies_[p].collisional;
    points_.modulus[p] = stability[p].modulus;
    points_.viscosity[p] = stability[p].viscosity;
  }
}

/// The internal force takes the pressure through the same average as the volumetric rate, so that the work of the two
/// is the same: sum V p avg(tr D) = sum V avg(p) tr D.
template <class K, class S>
void Solver<K, S>::update_pressure_correction() {
  if (setup_.numerics.averaging == VolumetricAveraging::none) return;
  for (std::size_t p = 0; p < points_.size(); ++p) scratch_[p] = trace(points_.sigma[p]) / 3.0;
  average(scratch_);
  for (std::size_t p = 0; p < points_.size(); ++p)
    points_.pressure_correction[p] = scratch_[p] - trace(points_.sigma[p]) / 3.0;
}

template <class K, class S>
void Solver<K, S>::average(std::vector<double>& field) {
  if (setup_.numerics.averaging == VolumetricAveraging::cell)
    average_over_cells(field);
  else
    average_over_nodes(field);
}

/// Volume-weighted mean over the points of each cell.
template <class K, class S>
void Solver<K, S>::average_over_cells(std::vector<double>& field) {
  std::fill(cell_weight_.begin(), cell_weight_.end(), 0.0);
  std::fill(cell_value_.begin(), cell_value_.end(), 0.0);
  for_each_strip([&](std::size_t s) {
    for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
      const std::size_t cell = active_cell_of(points_.x[p]);
      cell_weight_[cell] += volume(p);
      cell_value_[cell] += volume(p) * field[p];
    }
  });
  for_each_strip([&](std::size_t s) {
    for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
      const std::size_t cell = active_cell_of(points_.x[p]);
      field[p] = cell_value_[cell] / cell_weight_[cell];
    }
  });
}

/// Points to nodes and back, volume-weighted: avg_p = sum_i w_ip (sum_q w_iq V_q a_q)/(sum_q w_iq V_q).
template <class K, class S>
void Solver<K, S>::average_over_nodes(std::vector<double>& field) {
  // `change` is free between stages: lane 0 holds the weight, lane 1 the value
  for_each_active_column(
      [&](int i) { for_each_node_of_column(i, [](Node& node, const auto&) { node.change = Lanes{}; }); });
  for_each_strip([&](std::size_t s) {
    for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
      const double v = volume(p);
      const Lanes value{v, v * field[p], 0.0, 0.0};
      for_each_weight(weights(p), [&](Node& node, double w) { node.change += w * value; });
    }
  });
  for_each_strip([&](std::size_t s) {
    for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) {
      double mean = 0.0;
      for_each_weight(weights(p), [&](const Node& node, double w) {
        if (node.change[0] > 0.0) mean += w * node.change[1] / node.change[0];
      });
      field[p] = mean;
    }
  });
}

/// Energies held at the start.
template <class K, class S>
void Solver<K, S>::measure_held_energy() {
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
/// and no point may cross more than a cell per step.
template <class K, class S>
TimeStep Solver<K, S>::stable_step() const {
  const double h = setup_.numerics.h;
  TimeStep out{std::numeric_limits<double>::infinity(), Limit::none, 0};
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const double density = setup_.solid_density / (1.0 + points_.void_ratio[p]);
    const double c = std::sqrt(points_.modulus[p] / density);
    const double nu = points_.viscosity[p] / density;
    const double k = 2.0 * std::sqrt(static_cast<double>(dim)) / h;  // largest wave number, times 2/2
    // 2/omega (sqrt(1 + xi^2) - xi) = 2/(k (sqrt(c^2 + (nu k/2)^2) + nu k/2)), without dividing by c
    const double damping = 0.5 * nu * k;
    const double rate = k * (std::sqrt(c * c + damping * damping) + damping);
    if (2.0 < rate * out.dt) {
      out.dt = 2.0 / rate;
      out.limit = damping > c ? Limit::viscous : points_.regime[p] == 3 ? Limit::critical_state : Limit::elastic;
      out.point = points_.id[p];
    }
  }
  out.dt *= setup_.numerics.time_step_fraction;
  if (max_speed_ > 0.0) out.dt = std::min(out.dt, 0.2 * h / max_speed_);
  return out;
}

}  // namespace grainpair
