// What fuzz targets share: files in memory, choices drawn from the fuzzer's bytes, and settings
// that make an execution cheap.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <new>
#include <string>
#include <string_view>

/// Where memory was had from is told by one caller alone: walking the stack at every allocation is
/// a third of a run. A small quarantine stays in the processor's cache.
extern "C" inline __attribute__((used)) const char* __asan_default_options() {
  return "malloc_context_size=1:quarantine_size_mb=4:allocator_may_return_null=0:"
         "handle_abort=1:detect_odr_violation=0";
}

namespace grainpair::fuzz {

/// A file in memory that lives as long as this, and is written again and again.
class MemoryFile {
 public:
  MemoryFile()
      : path_("/dev/shm/grainpair_fuzz_" + std::to_string(getpid())),
        file_(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    if (file_ < 0) std::abort();
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(file_), unlink(path_.c_str()); }

  const std::string& path() const { return path_; }
  void write(std::string_view bytes) const {
    if (ftruncate(file_, static_cast<off_t>(bytes.size())) != 0 ||
        pwrite(file_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
      std::abort();
  }

 private:
  std::string path_;  // a real one: HDF5 does not open what has no name
  int file_;
};

/// The fuzzer's bytes as choices; zeros where they are used up.
class Choices {
 public:
  Choices(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  std::uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  std::size_t below(std::size_t limit) { return (byte() + 256u * byte()) % limit; }
  bool flag() { return byte() % 2 == 1; }
  std::size_t left() const { return left_; }
  std::string_view rest() const { return {reinterpret_cast<const char*>(data_), left_}; }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

/// Ends the program where the thread has worked for more than a second since this began: other
/// programs beside it may delay it, and do not count.
class Hurry {
 public:
  Hurry() : begin_(now()) {}
  Hurry(const Hurry&) = delete;
  Hurry& operator=(const Hurry&) = delete;
  ~Hurry() {
    if (now() - begin_ <= 1.0) return;
    std::fputs("more than a second for one input\n", stderr);
    std::abort();
  }

 private:
  static double now() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  double begin_;
};

/// Calls `work`, which may refuse what it is given, by `Refused`, in one line; anything else ends
/// the program.
template <class Refused>
void refused_in_one_line(const auto& work) {
  const Hurry hurry;
  try {
    work();
  } catch (const std::bad_alloc&) {
    std::abort();  // a size was believed
  } catch (const Refused& error) {
    if (std::string_view(error.what()).find('\n') != std::string_view::npos) std::abort();
  }
}

}  // namespace grainpair::fuzz
