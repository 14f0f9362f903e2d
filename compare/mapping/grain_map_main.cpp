// grain_map: runs of either engine -> fields of both on one grid, through one kernel of one width.
#include <fmt/format.h>
#include <omp.h>

#include <cstdio>
#include <filesystem>
#include <set>

#include "cases/command_line.hpp"
#include "cases/draft.hpp"
#include "compare/mapping/run_file.hpp"

namespace {

using namespace grainpair;
namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> runs;
  std::string output, kernel, walls = "mirror";
  double width = 0.0, spacing = 0.0;  // [d]; 0: the case's
  int dimension = 2, threads = 0;
  std::vector<double> range;        // x range of a profile [m]
  std::vector<std::size_t> frames;  // all when empty
  bool quiet = false;
};

constexpr double largest_grid =
    5e7;  // cells; a run that needs more has lost a point or mistaken a unit

/// A grid that holds every point of every run and frame with its kernel's reach, walls at x = 0 and
/// y = 0.
template <int D>
SampleGrid<D> cover(const std::vector<RunFile>& runs, const Options& o, double h, double reach) {
  const Scene& scene = runs.front().scene();
  Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();
  for (const auto& run : runs)
    for (std::size_t f = 0; f < run.frames(); ++f)
      for (const auto& x : run.positions(f)) {
        if (!x.allFinite())
          throw std::runtime_error(
              fmt::format("{}: position that is not a number in frame {}", run.file().path(), f));
        lower = lower.cwiseMin(x), upper = upper.cwiseMax(x);
      }
  const bool mirror = o.walls == "mirror";
  SampleGrid<D> g;
  double cells = 1.0;
  for (int a = 0; a < D; ++a) {
    const int direction = SampleGrid<D>::direction(a);
    if (direction == 2) {
      g.cells[a] = std::max(1, static_cast<int>(std::round(scene.thickness / h)));
      g.lower[a] = 0.0, g.spacing[a] = scene.thickness / g.cells[a];
      g.low_edge[a] = g.high_edge[a] = scene.periodic ? Edge::periodic : Edge::mirror;
    } else {
      // Whole cells on either side of the wall, so that a wall is always a face between cells.
      const double below = mirror ? 0.0 : std::ceil((reach - lower[direction]) / h);
      const double count = below + std::ceil((upper[direction] + reach) / h);
      if (!(cells * count < largest_grid))
        throw std::runtime_error(
            fmt::format("{}: the points span {:.3g} m in {}, {:.3g} cells (a point has escaped, or "
                        "the spacing is too fine)",
                        runs.front().file().path(), upper[direction] - lower[direction],
                        "xyz"[direction], cells * count));
      g.cells[a] = std::max(1, static_cast<int>(count));
      g.lower[a] = -below * h, g.spacing[a] = h;
      g.low_edge[a] = mirror ? Edge::mirror : Edge::open;
      g.high_edge[a] = Edge::open;
    }
    cells *= g.cells[a];
  }
  g.depth = D == 3 ? 1.0 : scene.thickness;
  if (D == 1) g.depth *= o.range[1] - o.range[0];
  return g;
}

template <int D>
void write_grid(H5File& out, const SampleGrid<D>& grid) {
  out.make_group("/grid");
  for (int a = 0; a < D; ++a) {
    std::vector<double> centres;
    centres.reserve(static_cast<std::size_t>(grid.cells[a]));
    for (int k = 0; k < grid.cells[a]; ++k) centres.push_back(grid.centre(a, k));
    const std::string name = std::string("/grid/") + "xyz"[SampleGrid<D>::direction(a)];
    out.write(name, centres, {centres.size()});
    out.set(name, "unit", "m");
  }
  out.set("/grid", "cell_volume", grid.cell_volume());
  out.set("/grid", "depth", grid.depth);
}

