// Where the time of a step goes.
#pragma once

#include <ctime>

namespace grainpair {

/// Processor time of this process, all threads together [s]. Where processor time is limited
/// (RLIMIT_CPU) Linux tells it as of the last tick, some milliseconds ago, but for a thread whose
/// own clock has just been asked for.
inline double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Adds the processor time from here to the end of its scope to a sum, if there is one.
class Timed {
 public:
  explicit Timed(double* sum) : sum_(sum), start_(sum ? processor_seconds() : 0.0) {}
  Timed(const Timed&) = delete;
  ~Timed() {
    if (sum_) *sum_ += processor_seconds() - start_;
  }

 private:
  double* sum_;
  double start_;
};

}  // namespace grainpair
