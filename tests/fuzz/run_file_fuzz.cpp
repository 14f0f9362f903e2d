// Result files with something wrong in them: mapped, or refused in one line; likewise the settled
// packing that the continuum starts from, and the conditions of a steady shear.
#include <omp.h>

#include "cases/failure.hpp"
#include "compare/mapping/layout.hpp"
#include "mpm/points/packing.hpp"
#include "tests/fuzz/spoilt_file.hpp"

namespace {

using namespace grainpair;
using fuzz::Choices, fuzz::SpoiltFile;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t most_cells = 300;

const std::string cases[] = {
    "[geometry]\ndimension = \"plane_strain\"\nthickness = 0.006\n[walls]\nfront_back = "
    "\"periodic\"\n[grains]\ndiameter = 0.001\ndensity = 2500.0\n[compare]\nkernel = "
    "\"gauss\"\nwidth = 0.75\nspacing = 1.0\n",
    "[geometry]\ndimension = \"axisymmetric\"\nthickness = 0.006\n",
    "[geometry]\ndimension = \"plane_strain\"\nthickness = inf\n",
    "[geometry]\nthickness = 0.006\n[walls]\nfront_back = 3\n[grains]\ndiameter = 1e-300\ndensity "
    "= 1e300\n[compare]\nkernel = \"a\\nb\"\nwidth = 1e9\nspacing = 1e-9\n",
    std::string(2000, '['),
    "geometry = 1\n",
};

/// What a file holds, of the fuzzer's first bytes.
struct Contents {
  bool grains, has_case, repeats, kind, ids, spins, contacts, told;
  std::size_t points, frames, which_case;

