// What this machine does at best with the arithmetic of a step: quadratic B-splines, affine transfer, a linear law, points
// in cell order, no walls, no energies, no re-sorting. The solver's speed is stated as a fraction of this.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "mpm/grid.hpp"

namespace grainpair {

template <int Dim>
class BareKernels {
 public:
  /// A block of `cells` cells a side, two points per cell and direction, of unit cells and unit mass.
  explicit BareKernels(int cells) : side_(cells + 4) {
    std::size_t nodes = 1;
    for (int d = Dim - 1; d >= 0; --d) {
      stride_[static_cast<std::size_t>(d)] = static_cast<int>(nodes);
      nodes *= static_cast<std::size_t>(side_);
    }
    nodes_.resize(nodes, Node{});
    const int depth = Dim == 3 ? cells : 1;
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j)
        for (int k = 0; k < depth; ++k)
          for (int s = 0; s < (1 << Dim); ++s) {
            const std::array<int, 3> cell{i, j, k};
            Lanes x{};
            for (int d = 0; d < Dim; ++d) x[d] = cell[static_cast<std::size_t>(d)] + 2.25 + 0.5 * ((s >> d) & 1);
            x_.push_back(x);
          }
    v_.resize(x_.size(), Lanes{});
    gradient_.resize(x_.size(), {});
    stress_.resize(x_.size(), {});
  }

  std::size_t size() const { return x_.size(); }

  void step(double dt) {
    for (Node& node : nodes_) node = Node{};
    for (std::size_t p = 0; p < x_.size(); ++p) to_grid(p);
    for (Node& node : nodes_) {
      if (node.motion[0] <= 0.0) continue;
      Lanes v = (node.motion + dt * node.change) / node.motion[0];
      v[2] -= dt;
      node.motion = v;
    }
    for (std::size_t p = 0; p < x_.size(); ++p) to_point(p, dt);
  }

 private:
  static constexpr int support = 3;
  using Slopes = std::array<Lanes, Dim>;

  struct Axis {
    std::array<double, support> w, dw, xi;
  };
  struct Place {
    std::array<Axis, Dim> axis;
    int first;
  };
  Place place(std::size_t p) const {
    Place out;
    out.first = 0;
    for (int d = 0; d < Dim; ++d) {
      const double x = x_[p][d];
      const int base = static_cast<int>(x - 0.5);
      const double f = x - base, g = 1.5 - f, h = f - 0.5;
      out.axis[d] = {{0.5 * g * g, 0.75 - (f - 1.0) * (f - 1.0), 0.5 * h * h}, {-g, -2.0 * (f - 1.0), h}, {-f, 1.0 - f, 2.0 - f}};
      out.first += base * stride_[static_cast<std::size_t>(d)];
    }
    return out;
  }
  /// f(node, weights along the axes before the last, index along them); the last axis is the inner loop of f.
  template <class F>
  static void for_each_row(const Place& at, Node* nodes, const std::array<int, Dim>& stride, F&& f) {
    for (int i = 0; i < support; ++i) {
      Node* const plane = nodes + at.first + i * stride[0];
      if constexpr (Dim == 2)
        f(plane, i, 0);
      else
        for (int j = 0; j < support; ++j) f(plane + j * stride[1], i, j);
    }
  }
  void to_grid(std::size_t p) {
    const Place at = place(p);
    Lanes base = v_[p];
    base[0] = 1.0;
    for_each_row(at, nodes_.data(), stride_, [&](Node* row, int i, int j) {
      const auto& a = at.axis;
      Lanes momentum = base + a[0].xi[i] * gradient_[p][0], force = a[0].dw[i] * stress_[p][0];
      double w = a[0].w[i];
      if constexpr (Dim == 3) {
        momentum += a[1].xi[j] * gradient_[p][1];
        force = a[1].w[j] * force + (w * a[1].dw[j]) * stress_[p][1];
        w *= a[1].w[j];
      }
      const Axis& last = a[Dim - 1];
      for (int k = 0; k < support; ++k) {
        row[k].motion += (w * last.w[k]) * (momentum + last.xi[k] * gradient_[p][Dim - 1]);
        row[k].change += last.w[k] * force + (w * last.dw[k]) * stress_[p][Dim - 1];
      }
    });
  }
  void to_point(std::size_t p, double dt) {
    const Place at = place(p);
    Lanes v{};
    Slopes slope{};
    for_each_row(at, nodes_.data(), stride_, [&](const Node* row, int i, int j) {
      const Axis& last = at.axis[Dim - 1];
      Lanes value{}, along{};
      for (int k = 0; k < support; ++k) value += last.w[k] * row[k].motion, along += last.dw[k] * row[k].motion;
      double w = at.axis[0].w[i], dw = at.axis[0].dw[i];
      if constexpr (Dim == 3) {
        slope[1] += (w * at.axis[1].dw[j]) * value;
        w *= at.axis[1].w[j], dw *= at.axis[1].w[j];
      }
      v += w * value, slope[0] += dw * value, slope[Dim - 1] += w * along;
    });
    v_[p] = v;
    for (int d = 0; d < Dim; ++d) {
      x_[p][d] += dt * v[d + 1];
      gradient_[p][static_cast<std::size_t>(d)] = slope[static_cast<std::size_t>(d)];
      gradient_[p][static_cast<std::size_t>(d)][0] = 0.0;
      stress_[p][static_cast<std::size_t>(d)] -= dt * gradient_[p][static_cast<std::size_t>(d)];  // linear law
    }
  }

  int side_;
  std::array<int, Dim> stride_;
  std::vector<Node> nodes_;
  std::vector<Lanes> x_, v_;
  std::vector<Slopes> gradient_, stress_;
};

}  // namespace grainpair
