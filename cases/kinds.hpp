// Input files that stand alone: element tests, paths of a material point, studies. (A scene rests
// on others: cases/case.hpp.)
#pragma once

#include <string>

#include "cases/schema.hpp"
#include "cases/values.hpp"

namespace grainpair {

/// A checked file: its path, its text as its author wrote it, its values with the defaults.
struct Document {
  std::string path, text;
  Values values;
};

/// Reads a file (or the case.toml of a folder) of any kind but a scene. Throws CaseError.
Document read_document(const std::string& path, Kind kind);

}  // namespace grainpair
