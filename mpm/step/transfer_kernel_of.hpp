// The sweeps between points and nodes. Included by the units of transfer_kernel.cpp.in alone.
#pragma once

#include "mpm/grid/interpolation_plane.hpp"
#include "mpm/grid/interpolation_space.hpp"
#include "mpm/step/transfer_kernel.hpp"
#include "mpm/transfer/transfer.hpp"

namespace grainpair {

/// Exchanged holds several points' numbers on their way to the nodes and back: Wide, or WideFloat
/// in single precision.
template <int Dim, class Shape, class Exchanged>
class TransferKernelOf final : public TransferKernel<Dim> {
 public:
  TransferKernelOf(const std::array<int, Dim>& cells, double h, double point_size)
      : axes_(axes_of(cells, h, point_size, std::make_index_sequence<Dim>())) {
    this->support = Shape::support, this->reach = Shape::reach;
    this->single = halves == 2;
    this->functions_of_whole_points = requires(typename Shape::Axis axis) { axis.half_size; };
  }

  std::array<GridAxis, Dim> axes() const override {
    std::array<GridAxis, Dim> out;
    for (std::size_t d = 0; d < Dim; ++d) out[d] = axes_[d];
    return out;
  }

  void scatter(const Strip& strip, Forces forces, const GivenCells& pressures,
               Exchange<Dim>& on) const override;

  GatherSums gather(const Strip& strip, GivingCells& rates, Gathered what, const Filter& filter,
                    double dt, Exchange<Dim>& on) const override {
    return affine_of(on.transfer) != Affine::none
               ? gather_as<true>(strip, rates, what, filter, dt, on)
               : gather_as<false>(strip, rates, what, filter, dt, on);
  }

  void weigh(const Eigen::Matrix<double, Dim, 1>& x, const Grid<Dim>& grid,
             NodeWeights<Dim>& out) const override;

 private:
  static constexpr std::size_t halves = Halves<Exchanged>().size();
  template <class Real>
  using VecOf = VectorOf<Dim, Real>;
  template <class Real>
  using MatOf = MatrixOf<Dim, Real>;
  template <class Real>
  using GivenOf = Given<Dim, Real>;
  using Near = Neighbours<Dim, Shape::support, Exchanged>;

  /// Lane by lane until they are asked for.
  struct WideSums {
    Wide kinetic_before = 0.0, kinetic_after = 0.0, speed = 0.0;
  };

  template <bool Carries>
  GatherSums gather_as(const Strip& strip, GivingCells& rates, Gathered what, const Filter& filter,
                       double dt, Exchange<Dim>& on) const;
  static void take_velocity(const Block& block, const VecOf<Wide>& of_grid,
                            const VecOf<Wide>& increment, const Filter& filter, Exchange<Dim>& on,
                            WideSums& sums);
  static void take_affine(const Blocks<Exchanged>& blocks, const Near& at,
                          const Collected<Dim, Exchanged>& nodes, double filter, double dt,
                          Exchange<Dim>& on);
  static void take_gradient(const Block& block, const VecOf<Wide>& of_grid,
                            const MatOf<Wide>& gradient, GivingCells& rates, Exchange<Dim>& on);

  Near neighbours(const Blocks<Exchanged>& blocks, Exchange<Dim>& on) const {
    Near out;
    out.nodes = on.grid.nodes.data();
    if constexpr (halves == 1)
      out.velocities = on.grid.nodes.data();
    else
      out.velocities = on.velocities.data();
    std::array<VecOf<Wide>, halves> x;
    for (std::size_t h = 0; h < halves; ++h) x[h] = on.material.points.x.load(blocks[h]);
#pragma GCC unroll 3
    for (int d = 0; d < Dim; ++d) {
      out.stride[d] = on.grid.stride[d];
      if constexpr (halves == 1)
        Shape::evaluate(axes_[d], x[0][d], out.n[d]);
      else
        Shape::evaluate(axes_[d], {x[0][d], x[1][d]}, out.n[d]);
    }
    return out;
  }

