// The shared library that holds a law, and the file of its constants.
#pragma once

#include <string>

#include "cases/check.hpp"

namespace grainpair {

/// Of the law external: its library as an absolute path, with the digest of its bytes, and its
/// constants, read from their file. Throws CaseError where one is missing or contradicts another.
void find_library(GivenValues& given, const std::string& path);

}  // namespace grainpair
