// What a run goes on from after it was stopped. Beside a result PATH, and until that is complete,
// stands the folder PATH.unfinished: its frames up to the newest checkpoint, in closed files
// frames-1.h5, frames-2.h5 ..., and the two newest checkpoints, checkpoint-<step>. Whatever is
// there under these names is whole.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cases/draft.hpp"
#include "mpm/numbers/archive.hpp"
#include "mpm/output/output.hpp"

namespace grainpair {

/// Passes all that a run goes on from.
using Passes = std::function<void(Archive&)>;

class Checkpoints {
 public:
  /// Of the result that `draft` is to become, every `interval` seconds of the clock, never for 0.
  /// `begin` passes the first state of the run, which with the case and with this program decides
  /// all later ones: another run's checkpoints are removed.
  Checkpoints(const Draft& draft, const Case& scene, const Passes& begin);

  /// Puts back the newest that can be read, and removes what is beyond it. Returns whether there is
  /// one; else the run stays as it is.
  bool restore(const Passes& all);
  /// Whether it is time for one.
  bool due() const;
  /// Keeps frames and state as they are after `step` steps. Where there is no room that is said,
  /// and the run goes on without.
  void keep(Output& output, long step, const Passes& all);

  /// Of a run that is complete, or failed by itself.
  void remove();

  /// Files of frames that are kept, in order.
  std::vector<std::string> frames() const;

 private:
  std::vector<std::filesystem::path> newest_first() const;

  std::string draft_, result_;
  std::filesystem::path folder_;
  std::string key_;
  double interval_;  // [s]
  std::uint64_t segments_ = 0;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace grainpair
