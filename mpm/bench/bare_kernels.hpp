// What this machine does at best with the arithmetic of a step: quadratic B-splines in closed form,
// affine transfer, linear elasticity with Jaumann's rate and the Drucker-Prager cone, points in
// cell order and kept four by four as the kernels take them; no walls, no energies, no averages, no
// increments beside the velocities, no re-sorting. The solver's speed is stated as a fraction of
// this.
#pragma once

#include <array>
#include <vector>

#include "mpm/grid/grid.hpp"
#include "mpm/grid/interpolation_plane.hpp"
#include "mpm/grid/interpolation_space.hpp"

namespace grainpair {

template <int Dim>
class BareKernels {
 public:
  /// A block of `cells` cells a side, two points per cell and direction, of unit cells and unit
  /// mass.
  explicit BareKernels(int cells) : side_(cells + 4) {
    std::size_t nodes = 1;
    for (int d = Dim - 1; d >= 0; --d) {
      stride_[static_cast<std::size_t>(d)] = static_cast<int>(nodes);
      nodes *= static_cast<std::size_t>(side_);
    }
    nodes_.resize(nodes);
    const int depth = Dim == 3 ? cells : 1;
    std::size_t count = 0;
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j)
        for (int k = 0; k < depth; ++k)
          for (int s = 0; s < (1 << Dim); ++s, ++count) {
            const std::array<int, 3> cell{i, j, k};
            const std::size_t lane = count % Wide::size();
            if (lane == 0) points_.push_back({});
            for (int d = 0; d < Dim; ++d)
              points_.back().x[d][lane] =
                  cell[static_cast<std::size_t>(d)] + 2.25 + 0.5 * ((s >> d) & 1);
          }
  }

  std::size_t size() const { return points_.size() * Wide::size(); }

  void step(double dt) {
    for (auto& node : nodes_) {
      node.motion.setZero(), node.change.setZero();
      node.mass = 0.0;
    }
    for (const Points& p : points_) to_grid(p);
    for (auto& node : nodes_) {
      if (node.mass <= 0.0) continue;
      node.motion = (node.motion - dt * node.change) / node.mass;
      node.motion[1] -= dt;
    }
    for (Points& p : points_) to_point(p, dt);
  }

 private:
  static constexpr int support = 3;
  using Vec = WideArray<Dim>;
  using Mat = std::array<Vec, Dim>;
  template <class Real>
  using Velocity = VectorOf<Dim, Real>;

  using Stress = WideArray<Dim == 2 ? 4 : 6>;  // xx, yy, zz, xy, yz, zx; tension positive
  static constexpr double lambda = 1.0, mu = 1.0, slope = 0.5;

  struct Points {
    Vec x = Vec::Zero(), v = Vec::Zero();
    Mat gradient = zero();
    Stress stress = Stress::Zero();
  };
  struct Place {
    std::array<std::array<Wide, support>, Dim> w, dw, xi;
    Node<Dim>* first;  // of the four points' common cell
  };
  static Mat zero() {
    Mat out;
    out.fill(Vec::Zero());
    return out;
  }

  /// The number of sigma_ij.
  static constexpr int component(int i, int j) {
    return i == j ? i : i + j == 1 ? 3 : i + j == 3 ? 4 : 5;
  }
  static Vec row(const Stress& stress, int i) {
    Vec out;
    for (int j = 0; j < Dim; ++j) out[j] = stress[component(i, j)];
    return out;
  }
  /// The step's strain and rotation, then back to |dev sigma| = slope p.
  static Stress updated(const Stress& old, const Mat& gradient, double dt) {
    Wide volumetric = 0.0;
    for (int d = 0; d < Dim; ++d) volumetric += gradient[d][d];
    const auto spin = [&](int i, int j) { return 0.5 * (gradient[j][i] - gradient[i][j]); };
    Stress trial = old;
    for (int i = 0; i < 3; ++i) trial[i] += (lambda * dt) * volumetric;
    for (int i = 0; i < Dim; ++i)
      for (int j = i; j < Dim; ++j) {
        Wide rate = mu * (gradient[j][i] + gradient[i][j]);
        for (int k = 0; k < Dim; ++k) {
          if (k != i) rate += spin(i, k) * old[component(k, j)];
          if (k != j) rate += spin(j, k) * old[component(i, k)];
        }
        trial[component(i, j)] += dt * rate;
      }
    const Wide pressure = (trial[0] + trial[1] + trial[2]) * (-1.0 / 3.0);
    for (int i = 0; i < 3; ++i) trial[i] += pressure;
    Wide length2 = trial[0] * trial[0] + trial[1] * trial[1] + trial[2] * trial[2];
    for (int n = 3; n < (Dim == 2 ? 4 : 6); ++n) length2 += 2.0 * trial[n] * trial[n];
    const Wide limit = slope * larger(pressure, Wide(0.0));
    Stress out = select(length2 > limit * limit, limit / sqrt(length2), Wide(1.0)) * trial;
    for (int i = 0; i < 3; ++i) out[i] -= pressure;
    return out;
  }

