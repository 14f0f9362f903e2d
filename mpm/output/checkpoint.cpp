#include "mpm/output/checkpoint.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "cases/digest.hpp"
#include "cases/failure.hpp"

namespace grainpair {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kept_at_least = 2;  // checkpoints

/// A file of numbers: a line that says whose they are, then of each record its name, a zero, type,
/// count and numbers, and at the end the digest of all that.
constexpr std::size_t digest_size = 16;

std::size_t size_of(Archive::Type type) {
  switch (type) {
    case Archive::Type::f32:
    case Archive::Type::i32:
    case Archive::Type::u32:
      return 4;
    case Archive::Type::f64:
    case Archive::Type::i64:
    case Archive::Type::u64:
      break;
  }
  return 8;
}

std::string head(const std::string& key, std::uint64_t segments) {
  return fmt::format("grainpair checkpoint 1 {} {}\n", key, segments);
}

/// An error of the system as an exception, with its errno.
[[noreturn]] void fail(const fs::path& path) {
  const int why = errno;
  if (is_full(why)) throw RoomError(path.string(), why);
  throw fs::filesystem_error("", path, std::error_code(why, std::generic_category()));
}

/// The digest of what passes, without names.
class Digesting final : public Archive {
 public:
  Digest digest;

 private:
  std::size_t length(const std::string&, std::size_t now) override { return now; }
  void pass(const std::string&, Type type, void* values, std::size_t count) override {
    digest.add({static_cast<const char*>(values), size_of(type) * count});
  }
};

class Keeping final : public Archive {
 public:
  Keeping(const fs::path& path, const std::string& first)
      : path_(path), file_(std::fopen(path.c_str(), "wbe")) {
    if (!file_) fail(path_);
    write(first.data(), first.size());
  }
  /// Ends the file, on the disk.
  void finish() {
    const std::string text = digest_.text();
    write(text.data(), text.size());
    if (std::fflush(file_.get()) != 0 || fsync(fileno(file_.get())) != 0) fail(path_);
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::size_t length(const std::string&, std::size_t now) override { return now; }
  void pass(const std::string& name, Type type, void* values, std::size_t count) override {
    const std::uint64_t about[] = {static_cast<std::uint64_t>(type), count};
    write(name.c_str(), name.size() + 1);
    write(about, sizeof about);
    write(values, size_of(type) * count);
  }
  void write(const void* bytes, std::size_t size) {
    digest_.add({static_cast<const char*>(bytes), size});
    if (std::fwrite(bytes, 1, size, file_.get()) != size) fail(path_);
  }
  fs::path path_;
  std::unique_ptr<std::FILE, Close> file_;
  Digest digest_;
};

/// Reads a file whose digest is right: names, types and counts are checked all the same, so that a
/// program that keeps something else says so.
class Restoring final : public Archive {
 public:
  explicit Restoring(std::istream& in) : in_(in) {}

