#include "mpm/external/shared_library.hpp"

#include <dlfcn.h>
#include <elf.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <link.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <vector>

namespace grainpair {
namespace {

using Header = ElfW(Ehdr);
using Segment = ElfW(Phdr);
using Entry = ElfW(Dyn);
using Symbol = ElfW(Sym);
using Relocation = ElfW(Rela);

/// The kind of programs that run here: that of this one.
Header own_header() {
  Header header{};
  std::ifstream("/proc/self/exe", std::ios::binary)
      .read(reinterpret_cast<char*>(&header), sizeof header);
  return header;
}

/// A fault, thrown by the checks and told by fault_of_library().
struct Fault {
  std::string what;
};

class Elf {
 public:
  explicit Elf(std::string_view bytes) : bytes_(bytes) {}

  void check() {
    check_header();
    check_segments();
    read_dynamic();
    check_tables();
    check_symbols();
    for (const auto& [table, size] : {std::pair{DT_RELA, DT_RELASZ}, {DT_JMPREL, DT_PLTRELSZ}})
      check_relocations(table, size);
  }

 private:
  /// A thing at a place of the file.
  template <class T>
  T at(std::uint64_t offset, const char* what) const {
    if (offset > bytes_.size() || bytes_.size() - offset < sizeof(T)) throw Fault{cut(what)};
    T thing;
    std::memcpy(&thing, bytes_.data() + offset, sizeof thing);
    return thing;
  }
  static std::string cut(const char* what) {
    return fmt::format("its {} lies beyond its end: cut short?", what);
  }
  static std::string broken(const char* what) { return fmt::format("its {} is broken", what); }

  void check_header() {
    static const Header own = own_header();
    if (!bytes_.starts_with(ELFMAG)) throw Fault{"no shared library: link it with -shared"};
    header_ = at<Header>(0, "header");
    if (header_.e_ident[EI_CLASS] != own.e_ident[EI_CLASS] ||
        header_.e_ident[EI_DATA] != own.e_ident[EI_DATA] || header_.e_machine != own.e_machine)
      throw Fault{"compiled for another machine"};
    if (header_.e_type != ET_DYN)
      throw Fault{"no shared library, but a program or an object file: link it with -shared"};
  }

  void check_segments() {
    if (header_.e_phentsize != sizeof(Segment) || header_.e_phnum == 0)
      throw Fault{broken("table of segments")};
    std::uint64_t end = 0;
    for (std::uint64_t i = 0; i < header_.e_phnum; ++i) {
      const auto one = at<Segment>(header_.e_phoff + i * sizeof(Segment), "table of segments");
      if (one.p_type == PT_DYNAMIC) dynamic_ = one;
      const bool in_file =
          one.p_offset <= bytes_.size() && one.p_filesz <= bytes_.size() - one.p_offset;
      if (one.p_type != PT_LOAD) continue;
      if (!in_file) throw Fault{cut("segment")};
      constexpr std::uint64_t page = 4096, most = std::uint64_t{1} << 40, most_segments = 64;
      if (loads_.size() == most_segments || one.p_filesz > one.p_memsz || one.p_vaddr < end ||
          one.p_vaddr > most || one.p_memsz > most || (one.p_vaddr - one.p_offset) % page != 0 ||
          (one.p_align > 1 && !std::has_single_bit(one.p_align)))
        throw Fault{broken("segment")};
      end = one.p_vaddr + one.p_memsz;
      loads_.push_back(one);
    }
    if (loads_.empty() || !dynamic_) throw Fault{"it has nothing to load: link it with -shared"};
  }

  /// Where in the file stands what will be at these addresses.
  std::optional<std::uint64_t> place(std::uint64_t address, std::uint64_t size) const {
    for (const Segment& one : loads_)
      if (address >= one.p_vaddr && address - one.p_vaddr <= one.p_filesz &&
          size <= one.p_filesz - (address - one.p_vaddr))
        return one.p_offset + (address - one.p_vaddr);
    return std::nullopt;
  }
  std::uint64_t place(std::uint64_t address, std::uint64_t size, const char* what) const {
    if (const auto found = place(address, size)) return *found;
    throw Fault{broken(what)};
  }

  void read_dynamic() {
    constexpr const char* what = "dynamic section";
    const std::uint64_t from = place(dynamic_->p_vaddr, dynamic_->p_filesz, what);
    bool ends = false;
    for (std::uint64_t i = 0; i < dynamic_->p_filesz / sizeof(Entry) && !ends; ++i) {
      const auto one = at<Entry>(from + i * sizeof(Entry), what);
      ends = one.d_tag == DT_NULL;
      if (one.d_tag == DT_NEEDED || one.d_tag == DT_SONAME || one.d_tag == DT_RUNPATH ||
          one.d_tag == DT_RPATH)
        names_.push_back(one.d_un.d_val);
      else
        entries_[one.d_tag] = one.d_un.d_val;
    }
    if (!ends) throw Fault{broken(what)};
  }
  std::uint64_t value(std::int64_t tag) const {
    const auto found = entries_.find(tag);
    return found == entries_.end() ? 0 : found->second;
  }

