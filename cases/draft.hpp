// A file that a program writes: under another name beside its own until it is complete, and by one
// program at a time.
#pragma once

#include <string>

namespace grainpair {

/// Owns `path`: a lock on a file beside it, which says who works there (cases/scratch.py has the
/// same lock). What a program that was killed has left of its draft is overwritten. Throws
/// CaseError where another process owns it, or nothing can be written there.
class Draft {
 public:
  explicit Draft(std::string path);
  ~Draft();  // an unfinished draft is removed
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  /// Where to write.
  const std::string& name() const { return part_; }
  /// Gives the draft its name. Throws CaseError.
  void finish();

 private:
  void own();
  std::string path_, part_, lock_;
  int handle_ = -1;
};

}  // namespace grainpair
