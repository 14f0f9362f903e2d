// What a run goes on from after it was stopped. Beside a result PATH, and until that is complete,
// stands the folder PATH.unfinished: its frames up to the newest checkpoint, in closed files
// frames-1.h5, frames-2.h5 ..., and the two newest checkpoints, checkpoint-<step>. Of ranks that
// share a run each has a file of its own state; those of all others are checkpoint-<step>.<rank>,
// and a checkpoint that one of them lacks is none. Whatever is there under these names is whole.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cases/draft.hpp"
#include "mpm/numbers/archive.hpp"
#include "mpm/output/output.hpp"
#include "mpm/step/ranks.hpp"

namespace grainpair {

/// Passes all that a run goes on from.
using Passes = std::function<void(Archive&)>;

class Checkpoints {
 public:
  /// Of the result `path`, which the first rank's `draft` is to become, every
  /// output.checkpoint_interval seconds of the clock, never for 0. `begin` passes the first state
  /// of the run, which with the case, this program and the number of ranks decides all later ones:
  /// another run's checkpoints are removed.
  Checkpoints(const std::string& path, const Draft* draft, const Case& scene, const Passes& begin,
              const Ranks& ranks);

  // What follows all ranks call at once.

  /// Puts back the newest that can be read, and removes what is beyond it. Returns whether there is
  /// one; else the run stays as it is.
  bool restore(const Passes& all);
  /// Whether it is time for one, by the first rank's clock.
  bool due() const;
  /// Keeps frames and state as they are after `step` steps. Where there is no room that is said,
  /// and the run goes on without.
  void keep(Output& output, long step, const Passes& all);

  /// Of a run that is complete, or failed by itself: all ranks' files.
  void remove();

  /// Files of frames that are kept, in order.
  std::vector<std::string> frames() const;

 private:
  enum class Found { spoilt, of_another_run, ours };
  Found look_at(long step);
  std::vector<long> newest_first() const;
  std::filesystem::path file(long step) const;
  bool first() const { return ranks_.here() == 0; }

  const Ranks& ranks_;
  std::string draft_, result_;
  std::filesystem::path folder_, part_;
  std::string key_;
  double interval_;  // [s]
  std::uint64_t segments_ = 0;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace grainpair
