// Where the time of a step goes.
#pragma once

#include <ctime>

namespace grainpair {

/// Adds the processor time from here to the end of its scope to a sum, if there is one.
class Timed {
 public:
  explicit Timed(double* sum) : sum_(sum), start_(sum ? now() : 0.0) {}
  Timed(const Timed&) = delete;
  ~Timed() {
    if (sum_) *sum_ += now() - start_;
  }

 private:
  static double now() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  double* sum_;
  double start_;
};

}  // namespace grainpair
