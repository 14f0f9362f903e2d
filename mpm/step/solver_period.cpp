// What a grid that repeats along x asks for (period.hpp).
#include <algorithm>
#include <cmath>

#include "mpm/step/solver.hpp"

namespace grainpair {

/// Adds what points gave beside the period to its image, and shows it there: mass and momenta,
/// forces, or both. The same where ranks meet. Nothing where the grid neither repeats nor is
/// shared.
template <int D>
void Solver<D>::fold(Folded what) {
  if (ranks().many()) return fold_ranks(what);
  if (!setup_.period) return;
  const bool motion = what != Folded::changes, change = what != Folded::momenta;
  const int rows = (material_.box.end[1] - material_.box.begin[1]) * grid_.stride[1];
  const auto row_of = [&](int slice) {
    return &grid_.nodes[static_cast<std::size_t>(slice * grid_.stride[0] +
                                                 material_.box.begin[1] * grid_.stride[1])];
  };
  setup_.period.for_each_image(grid_.axes[0].nodes, [&](int slice, int image) {
    const Node<dim>* const from = row_of(slice);
    Node<dim>* const to = row_of(image);
    for (int k = 0; k < rows; ++k) {
      if (motion) to[k].mass += from[k].mass, to[k].motion += from[k].motion;
      if (change) to[k].change += from[k].change;
    }
  });
  setup_.period.for_each_image(grid_.axes[0].nodes, [&](int slice, int image) {
    const Node<dim>* const from = row_of(image);
    Node<dim>* const to = row_of(slice);
    for (int k = 0; k < rows; ++k) {
      if (motion) to[k].mass = from[k].mass, to[k].motion = from[k].motion;
      if (change) to[k].change = from[k].change;
    }
  });
}

/// The same of the sums of cells.
template <int D>
void Solver<D>::fold(GivingCells& cells) const {
  if (ranks().many()) return fold_ranks(cells);
  if (!setup_.period) return;
  const int slices = material_.box.end[0] - material_.box.begin[0];
  const auto images = [&](auto&& f) {
    setup_.period.for_each_image(slices, [&](int slice, int image) {
      f(static_cast<std::size_t>(slice), static_cast<std::size_t>(image));
    });
  };
  const auto all = static_cast<std::size_t>(slices);
  images([&](std::size_t slice, std::size_t image) { cells.add_slice(slice, image, all); });
  images([&](std::size_t slice, std::size_t image) { cells.copy_slice(image, slice, all); });
}

/// Puts points back into the period; what gravity has done along a whole one is kept.
template <int D>
void Solver<D>::put_back() {
  if (!setup_.period) return;
  const double h = setup_.numerics.h, length = setup_.period.cells * h;
  for (const std::size_t p : points_.occupied()) {
    const double periods = std::floor((points_.x[p][0] - origin()) / length);
    if (periods == 0.0) continue;
    auto x = points_.x[p];
    x[0] -= periods * length;
    x[0] = std::clamp(x[0], origin(), std::nextafter(origin() + length, 0.0));
    points_.x[p] = x;
    passed_ -= points_.mass[p] * setup_.gravity[0] * periods * length;
  }
}

/// Energy of the points in gravity along the slope, where they are on the grid [J].
template <int D>
double Solver<D>::energy_along() const {
  double sum = 0.0;
  for (const std::size_t p : points_.occupied())
    sum -= points_.mass[p] * setup_.gravity[0] * points_.x[p][0];
  return sum;
}

template void Solver<2>::fold(Folded);
template void Solver<3>::fold(Folded);
template void Solver<2>::fold(GivingCells&) const;
template void Solver<3>::fold(GivingCells&) const;
template void Solver<2>::put_back();
template void Solver<3>::put_back();
template double Solver<2>::energy_along() const;
template double Solver<3>::energy_along() const;

}  // namespace grainpair