  Place place(const Vec& x) {
    Place out;
    out.first = nodes_.data();
    for (int d = 0; d < Dim; ++d) {
      const Wide base = trunc(x[d] - 0.5), f = x[d] - base, g = 1.5 - f, h = f - 0.5;
      out.w[d] = {0.5 * g * g, 0.75 - (f - 1.0) * (f - 1.0), 0.5 * h * h};
      out.dw[d] = {-g, -2.0 * (f - 1.0), h};
      out.xi[d] = {-f, 1.0 - f, 2.0 - f};
      out.first += index_below(base[0]) * stride_[static_cast<std::size_t>(d)];
    }
    return out;
  }
  /// f(offset of a row of nodes, i, j): the last axis is the inner loop of f.
  template <class F>
  void for_each_row(F&& f) const {
    for (int i = 0; i < support; ++i) {
      if constexpr (Dim == 2)
        f(i * stride_[0], i, 0);
      else
        for (int j = 0; j < support; ++j) f(i * stride_[0] + j * stride_[1], i, j);
    }
  }
  GRAINPAIR_FLATTEN void to_grid(const Points& p) {
    const Place at = place(p.x);
    for_each_row([&](int offset, int i, int j) {
      Vec momentum = p.v + at.xi[0][i] * p.gradient[0], force = at.dw[0][i] * row(p.stress, 0);
      Wide w = at.w[0][i];
      if constexpr (Dim == 3) {
        momentum += at.xi[1][j] * p.gradient[1];
        force = at.w[1][j] * force + (w * at.dw[1][j]) * row(p.stress, 1);
        w *= at.w[1][j];
      }
      constexpr int last = Dim - 1;
      for (int k = 0; k < support; ++k) {
        const Wide mass = w * at.w[last][k];
        const Vec p_k = mass * (momentum + at.xi[last][k] * p.gradient[last]);
        const Vec f_k = at.w[last][k] * force + (w * at.dw[last][k]) * row(p.stress, last);
        Node<Dim>& node = at.first[offset + k];
        const auto numbers = [&](std::size_t) { return node.motion.data(); };
        if constexpr (Dim == 2) {
          add_sums<PlaneGiven, Wide>({p_k, f_k}, numbers);
          node.mass += reduce(mass);
        } else {
          add_sums<SpaceNode, Wide>({p_k, mass, f_k, 0.0}, numbers);
        }
      }
    });
  }
  GRAINPAIR_FLATTEN void to_point(Points& p, double dt) {
    const Place at = place(p.x);
    Vec v = Vec::Zero();
    Mat gradient = zero();
    for_each_row([&](int offset, int i, int j) {
      constexpr int last = Dim - 1;
      Vec value = Vec::Zero(), along = Vec::Zero();
      for (int k = 0; k < support; ++k) {
        const Vec node = broadcast<Velocity>(at.first[offset + k].motion.data());
        value += at.w[last][k] * node, along += at.dw[last][k] * node;
      }
      Wide w = at.w[0][i], dw = at.dw[0][i];
      if constexpr (Dim == 3) {
        gradient[1] += (w * at.dw[1][j]) * value;
        w *= at.w[1][j], dw *= at.w[1][j];
      }
      v += w * value, gradient[0] += dw * value, gradient[last] += w * along;
    });
    p.v = v;
    p.x += Wide(dt) * v;
    p.gradient = gradient;
    p.stress = updated(p.stress, gradient, dt);
  }

  int side_;
  std::array<int, Dim> stride_;
  std::vector<Node<Dim>> nodes_;
  std::vector<Points> points_;
};

}  // namespace grainpair
