// The path of a material point: what is done to it, leg by leg (cases/point_schema.toml).
#pragma once

#include <string>
#include <vector>

#include "cases/case.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

/// A stretch of a path, at a constant rate. Compression and engineering shear strain are positive.
struct Leg {
  enum class Kind { strain, isotropic, simple_shear, triaxial, biaxial, rest };
  Kind kind = Kind::rest;
  bool constant_stress = false;        // simple_shear: sigma_yy is held instead of the volume
  SymTensor rate = SymTensor::Zero();  // D as far as it is given [1/s]
  Vec3 spin = Vec3::Zero();            // [1/s]
  double duration = 0.0;               // of one cycle [s]
  int cycles = 0;                      // > 0: forth, twice back and forth again, this many times
  long steps = 0;                      // in all
};

struct PointPath {
  Case material;  // law, material and grains
  double void_ratio = 0.0;
  SymTensor stress = SymTensor::Zero();  // [Pa]
  double granular_temperature = 0.0;     // [m2/s2]
  std::vector<Leg> legs;
  long every = 1;  // rows are kept every so many steps
  std::string text;

  /// Reads a path file; `overrides` are case keys that win over the file's. Throws CaseError.
  static PointPath load(const std::string& path, const std::vector<std::string>& overrides = {});
};

}  // namespace grainpair