 private:
  std::size_t length(const std::string& name, std::size_t) override {
    const auto here = in_.tellg();
    const std::size_t count = begin(name).second;
    in_.seekg(here);
    return count;
  }
  void pass(const std::string& name, Type type, void* values, std::size_t count) override {
    if (begin(name) != std::pair(static_cast<std::uint64_t>(type), std::uint64_t{count}))
      throw std::runtime_error("a checkpoint holds other numbers: " + name);
    in_.read(static_cast<char*>(values), static_cast<std::streamsize>(size_of(type) * count));
  }
  std::pair<std::uint64_t, std::uint64_t> begin(const std::string& name) {
    std::string found;
    std::getline(in_, found, '\0');
    std::uint64_t about[2] = {};
    in_.read(reinterpret_cast<char*>(about), sizeof about);
    if (!in_ || found != name) throw std::runtime_error("a checkpoint lacks " + name);
    return {about[0], about[1]};
  }
  std::istream& in_;
};

/// Whether a file ends with the digest of what it holds before.
bool is_whole(const fs::path& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::streamoff>(in.tellg());
  if (!in || size < static_cast<std::streamoff>(digest_size)) return false;
  in.seekg(0);
  Digest digest;
  std::string some(1 << 16, '\0');
  for (auto left = size - static_cast<std::streamoff>(digest_size); left > 0;) {
    const auto now = std::min(left, static_cast<std::streamoff>(some.size()));
    if (!in.read(some.data(), now)) return false;
    digest.add({some.data(), static_cast<std::size_t>(now)});
    left -= now;
  }
  std::string told(digest_size, '\0');
  in.read(told.data(), digest_size);
  return in && told == digest.text();
}

/// What decides a rank's part of a run to the last bit: this program, the case but for how often it
/// is kept, which of the ranks it is, and the state it starts from, which holds packing and seed.
std::string key_of(const Case& scene, const Passes& begin, const Ranks& ranks) {
  Digesting state;
  Digest& digest = state.digest;
  std::ifstream program("/proc/self/exe", std::ios::binary);
  std::ostringstream bytes;
  bytes << program.rdbuf();
  digest.add(bytes.view());
  std::istringstream resolved(scene.resolved());
  for (std::string line; std::getline(resolved, line);)
    if (!line.starts_with("checkpoint_interval")) digest.add(line).add("\n");
  if (ranks.many()) digest.add(fmt::format("rank {} of {}\n", ranks.here(), ranks.count()));
  begin(state);
  return digest.text();
}

fs::path frames_file(const fs::path& folder, std::uint64_t number) {
  return folder / fmt::format("frames-{}.h5", number);
}

/// Brings a file onto the disk. Throws RoomError, filesystem_error.
void settle(const fs::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) fail(path);
  if (fsync(file) != 0) {
    close(file);
    fail(path);
  }
  close(file);
}

bool readable(const std::string& path) {
  try {
    hdf5::open_file(path);
    return true;
  } catch (const hdf5::Error&) {
    return false;
  }
}

/// Of a file of a checkpoint, that of whatever rank; -1 of any other.
long step_of(const fs::path& path) {
  long step = 0;
  int rank = 0;
  char more = 0;
  const std::string name = path.filename().string();
  if (std::sscanf(name.c_str(), "checkpoint-%ld%c", &step, &more) == 1) return step;
  return std::sscanf(name.c_str(), "checkpoint-%ld.%d%c", &step, &rank, &more) == 2 ? step : -1;
}

bool is_frames(const std::string& name) {
  return name.starts_with("frames-") && name.ends_with(".h5");
}

bool is_part(const std::string& name) { return name == "part" || name.starts_with("part."); }

}  // namespace

Checkpoints::Checkpoints(const std::string& path, const Draft* draft, const Case& scene,
                         const Passes& begin, const Ranks& ranks)
    : ranks_(ranks),
      draft_(draft ? draft->name() : ""),
      result_(path),
      folder_(result_ + ".unfinished"),
      part_(folder_ / (first() ? "part" : fmt::format("part.{}", ranks.here()))),
      key_(key_of(scene, begin, ranks)),
      interval_(scene.number("output.checkpoint_interval")) {}

/// This rank's part of a checkpoint.
fs::path Checkpoints::file(long step) const {
  const std::string name = fmt::format("checkpoint-{}", step);
  return folder_ / (first() ? name : fmt::format("{}.{}", name, ranks_.here()));
}

/// What is not ours stays, and the folder with it. The first rank sees those of all where they
/// share a folder; where they do not, each has its own.
void Checkpoints::remove() {
  std::error_code ignored;
  std::vector<fs::path> ours;
  for (const auto& entry : fs::directory_iterator(folder_, ignored)) {
    const fs::path& path = entry.path();
    const long step = step_of(path);
    const bool own = path == part_ || (step >= 0 && path == file(step));
    const std::string name = path.filename().string();
    if (own || (first() && (step >= 0 || is_frames(name) || is_part(name)))) ours.push_back(path);
  }
  for (const fs::path& path : ours) fs::remove(path, ignored);
  fs::remove(folder_, ignored);
}

