// What a library of somebody else may do, and what is made of it: a C++ exception is caught; a
// program that the law ends, by exit, STOP or a signal, says so before it goes.
#pragma once

#include <exception>
#include <string>

namespace grainpair {

/// While it lives, this thread is inside the library; `point` is the first it is called for.
class Inside {
 public:
  explicit Inside(double point);
  ~Inside();
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
};

/// From now on the end of the program inside a library is told, on standard error in one line: exit
/// code 3 for exit and STOP; a signal goes its own way.
void watch_over_libraries();

/// What the law returns; 1, and the reason, where it throws.
int guarded(std::string& why, const auto& call) {
  try {
    return call();
  } catch (const std::exception& error) {
    why = std::string("the law throws: ") + error.what();
  } catch (...) {
    why = "the law throws";
  }
  return 1;
}

}  // namespace grainpair
