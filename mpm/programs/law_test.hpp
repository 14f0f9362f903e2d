// What a law does that no path of a laboratory shows: whether it may be trusted in a column.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cases/case.hpp"

namespace grainpair {

/// One thing asked of a law, and what came out.
struct LawFinding {
  std::string name, doc;  // what is asked
  std::string figure{};   // what came out, with its unit
  bool holds = false;
};

/// Puts every question to the law of the case; `begins` hears the name of each before it is put, so
/// that a library that ends the program is known by what it was asked.
std::vector<LawFinding> test_law(const Case& material,
                                 const std::function<void(const std::string&)>& begins);

}  // namespace grainpair
