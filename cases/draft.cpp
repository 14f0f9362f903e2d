#include "cases/draft.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "cases/failure.hpp"
#include "cases/room.hpp"

namespace grainpair {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& path, int error) {
  if (is_full(error)) throw RoomError(path, error);
  throw CaseError(fmt::format("{}: cannot be written ({}) choose another place for the result",
                              path, std::strerror(error)));
}

/// Who works here, in one line.
std::string self() {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  std::array<char, 32> now{};
  const std::time_t seconds = std::time(nullptr);
  std::tm local{};
  localtime_r(&seconds, &local);
  std::strftime(now.data(), now.size(), "%Y-%m-%d %H:%M:%S", &local);
  std::ifstream words("/proc/self/cmdline");
  std::string command, word;
  while (std::getline(words, word, '\0')) command += (command.empty() ? "" : " ") + word;
  std::replace_if(
      command.begin(), command.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; },
      ' ');
  return fmt::format("process {} (started {} on {}: {})", getpid(), now.data(), host.data(),
                     command);
}

bool same_file(int handle, const std::string& path) {
  struct stat ours {};
  struct stat there {};
  return fstat(handle, &ours) == 0 && stat(path.c_str(), &there) == 0 &&
         ours.st_ino == there.st_ino && ours.st_dev == there.st_dev;
}

}  // namespace

Draft::Draft(std::string path) : path_(std::move(path)) {
  const fs::path target(path_);
  std::error_code ignored;
  if (fs::is_directory(target, ignored)) refuse(path_, EISDIR);
  part_ = path_ + ".part";
  lock_ = (target.parent_path() / fmt::format(".{}.lock", target.filename().string())).string();
  own();
  fs::remove(part_, ignored);  // of a program that was killed
  const int probe = open(part_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (probe >= 0) {
    close(probe);
    return;
  }
  const int error = errno;
  fs::remove(lock_, ignored);
  close(handle_);
  refuse(path_, error);
}

/// A lock that its last owner removed while we waited for it is none: once more.
void Draft::own() {
  while (true) {
    handle_ = open(lock_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (handle_ < 0) refuse(path_, errno);
    if (flock(handle_, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      close(handle_);
      if (error != EWOULDBLOCK) refuse(path_, error);
      std::ifstream file(lock_);
      std::string who;
      std::getline(file, who);
      throw CaseError(fmt::format("{}: in use by {} wait for it, or choose another place", path_,
                                  who.empty() ? "another process" : who));
    }
    if (same_file(handle_, lock_)) break;
    close(handle_);
  }
  std::ofstream(lock_) << self() << '\n';
}

Draft::~Draft() {
  std::error_code ignored;
  fs::remove(part_, ignored);
  fs::remove(lock_, ignored);
  close(handle_);
}

void Draft::write(std::string_view text) {
  const int file = open(part_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  int error = file < 0 ? errno : 0;
  while (!error && !text.empty()) {
    const ssize_t count = ::write(file, text.data(), text.size());
    if (count < 0 && errno != EINTR) error = errno;
    if (count > 0) text.remove_prefix(static_cast<std::size_t>(count));
  }
  if (file >= 0 && close(file) != 0 && !error) error = errno;
  if (error) refuse(path_, error);
}

/// Some file systems tell only when asked that what was written did not fit.
void Draft::finish() {
  const int file = open(part_.c_str(), O_RDONLY | O_CLOEXEC);
  const bool kept = file >= 0 && fsync(file) == 0;
  const int why = kept ? 0 : errno;
  if (file >= 0) close(file);
  if (!kept) refuse(path_, why);
  std::error_code error;
  fs::rename(part_, path_, error);
  if (error) refuse(path_, error.value());
}

}  // namespace grainpair
