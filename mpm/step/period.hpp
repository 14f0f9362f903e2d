// A grid that repeats along x: its cells are those of one period, with some of the neighbouring
// periods beside them. Points are put back into the period whenever they are sorted and drift out
// of it by less than a cell until then. What lies beside the period is added to its image within it
// once points have given, and copied from there before points take; so shape functions, strips and
// cells know nothing of it.
#pragma once

namespace grainpair {

struct Period {
  /// Cells of the neighbouring periods on either side: one that points drift into, and two more,
  /// beyond which the shape functions of highest degree are all alike.
  static constexpr int beside = 3;

  int cells = 0;  // of the period; 0: the grid does not repeat

  explicit operator bool() const { return cells > 0; }
  int all_cells() const { return cells + 2 * beside; }

  /// f(slice, its image within the period) over the slices beside the period, of `slices` of nodes
  /// or cells.
  template <class F>
  void for_each_image(int slices, F&& f) const {
    for (int i = 0; i < beside; ++i) f(i, i + cells);
    for (int i = beside + cells; i < slices; ++i) f(i, i - cells);
  }
};

}  // namespace grainpair
