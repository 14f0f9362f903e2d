#include "cases/room.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>

namespace grainpair {
namespace {

/// Bytes that are free for a file; endless where nobody can tell, as in the kernel's own folders.
double free_for(const std::string& path) {
  std::error_code unknown;
  const auto folder = std::filesystem::absolute(path, unknown).parent_path();
  const auto space = std::filesystem::space(folder, unknown);
  if (unknown || space.capacity == 0) return std::numeric_limits<double>::infinity();
  return static_cast<double>(space.available);
}

std::string told(const std::string& path, int code, double needs) {
  const double there = free_for(path);
  std::string why = code ? std::strerror(code) : "";
  if (needs > there || !code)
    why += fmt::format("{}needs about {:.3g} MB", why.empty() ? "" : "; ", 1e-6 * needs);
  return fmt::format("{}: no room ({}, {:.3g} MB free) free some room, or write elsewhere", path,
                     why, 1e-6 * there);
}

}  // namespace

RoomError::RoomError(const std::string& path, int code, double needs)
    : std::runtime_error(told(path, code, needs)) {}

bool is_full(int code) { return code == ENOSPC || code == EDQUOT || code == EFBIG; }

void refuse_lack_of_room(const std::string& path, double needs) {
  if (free_for(path) < needs) throw RoomError(path, 0, needs);
}

}  // namespace grainpair