template <int D>
void map_run(const RunFile& run, const std::string& group, const SampleGrid<D>& grid,
             const Kernel<D>& kernel, const Options& o, H5File& out) {
  // The conserved fields keep their sixteen digits; the rest are stored in single precision.
  static const std::set<std::string> exact{"density", "momentum", "solid_fraction"};
  std::vector<std::size_t> frames = o.frames;
  if (frames.empty())
    for (std::size_t f = 0; f < run.frames(); ++f) frames.push_back(f);

  out.make_group(group);
  out.set(group, "engine", run.engine());
  out.set(group, "source", fs::path(run.file().path()).filename().string());
  std::vector<double> times;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i] >= run.frames())
      throw std::runtime_error(
          fmt::format("{}: no frame {} (it has {})", run.file().path(), frames[i], run.frames()));
    times.push_back(run.time(frames[i]));
    Cloud cloud = run.cloud(frames[i]);
    if (D == 1) cloud = cut(cloud, 0, o.range[0], o.range[1]);
    const Fields fields = coarse_grain(cloud, grid, kernel, run.scene().grain);
    for (const auto& field : fields.list) {
      const std::string name = group + "/" + field.name;
      if (i == 0) {
        std::vector<hsize_t> shape;
        for (int a = D - 1; a >= 0; --a) shape.push_back(static_cast<hsize_t>(grid.cells[a]));
        if (field.components >= 3) shape.push_back(3);
        if (field.components == 9) shape.push_back(3);
        out.make_series(name, frames.size(), shape, exact.contains(field.name));
        out.set(name, "unit", field.unit);
        out.set(name, "doc", field.doc);
      }
      out.write_frame(name, i, field.values);
    }
    if (!o.quiet && isatty(fileno(stderr)))
      fmt::print(stderr, "\rmapping {}: frame {}/{}", run.engine(), i + 1, frames.size());
  }
  if (!o.quiet && isatty(fileno(stderr))) fmt::print(stderr, "\n");
  out.write(group + "/time", times, {times.size()});
  out.set(group + "/time", "unit", "s");
}

template <int D>
void map_all(const std::vector<RunFile>& runs, const Options& o, H5File& out) {
  const Scene& scene = runs.front().scene();
  const double d = scene.grain.diameter;
  const double w = (o.width > 0.0 ? o.width : scene.width) * d,
               h = (o.spacing > 0.0 ? o.spacing : scene.spacing) * d;
  const std::string name = o.kernel.empty() ? scene.kernel : o.kernel;
  const Kernel<D> kernel = make_kernel<D>(name, w);
  const double reach = std::visit([](const auto& k) { return k.cutoff(); }, kernel);
  const auto grid = cover<D>(runs, o, h, reach);
  write_grid(out, grid);
  out.set("/", "schema_version", 1.0);
  out.set("/", "software", "grainpair");
  out.set("/", "kernel", name);
  out.set("/", "width", w);
  out.set("/", "spacing", h);
  out.set("/", "cutoff", reach);
  out.set("/", "walls", o.walls);
  for (const auto& run : runs)
    map_run(run, fmt::format("/{}", fs::path(run.file().path()).stem().string()), grid, kernel, o,
            out);
}

void map(const Options& o) {
  std::vector<RunFile> runs;
  std::set<std::string> names;
  for (const auto& path : o.runs) {
    runs.emplace_back(path);
    if (!names.insert(fs::path(path).stem().string()).second)
      throw std::runtime_error(path + ": two runs of one name (fields are kept by file name)");
  }
  Draft draft(o.output);
  {
    H5File out = H5File::create(draft.name());
    if (o.dimension == 1) map_all<1>(runs, o, out);
    if (o.dimension == 2) map_all<2>(runs, o, out);
    if (o.dimension == 3) map_all<3>(runs, o, out);
    out.close();
  }
  draft.finish();
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CommandLine line("Coarse-grains runs of either engine onto one grid: same kernel, same width.");
  line.option("runs", o.runs,
              "result files, mpm.h5 and dem.h5 alike; fields are kept under each file's name")
      .required()
      .option("-o,--output", o.output, "the fields")
      .required()
      .option("--width", o.width, "kernel width w in grain diameters (default: the case's)")
      .positive()
      .option("--kernel", o.kernel, "gauss, lucy, heaviside or linear (default: the case's)")
      .one_of({"gauss", "lucy", "heaviside", "linear"})
      .option("--spacing", o.spacing, "grid spacing in grain diameters (default: the case's)")
      .positive()
      .option("--dimension", o.dimension,
              "2: averaged over the thickness; 3; or 1: profiles over y")
      .within(1, 3)
      .option("--range", o.range, "x range that a profile averages over [m]")
      .count(2)
      .option("--walls", o.walls,
              "mirror: fold back what the kernel puts behind a wall; open: let it spread there")
      .one_of({"mirror", "open"})
      .option("--frame", o.frames, "frames to map, counted from 0 (default: all)")
      .option("--threads", o.threads, "threads (default: all cores)")
      .threads()
      .flag("--quiet", o.quiet, "no progress");
  if (const auto done = line.parse(argc, argv)) return *done;
  if (o.dimension == 1 && (o.range.size() != 2 || !(o.range[0] < o.range[1]))) {
    fmt::print(stderr, "grain_map: --dimension 1 needs --range X0 X1 with X0 < X1\n");
    return 2;
  }
  if (o.threads > 0) omp_set_num_threads(o.threads);
  try {
    map(o);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: out of memory raise the spacing\n", o.output);
    return 3;
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 2;
  }
  return 0;
}
