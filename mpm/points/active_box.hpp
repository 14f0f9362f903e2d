// Where points can be until they are sorted again.
#pragma once

#include <array>
#include <cstddef>

#include "mpm/numbers/wide.hpp"

namespace grainpair {

/// The box of cells that points can reach until the next sorting.
template <int Dim>
struct ActiveBox {
  std::array<int, Dim> begin{}, end{};  // cells
  std::array<double, Dim> length{};     // of the grid [m]
  double inverse_h = 0.0;               // [1/m]

  template <class Vec>
  auto holds(const Vec& x) const {
    auto inside = x[0] >= 0.0 && x[0] < length[0];
    for (int d = 1; d < Dim; ++d) inside = inside && x[d] >= 0.0 && x[d] < length[d];
    return inside;
  }
  /// Number of the cell at x.
  template <class Vec>
  typename Vec::Scalar cell(const Vec& x) const {
    typename Vec::Scalar out = 0.0;
    for (int d = 0; d < Dim; ++d)
      out = out * static_cast<double>(end[d] - begin[d]) +
            (trunc(x[d] * inverse_h) - static_cast<double>(begin[d]));
    return out;
  }
  std::size_t cells() const { return cells_from(0); }
  /// Of a box that is as wide from axis d on, and one cell wide along those before.
  std::size_t cells_from(int d) const {
    std::size_t out = 1;
    for (; d < Dim; ++d) out *= static_cast<std::size_t>(end[d] - begin[d]);
    return out;
  }
};

}  // namespace grainpair