  void check_tables() {
    constexpr const char* what = "table of names";
    const std::uint64_t size = value(DT_STRSZ);
    const std::uint64_t names = place(value(DT_STRTAB), size, what);
    if (size == 0 || bytes_[names + size - 1] != '\0') throw Fault{broken(what)};
    if (std::ranges::any_of(names_, [&](std::uint64_t name) { return name >= size; }))
      throw Fault{broken(what)};
    if (value(DT_SYMENT) != sizeof(Symbol)) throw Fault{broken("table of symbols")};
    for (const auto& [tag, length, name] :
         {std::tuple{DT_INIT_ARRAY, DT_INIT_ARRAYSZ, "list of beginnings"},
          {DT_FINI_ARRAY, DT_FINI_ARRAYSZ, "list of ends"}})
      if (value(length) > 0) place(value(tag), value(length), name);
  }

  void check_symbol(std::uint64_t i) const {
    constexpr const char* what = "table of symbols";
    if (i > bytes_.size()) throw Fault{broken(what)};
    const auto one =
        at<Symbol>(place(value(DT_SYMTAB) + i * sizeof(Symbol), sizeof(Symbol), what), what);
    if (one.st_name >= value(DT_STRSZ)) throw Fault{broken(what)};
  }

  /// Those that the table by which they are found leads to.
  void check_symbols() const {
    constexpr const char* what = "table of symbols";
    const std::uint64_t table = value(DT_GNU_HASH);
    if (table == 0) return check_old_table();
    const auto head =
        at<std::array<std::uint32_t, 4>>(place(table, sizeof(std::uint32_t) * 4, what), what);
    const std::uint64_t buckets = head[0], first = head[1], filter = head[2];
    if (buckets == 0 || !std::has_single_bit(filter)) throw Fault{broken(what)};
    const std::uint64_t list = table + 16 + filter * sizeof(ElfW(Addr)),
                        chains = list + 4 * buckets;
    const std::uint64_t from = place(list, 4 * buckets, what);
    std::vector<bool> seen(bytes_.size() / 4);
    for (std::uint64_t b = 0; b < buckets; ++b) {
      std::uint64_t i = at<std::uint32_t>(from + 4 * b, what);
      if (i == 0) continue;
      if (i < first) throw Fault{broken(what)};
      for (std::uint32_t hash = 0; !(hash & 1); ++i) {
        hash = at<std::uint32_t>(place(chains + 4 * (i - first), 4, what), what);
        if (seen.at(i - first)) break;
        seen[i - first] = true;
        check_symbol(i);
      }
    }
  }
  void check_old_table() const {
    constexpr const char* what = "table of symbols";
    const auto head = at<std::array<std::uint32_t, 2>>(place(value(DT_HASH), 8, what), what);
    const std::uint64_t all = std::uint64_t{head[0]} + head[1];
    const std::uint64_t from = place(value(DT_HASH) + 8, 4 * all, what);
    if (head[0] == 0) throw Fault{broken(what)};
    for (std::uint64_t i = 0; i < all; ++i)
      if (at<std::uint32_t>(from + 4 * i, what) >= head[1] && head[1] > 0)
        throw Fault{broken(what)};
    for (std::uint64_t i = 0; i < head[1]; ++i) check_symbol(i);
  }

  void check_relocations(std::int64_t table, std::int64_t size) const {
    constexpr const char* what = "table of relocations";
    if (value(size) == 0) return;
    if (table == DT_RELA && value(DT_RELAENT) != sizeof(Relocation)) throw Fault{broken(what)};
    const std::uint64_t from = place(value(table), value(size), what);
    for (std::uint64_t i = 0; i < value(size) / sizeof(Relocation); ++i) {
      const auto one = at<Relocation>(from + i * sizeof(Relocation), what);
      const bool fits = std::ranges::any_of(loads_, [&](const Segment& load) {
        return one.r_offset >= load.p_vaddr && load.p_memsz >= sizeof(ElfW(Addr)) &&
               one.r_offset - load.p_vaddr <= load.p_memsz - sizeof(ElfW(Addr));
      });
      if (!fits) throw Fault{broken(what)};
      check_symbol(one.r_info >> (sizeof(ElfW(Addr)) == 8 ? 32 : 8));
    }
  }

  std::string_view bytes_;
  Header header_{};
  std::vector<Segment> loads_;
  std::optional<Segment> dynamic_;
  std::map<std::int64_t, std::uint64_t> entries_;
  std::vector<std::uint64_t> names_;
};

/// What the child does: nothing but to load. Its own words and those of the library go nowhere.
[[noreturn]] void load_and_leave(const std::string& path, unsigned seconds, int well) {
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM})
    std::signal(number, SIG_DFL);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  alarm(seconds);
  if (const int quiet = open("/dev/null", O_RDWR); quiet >= 0)
    for (int file = 0; file < 3; ++file) dup2(quiet, file);
  static_cast<void>(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL));
  _exit(well);
}

}  // namespace

std::string fault_of_library(std::string_view bytes) {
  try {
    Elf(bytes).check();
  } catch (const Fault& fault) {
    return fault.what;
  }
  return "";
}

std::string fault_of_loading(const std::string& path, unsigned seconds) {
  constexpr int well = 93;  // no library ends a program so
  const pid_t child = fork();
  if (child < 0) return "";  // the loader will say what else is wrong
  if (child == 0) load_and_leave(path, seconds, well);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return "";
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
    return fmt::format("loading it takes more than {} s", seconds);
  if (WIFSIGNALED(status))
    return fmt::format("loading it crashes: {}", sigdescr_np(WTERMSIG(status)));
  if (WEXITSTATUS(status) != well) return "loading it ends the program";
  return "";
}

}  // namespace grainpair