  auto operator<=>(const Contents&) const = default;
  explicit Contents(Choices& choices) {
    // Some of all that there are, so that most files have been written before.
    const unsigned drawn = (choices.byte() % 64 + 1u) * 40503u;
    const unsigned what = drawn & 255, more = drawn >> 8;
    grains = what & 1, has_case = (what & 2) && !(what & 4), repeats = what & 8, kind = what & 16;
    ids = what & 32, spins = what & 64, contacts = what & 128, told = more & 1;
    points = 1 + (more >> 1) % 4, frames = 1 + (more >> 3) % 2;
    which_case = (more >> 4) % std::size(cases);
  }
};

void write_cloud(SpoiltFile& file, const std::string& cloud, const Contents& c) {
  const auto list = [&](double first, double step) {
    std::vector<double> out;
    for (std::size_t i = 0; i < c.points; ++i) out.push_back(first + step * static_cast<double>(i));
    return out;
  };
  for (const char* record : {"/position", "/velocity", "/angular_velocity"}) {
    if (record[1] == 'a' && !(c.grains && c.spins)) continue;
    file.group(cloud + record);
    for (const char* axis : {"/x", "/y", "/z"})
      file.dataset(cloud + record + axis, list(1.1e-3, 9e-4));
  }
  file.dataset(cloud + "/mass", list(1.3e-6, 0.0));
  file.dataset(cloud + "/solid_volume", list(5.2e-10, 0.0));
  if (c.grains) file.dataset(cloud + "/radius", list(5e-4, 0.0));
  if (c.ids) file.dataset(cloud + "/id", list(1.0, 1.0));
  if (c.kind) file.dataset(cloud + "/kind", list(1.0, 0.0));
  if (c.grains) return;
  file.dataset(cloud + "/void_ratio", list(0.7, 0.0));
  file.dataset(cloud + "/granular_temperature", list(1e-4, 0.0));
  file.group(cloud + "/stress");
  for (const char* part : {"/xx", "/yy", "/zz", "/xy", "/yz", "/zx"})
    file.dataset(cloud + "/stress" + part, list(100.0, 1.0));
}

/// Grains or material points.
void write_run(SpoiltFile& file, const Contents& c) {
  file.word("/", "engine", c.grains ? "dem" : "mpm");
  file.attribute("/", "schema_version", {1.0});
  if (c.has_case) file.word("/", "case_resolved", cases[c.which_case]);
  if (c.told) file.attribute("/", "diameter", {1.5e-3}), file.attribute("/", "density", {2500.0});
  if (c.repeats) file.attribute("/", "periodic", {1.0, 0.0, 0.0});
  if (c.told) file.attribute("/", "wall_low", {0.0, 0.0, nan});
  if (c.told) file.attribute("/", "wall_high", {nan, 0.05, nan});
  file.group("/data");
  for (std::size_t frame = 0; frame < c.frames; ++frame) {
    const std::string at = "/data/" + std::to_string(frame), cloud = at + "/particles/cloud";
    file.group(at), file.group(at + "/particles"), file.group(cloud);
    file.attribute(at, "time", {0.1 + static_cast<double>(frame)});
    if (c.repeats)
      file.attribute(at, "box_lower", {-1e-5, -1e-5, -1e-5}),
          file.attribute(at, "box_upper", {0.01, 0.01, 0.01});
    write_cloud(file, cloud, c);
    if (!c.grains || !c.contacts) continue;
    file.group(at + "/contacts");
    file.dataset(at + "/contacts/first", {1.0, 2.0});
    file.dataset(at + "/contacts/second", {2.0, -1.0});
    for (const char* record : {"/branch", "/position", "/force"}) {
      file.group(at + "/contacts" + record);
      for (const char* axis : {"/x", "/y", "/z"})
        file.dataset(at + "/contacts" + record + axis, {9e-4, 5e-4});
    }
  }
}

void write_packing(SpoiltFile& file) {
  file.word("/", "engine", "dem");
  file.group("/packing");
  file.dataset("/packing/profile_x", {-1e-9, 0.5, 1.0});
  file.dataset("/packing/profile_y", {-1e-9, 1.0});
  file.dataset("/packing/profile_mass", {0.7, 0.7});
  file.dataset("/packing/profile_void_ratio", {0.7, 0.7});
  for (const char* part : {"xx", "yy", "zz", "xy", "yz", "zx"})
    file.dataset(std::string("/packing/profile_stress_") + part, {100.0, 100.0});
}

template <int D>
void map_run(const std::string& path, unsigned how) {
  MapOptions options;
  if (how & 1) options.walls = "open";
  options.along = how & 2 ? "x" : how & 4 ? "z" : "y";
  std::vector<RunFile> runs;
  runs.emplace_back(path, how & 8 ? 2500.0 : nan);
  const Scene& scene = runs[0].scene();
  static constexpr const char* kernels[] = {"gauss", "lucy", "heaviside", "linear"};
  const std::string name = scene.has_case ? scene.kernel : kernels[how >> 4 & 3];
  const Kernel<D> kernel = make_kernel<D>(name, scene.width * scene.unit);
  const double reach = std::visit([](const auto& k) { return k.cutoff(); }, kernel);
  const Layout<D> layout(runs, options, scene.spacing * scene.unit, scene.width * scene.unit,
                         reach);
  for (std::size_t frame = 0; frame < runs[0].frames(); ++frame) {
    runs[0].time(frame);
    const auto grid = layout.grid(runs[0], frame);
    Cloud all = runs[0].cloud(frame);
    for (const Range& range : layout.cuts(runs[0], frame)) all = cut(all, range);
    layout.refuse_wide(runs[0], frame, all);
    if (grid.size() <= most_cells) coarse_grain(all, grid, kernel, scene.grain);
  }
}

/// The structure of a file: what it holds, what of it is spoilt.
struct Structure {
  bool packing;
  Contents contents;
  fuzz::SpoiltObjects spoilt;
  auto operator<=>(const Structure&) const = default;
};

fuzz::Image write(const Structure& structure) {
  SpoiltFile file(structure.spoilt);
  if (structure.packing)
    write_packing(file);
  else
    write_run(file, structure.contents);
  return file.image();
}

/// The file of a structure, written once.
const fuzz::Image& written(const Structure& structure) {
  constexpr std::size_t most = 10000;
  static std::map<Structure, fuzz::Image> kept;
  if (kept.size() > most) kept.clear();
  auto found = kept.find(structure);
  if (found == kept.end()) found = kept.emplace(structure, write(structure)).first;
  return found->second;
}

}  // namespace

/// What HDF5 itself loses over a broken link, some bytes, is not ours to find.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5\n"; }

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  // HDF5 keeps what it frees: to clear a fresh cache at every file was half of a run.
  H5set_free_list_limits(-1, -1, -1, -1, -1, -1);
  omp_set_num_threads(1);
  // A file that nothing is wrong with is read: else all that follows would show nothing.
  const fuzz::MemoryFile file;
  for (const bool packing : {false, true}) {
    Choices none(nullptr, 0);
    file.write(write({packing, Contents(none), {}}).bytes);
    if (packing)
      static_cast<void>(Packing(file.path()));
    else
      map_run<2>(file.path(), 0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  Choices choices(data, size);
  const unsigned how = choices.byte(), dimension = choices.byte();
  const bool packing = dimension % 16 == 15;
  const Contents contents(choices);
  fuzz::Image image = written({packing, contents, fuzz::spoilt_objects(choices)});
  fuzz::replace_numbers(image, choices);
  file.write(image.bytes);
  fuzz::refused_in_one_line<std::exception>([&] {
    if (packing) {
      const Packing read(file.path());
      read.extent(2500.0), read.stress(0.3, 0.2), read.mass(read.cell_of(0.9, 2.0));
    } else if (dimension % 4 == 0)
      map_run<1>(file.path(), how);
    else if (dimension % 8 == 1)
      map_run<3>(file.path(), how);
    else
      map_run<2>(file.path(), how);
  });
  if (H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL) != 0) std::abort();  // what we lose of HDF5's
  return 0;
}
