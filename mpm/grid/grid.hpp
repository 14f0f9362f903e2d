// The background grid: its axes and its nodes. Knows its spacing, nothing about materials.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mpm/grid/interpolation.hpp"

namespace grainpair {

/// Things known by their numbers, of which a window alone is in memory.
template <class T>
class Window {
 public:
  /// Those numbered begin ... end - 1 from now on; what they hold is of no meaning.
  void show(std::size_t begin, std::size_t end) {
    held_.resize(end - begin);
    // where number 0 would be
    origin_ =
        reinterpret_cast<T*>(reinterpret_cast<std::uintptr_t>(held_.data()) - begin * sizeof(T));
  }
  T* data() { return origin_; }
  const T* data() const { return origin_; }
  T& operator[](std::size_t number) { return origin_[number]; }
  const T& operator[](std::size_t number) const { return origin_[number]; }
  /// How many are in memory, and which.
  std::size_t size() const { return held_.size(); }
  auto begin() { return held_.begin(); }
  auto end() { return held_.end(); }
  auto begin() const { return held_.begin(); }
  auto end() const { return held_.end(); }

 private:
  std::vector<T> held_;
  T* origin_ = nullptr;
};

template <int Dim>
struct Grid {
  std::array<GridAxis, Dim> axes;
  Window<Node<Dim>> nodes;  // last axis fastest
  std::array<int, Dim> stride;

  /// All nodes are in memory at first, or none of them.
  explicit Grid(const std::array<GridAxis, Dim>& along, bool all = true) : axes(along) {
    int count = 1;
    for (int d = Dim - 1; d >= 0; --d) {
      stride[d] = count;
      count *= axes[d].nodes;
    }
    if (all) nodes.show(0, static_cast<std::size_t>(count));
  }
};

}  // namespace grainpair
