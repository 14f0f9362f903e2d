// A file that a program writes: under another name beside its own until it is complete, and by one
// program at a time.
#pragma once

#include <string>
#include <string_view>

namespace grainpair {

/// Owns `path`: a lock on a file beside it, which says who works there (cases/scratch.py has the
/// same lock). What a program that was killed has left of its draft is overwritten. Throws
/// CaseError where another process owns it, or nothing can be written there; RoomError where there
/// is no room.
class Draft {
 public:
  explicit Draft(std::string path);
  ~Draft();  // an unfinished draft is removed
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  /// Where to write.
  const std::string& name() const { return part_; }
  /// What it is to become.
  const std::string& path() const { return path_; }
  /// Writes a draft of text. Throws RoomError, CaseError.
  void write(std::string_view text);
  /// Gives the draft its name, once it is on the disk. Throws RoomError, CaseError.
  void finish();

 private:
  void own();
  std::string path_, part_, lock_;
  int handle_ = -1;
};

}  // namespace grainpair