bool Checkpoints::due() const {
  if (interval_ <= 0.0) return false;
  const auto since = std::chrono::steady_clock::now() - last_;
  return ranks_.all(static_cast<char>(since >= std::chrono::duration<double>(interval_)))[0];
}

/// Steps of which this rank has its part.
std::vector<long> Checkpoints::newest_first() const {
  std::vector<long> out;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder_, ignored))
    if (const long step = step_of(entry.path()); step >= 0 && entry.path() == file(step))
      out.push_back(step);
  std::sort(out.rbegin(), out.rend());
  return out;
}

/// Parts of older checkpoints go once all ranks have theirs of this one.
void Checkpoints::keep(Output& output, long step, const Passes& all) {
  const fs::path next = frames_file(folder_, segments_ + 1);
  std::error_code ignored;
  first() ? fs::create_directory(folder_) : fs::create_directory(folder_, ignored);
  if (output.close_frames()) {
    settle(draft_);
    fs::rename(draft_, next);
    ++segments_;
  }
  std::optional<std::string> why;
  try {
    {
      Keeping keeping(part_, head(key_, segments_));
      all(keeping);
      keeping.finish();
    }
    fs::rename(part_, file(step));
  } catch (const std::exception& error) {
    why = error.what();
  }
  const auto failed = ranks_.all(static_cast<char>(why.has_value()));
  const auto who = std::ranges::find(failed, 1) - failed.begin();
  if (who == ranks_.count()) {
    const auto kept = newest_first();
    for (std::size_t i = kept_at_least; i < kept.size(); ++i) fs::remove(file(kept[i]), ignored);
  } else {
    fs::remove(part_, ignored), fs::remove(file(step), ignored);
    if (who == ranks_.here())
      fmt::print(stderr, "{}: warning: cannot be kept half-way: the run goes on without ({})\n",
                 result_, *why);
    interval_ = 0.0;
  }
  last_ = std::chrono::steady_clock::now();
}

/// Whether this rank's part of a checkpoint is whole, with the frames before it.
auto Checkpoints::look_at(long step) -> Found {
  std::ifstream in(file(step), std::ios::binary);
  std::string line;
  std::getline(in, line);
  if (!in || !is_whole(file(step)) ||
      std::sscanf(line.c_str(), "%*s %*s %*s %*s %lu", &segments_) != 1)
    return Found::spoilt;
  if (line + "\n" != head(key_, segments_)) return Found::of_another_run;
  const auto frames = this->frames();
  return std::ranges::all_of(frames, readable) ? Found::ours : Found::spoilt;
}

/// The first rank's are tried, each of which all must have.
bool Checkpoints::restore(const Passes& all) {
  const auto mine = newest_first();
  const auto count = ranks_.all(mine.size())[0];
  for (std::size_t i = 0; i < count; ++i) {
    const long step = ranks_.all(i < mine.size() ? mine[i] : -1)[0];
    const auto found = ranks_.all(look_at(step));
    if (found[0] == Found::of_another_run) {
      if (first())
        fmt::print(stderr, "{}: begins anew: what was kept there is of another run\n", result_);
      break;
    }
    if (!std::ranges::all_of(found, [](Found one) { return one == Found::ours; })) continue;
    std::ifstream in(file(step), std::ios::binary);
    std::string line;
    std::getline(in, line);
    Restoring restoring(in);
    all(restoring);
    std::error_code ignored;
    for (const long other : mine)
      if (other > step) fs::remove(file(other), ignored);
    if (first())
      for (auto beyond = segments_ + 1; fs::remove(frames_file(folder_, beyond)); ++beyond)
        continue;
    return true;
  }
  segments_ = 0;
  remove();
  return false;
}

std::vector<std::string> Checkpoints::frames() const {
  std::vector<std::string> out;
  for (std::uint64_t number = 1; number <= segments_; ++number)
    out.push_back(frames_file(folder_, number).string());
  return out;
}

}  // namespace grainpair
