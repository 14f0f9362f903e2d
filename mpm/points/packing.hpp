// The settled packing of a grain run as the continuum's initial state: mass, void ratio and stress,
// on cells.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "mpm/numbers/tensor.hpp"

namespace grainpair {

class Packing {
 public:
  /// Reads /packing of a grain run's result. Throws CaseError if the file has none.
  explicit Packing(const std::string& path);

  const std::string& path() const { return path_; }
  /// Cells between the faces x and y; cell (a, b) is at a * ny + b.
  std::size_t cells() const { return mass_.size(); }
  std::size_t cell_of(double x, double y) const;
  double mass(std::size_t cell) const { return mass_[cell]; }  // [kg]
  /// Extents of the column that the grains filled [m], given their density [kg/m3]; W from volume
  /// over area of a cell.
  std::array<double, 3> extent(double grain_density) const;
  /// Stress at a place [Pa], bilinear between the centres of the cells, constant beyond them.
  SymTensor stress(double x, double y) const;

 private:
  std::string path_;
  std::vector<double> x_, y_;  // faces [m]
  std::vector<double> mass_, void_ratio_;
  std::vector<SymTensor> stress_;
};

}  // namespace grainpair
