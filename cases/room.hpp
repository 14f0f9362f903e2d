// Room on a disk: what cannot have it is refused beforehand, and where it runs out, that is one
// line. cases/room.py says the same.
#pragma once

#include <stdexcept>
#include <string>

namespace grainpair {

/// Room ran out, or would: one line. Programs print it and exit with code 3.
struct RoomError : std::runtime_error {
  /// Of the file `path`, in the system's words for `code` where it has failed (0: not yet), and
  /// with what it `needs` [bytes], which is told where that is more than is free.
  RoomError(const std::string& path, int code, double needs = 0.0);
};

/// Whether an error of the system, errno, is that there is no room.
bool is_full(int code);

/// Throws RoomError where less than it `needs` [bytes] is free for the file `path`.
void refuse_lack_of_room(const std::string& path, double needs);

}  // namespace grainpair
