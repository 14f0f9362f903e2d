// One material point driven along a path of strains and stresses: the law without a grid.
#pragma once

#include <string>
#include <vector>

#include "mpm/programs/path.hpp"

namespace grainpair {

/// Columns of equal length by name; units beside them.
struct PointHistory {
  struct Column {
    std::string name, unit, doc;
    std::vector<double> values;
  };
  std::vector<Column> columns;
  double update_seconds = 0.0;  // time spent in the law's updates
  long updates = 0, regime_switches = 0;

  const std::vector<double>& operator[](const std::string& name) const;
};

/// Follows the path. Throws SolverError where the law cannot be driven as the path asks.
PointHistory drive(const PointPath& path);

/// Writes HDF5, or CSV where the name ends in .csv; the file appears whole or not at all.
void write(const PointHistory& history, const PointPath& path, const std::string& file);

}  // namespace grainpair