  template <std::size_t... D>
  static std::array<typename Shape::Axis, Dim> axes_of(const std::array<int, Dim>& cells, double h,
                                                       double size, std::index_sequence<D...>) {
    return {typename Shape::Axis(cells[D], h, size)...};
  }

  std::array<typename Shape::Axis, Dim> axes_;
};

/// Mass, momentum and internal force of the points to the nodes:
///   m_i = sum_p w_ip m_p,  (m v)_i = sum_p w_ip m_p (v_p + C_p (X_i - x_p)),
///   f_i = sum_p V_p sigma_p grad w_ip
/// where C_p is the point's own gradient or B_p D_p^-1, D_p = sum_i w_ip (X_i - x_p)(X_i - x_p)^T,
/// diagonal for tensor-product functions. (Compression is positive, hence the sign of f.)
template <int Dim, class S, class E>
GRAINPAIR_FLATTEN void TransferKernelOf<Dim, S, E>::scatter(const Strip& strip, Forces forces,
                                                            const GivenCells& pressures,
                                                            Exchange<Dim>& on) const {
  const Affine affine = affine_of(on.transfer);
  const auto& points = on.material.points;
  for_each_blocks<E>(strip.begin, strip.end, [&](const Blocks<E>& blocks) {
    std::array<GivenOf<Wide>, halves> given;
#pragma GCC unroll 2
    for (std::size_t h = 0; h < given.size(); ++h) {
      const Block& block = blocks[h];
      auto& [mass, momentum, force, momentum_slope, force_slope] = given[h];
      mass = block.load(points.mass);
      momentum = mass * points.v.load(block);
      force = VecOf<Wide>::Zero();
      momentum_slope.fill(VecOf<Wide>::Zero()), force_slope.fill(VecOf<Wide>::Zero());
      if (forces == Forces::with) {
        const auto stress = on.material.volume(block) * on.material.felt_stress(block, pressures);
        for (int d = 0; d < Dim; ++d)
          for (int i = 0; i < Dim; ++i) force_slope[d][i] = component(stress, i, d);
        if (Dim == 2 && on.material.axisymmetric()) force[0] = stress[2] / points.x.load(block)[0];
      }
    }
    const auto at = neighbours(blocks, on);
    auto all = merge<GivenOf, E>(given);
    if (affine != Affine::none) {
      const MatOf<E> carried = points.affine.template load_blocks<E>(blocks);
      for (int d = 0; d < Dim; ++d)
        all.momentum_slope[d] =
            (affine == Affine::moment ? at.n[d].inverse_inertia * all.mass : all.mass) * carried[d];
    }
    give(all, at);
  });
}

template <int Dim, class S, class E>
void TransferKernelOf<Dim, S, E>::take_velocity(const Block& block, const VecOf<Wide>& of_grid,
                                                const VecOf<Wide>& increment, const Filter& filter,
                                                Exchange<Dim>& on, WideSums& sums) {
  auto& points = on.material.points;
  const auto old = points.v.load(block);
  const VecOf<Wide> v =
      transferred(on.transfer, old, of_grid, increment, filter.velocity, filter.most_own_speed);
  points.v.store(v, block);
  const Wide half_mass = 0.5 * block.load(points.mass);
  sums.kinetic_before += half_mass * old.squaredNorm();
  sums.kinetic_after += half_mass * v.squaredNorm();
  for (int d = 0; d < Dim; ++d) sums.speed = larger(sums.speed, abs(of_grid[d]));
}

/// What the scheme carries of the motion around a point.
template <int Dim, class S, class E>
void TransferKernelOf<Dim, S, E>::take_affine(const Blocks<E>& blocks, const Near& at,
                                              const Collected<Dim, E>& nodes, double filter,
                                              double dt, Exchange<Dim>& on) {
  auto& affine = on.material.points.affine;
  with_transfer(on.transfer, [&](auto scheme) {
    using Scheme = decltype(scheme);
    if constexpr (Scheme::affine != Affine::none) {
      const MatOf<E> own = affine.template load_blocks<E>(blocks);
      affine.template store_blocks<E>(Scheme::carried(own, nodes, at.n, filter, dt), blocks);
    }
  });
}

template <int Dim, class S, class E>
void TransferKernelOf<Dim, S, E>::take_gradient(const Block& block, const VecOf<Wide>& of_grid,
                                                const MatOf<Wide>& gradient, GivingCells& rates,
                                                Exchange<Dim>& on) {
  Wide divergence = 0.0;
  for (int d = 0; d < Dim; ++d) divergence += gradient[d][d];
  if (Dim == 2 && on.material.axisymmetric()) {
    const Wide hoop = of_grid[0] / on.material.points.x.load(block)[0];
    block.store(hoop, on.material.hoop);
    divergence += hoop;
  }
  on.material.give_rate(block, divergence, rates);
}

template <int Dim, class S, class E>
template <bool Carries>
GRAINPAIR_FLATTEN GatherSums TransferKernelOf<Dim, S, E>::gather_as(const Strip& strip,
                                                                    GivingCells& rates,
                                                                    Gathered what,
                                                                    const Filter& filter, double dt,
                                                                    Exchange<Dim>& on) const {
  WideSums sums;
  for_each_blocks<E>(strip.begin, strip.end, [&](const Blocks<E>& blocks) {
    const auto at = neighbours(blocks, on);
    const Collected<Dim, E> all = collected<Carries>(at);
    const auto v = split<VecOf, E>(all.v);
    if (what != Gathered::gradient) {
      const auto dv = split<VecOf, E>(all.dv);
#pragma GCC unroll 2
      for (std::size_t h = 0; h < halves; ++h)
        take_velocity(blocks[h], v[h], dv[h], filter, on, sums);
      if constexpr (Carries) take_affine(blocks, at, all, filter.gradient, dt, on);
      on.material.grid_velocity.template store_blocks<E>(all.v, blocks);
    }
    if (what != Gathered::velocity) {
      const auto gradient = split<MatOf, E>(all.slope);
      on.material.velocity_gradient.template store_blocks<E>(all.slope, blocks);
#pragma GCC unroll 2
      for (std::size_t h = 0; h < halves; ++h)
        take_gradient(blocks[h], v[h], gradient[h], rates, on);
    }
  });
  return {reduce(sums.kinetic_before), reduce(sums.kinetic_after), hmax(sums.speed)};
}

template <int Dim, class S, class E>
void TransferKernelOf<Dim, S, E>::weigh(const Eigen::Matrix<double, Dim, 1>& x,
                                        const Grid<Dim>& grid, NodeWeights<Dim>& out) const {
  std::array<Weights<double, S::support>, Dim> n;
  std::ptrdiff_t first = 0;
  for (int d = 0; d < Dim; ++d) {
    S::evaluate(axes_[d], x[d], n[d]);
    first += static_cast<int>(n[d].first) * grid.stride[d];
  }
  out.count = 0;
  const auto give = [&](std::ptrdiff_t node, double w, auto... slope) {
    const auto i = static_cast<std::size_t>(out.count++);
    out.node[i] = static_cast<std::size_t>(node);
    out.w[i] = w;
    out.slope[i] = Eigen::Matrix<double, Dim, 1>(slope...);
  };
  for (int i = 0; i < S::support; ++i)
    for (int j = 0; j < S::support; ++j) {
      const std::ptrdiff_t row = first + i * grid.stride[0] + j * grid.stride[1];
      const double w = n[0].w[i] * n[1].w[j];
      const double dx = n[0].dw[i] * n[1].w[j], dy = n[0].w[i] * n[1].dw[j];
      if constexpr (Dim == 2) {
        give(row, w, dx, dy);
      } else {
        const auto& last = n[2];
        for (int k = 0; k < S::support; ++k)
          give(row + k, w * last.w[k], dx * last.w[k], dy * last.w[k], w * last.dw[k]);
      }
    }
}

template <int Dim, class Shape, class Exchanged>
std::unique_ptr<TransferKernel<Dim>> make_transfer_kernel(const std::array<int, Dim>& cells,
                                                          double h, double point_size) {
  return std::make_unique<TransferKernelOf<Dim, Shape, Exchanged>>(cells, h, point_size);
}

}  // namespace grainpair
