// What stencils are made for: points, and branches of contacts.
#pragma once

#include <algorithm>
#include <span>

#include "compare/mapping/stencil.hpp"

namespace grainpair {

/// Places points for `make_stencils` and `scatter`.
template <int D, class K>
auto place_points(const SampleGrid<D>& grid, const K& kernel, auto position) {
  using Point = typename SampleGrid<D>::Point;
  using stencil_detail::across2, stencil_detail::Places;
  struct Item {
    Point home, low, high;
    const K& kernel;
    auto row(const Point& r) const {
      return [x0 = r[0] - home[0], rest2 = across2<D>(r, home),
              reach2 = kernel.cutoff() * kernel.cutoff()](double x, Places& out, std::size_t at) {
        const double r2 = rest2 + (x0 + x) * (x0 + x);
        out.distance2[at] = r2;
        return r2 < reach2;
      };
    }
    void values(Places& places, int n) const {
      stencil_detail::kernel_values(kernel, n, places.distance2.data());
    }
  };
  return [&grid, &kernel, position, c = kernel.cutoff()](std::size_t p) {
    const Point x = grid.project(position(p));
    return Item{x, (x.array() - c).matrix(), (x.array() + c).matrix(), kernel};
  };
}

/// Places the branches of contacts: psi(r) = integral over s in [0, 1] of phi(r - start + s
/// branch), exact.
template <int D, class K>
auto place_branches(const SampleGrid<D>& grid, const K& kernel, std::span<const Contact> contacts) {
  using Point = typename SampleGrid<D>::Point;
  using stencil_detail::across2, stencil_detail::Places;
  struct Item {
    Point home, low, high;  // home is the middle of the branch
    Point start, along;     // along: unit vector from start to the other end
    double length;
    const K& kernel;
    bool extended() const { return length > 1e-9 * kernel.cutoff(); }
    auto row(const Point& r) const {
      const Point from = start - r;
      return [this, x0 = from[0], rest2 = across2<D>(start, r), t0 = from.dot(along),
              reach2 = kernel.cutoff() * kernel.cutoff()](double x, Places& out, std::size_t at) {
        const double t = t0 - x * along[0], r2 = rest2 + (x0 - x) * (x0 - x);
        const double beside2 = extended() ? r2 - t * t : r2;
        const double beyond = extended() ? std::max(t, 0.0) + std::min(t + length, 0.0) : 0.0;
        out.distance2[at] = beside2, out.along[at] = t;
        return beside2 + beyond * beyond < reach2;
      };
    }
    void values(Places& places, int n) const {
      if (extended())
        stencil_detail::line_values(kernel, length, n, places.distance2.data(),
                                    places.along.data());
      else
        stencil_detail::kernel_values(kernel, n, places.distance2.data());
    }
  };
  return [&grid, &kernel, contacts, c = kernel.cutoff()](std::size_t i) {
    const Point a = grid.project(contacts[i].start), b = grid.project(contacts[i].branch),
                end = a - b;
    const double length = b.norm();
    Point along = Point::Zero();
    if (length > 0.0) along = -b / length;
    return Item{0.5 * (a + end),
                (a.cwiseMin(end).array() - c).matrix(),
                (a.cwiseMax(end).array() + c).matrix(),
                a,
                along,
                length,
                kernel};
  };
}

}  // namespace grainpair
