// grain_map: runs of either engine, or grains of another code -> fields of all on one grid, through
// one kernel of one width.
#include <fmt/format.h>
#include <malloc.h>
#include <omp.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <set>

#include "cases/command_line.hpp"
#include "cases/draft.hpp"
#include "cases/hdf5.hpp"
#include "compare/mapping/frame_sums.hpp"
#include "compare/mapping/layout.hpp"
#include "compare/mapping/parts.hpp"

namespace {

using namespace grainpair;
namespace fs = std::filesystem;

/// How far, and how long still: a line on a terminal, or lines for another program.
class Progress {
 public:
  Progress(std::string what, std::size_t steps, const MapOptions& o)
      : what_(std::move(what)),
        steps_(steps),
        lines_(o.progress),
        shown_(!o.progress && !o.quiet && isatty(fileno(stderr))) {}
  ~Progress() {
    if (shown_) fmt::print(stderr, "\n");
  }
  void step() {
    ++done_;
    if (lines_) {
      const double share = static_cast<double>(done_) / static_cast<double>(steps_);
      fmt::print("progress {:.4f} mapping {}\n", share, what_);
      std::fflush(stdout);
    }
    if (!shown_) return;
    using Seconds = std::chrono::duration<double>;
    const double spent = Seconds(std::chrono::steady_clock::now() - begin_).count();
    const auto share = static_cast<double>(done_) / static_cast<double>(steps_);
    fmt::print(stderr, "\rmapping {}: {:3.0f} %, {:.0f} s left  ", what_, 100.0 * share,
               spent / share - spent);
  }

 private:
  std::string what_;
  std::size_t steps_, done_ = 0;
  bool lines_, shown_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

template <int D>
void write_grid(H5File& out, const SampleGrid<D>& grid) {
  static const std::array<const char*, 4> words{"open", "mirror", "periodic", "axis"};
  out.make_group("/grid");
  for (int a = 0; a < D; ++a) {
    std::vector<double> centres;
    const auto i = static_cast<std::size_t>(a);
    centres.reserve(static_cast<std::size_t>(grid.cells[i]));
    for (int k = 0; k < grid.cells[i]; ++k) centres.push_back(grid.centre(a, k));
    const std::string name = std::string("/grid/") + "xyz"[grid.direction(a)];
    out.write(name, centres, {centres.size()});
    out.set(name, "unit", "m");
    out.set(name, "low_edge", words[static_cast<std::size_t>(grid.low_edge[i])]);
    out.set(name, "high_edge", words[static_cast<std::size_t>(grid.high_edge[i])]);
  }
  if (grid.of_rings()) {
    out.set("/grid", "angle", grid.angle);
    return;
  }
  out.set("/grid", "cell_volume", grid.cell_volume());
  out.set("/grid", "depth", grid.depth);
}

/// The fields of one run in the file, written part by part.
template <int D>
class Series {
 public:
  Series(H5File& out, std::string group, std::size_t frames, const SampleGrid<D>& first_part)
      : out_(out), group_(std::move(group)), frames_(frames), block_(first_part) {}

  void write(const Fields& fields, std::size_t frame, const SampleGrid<D>& part) {
    // The conserved fields keep their sixteen digits; the rest are stored in single precision.
    static const std::set<std::string> exact{"density", "momentum", "solid_fraction"};
    const auto& list = fields.list;
    std::vector<std::optional<PackedBlock>> packed(list.size());
#pragma omp parallel for schedule(dynamic)
    for (std::size_t i = 0; i < list.size(); ++i) {
      const auto& [name, unit, doc, components, values] = list[i];
      packed[i].emplace(values, extent(part, components), extent(block_, components),
                        exact.contains(name));
    }
    std::vector<hsize_t> shape, start;
    for (int a = D - 1; a >= 0; --a) {
      shape.push_back(static_cast<hsize_t>(part.cells[static_cast<std::size_t>(a)]));
      start.push_back(static_cast<hsize_t>(part.first(a)));
    }
    for (std::size_t i = 0; i < list.size(); ++i) {
      const auto& field = list[i];
      const std::string name = group_ + "/" + field.name;
      auto all = shape, from = start;
      for (int rank = field.components; rank >= 3; rank /= 3) all.push_back(3), from.push_back(0);
      if (made_.insert(name).second) {
        out_.make_series(name, frames_, all, extent(block_, field.components),
                         exact.contains(field.name));
        out_.set(name, "unit", field.unit);
        out_.set(name, "doc", field.doc);
      }
      out_.write_block(name, frame, from, *packed[i]);
    }
  }

 private:
  /// Cells of a part, and three for every rank of a tensor.
  static std::vector<hsize_t> extent(const SampleGrid<D>& part, int components) {
    std::vector<hsize_t> out;
    for (int a = D - 1; a >= 0; --a) out.push_back(static_cast<hsize_t>(part.count(a)));
    for (int rank = components; rank >= 3; rank /= 3) out.push_back(3);
    return out;
  }

  H5File& out_;
  std::string group_;
  std::size_t frames_;
  SampleGrid<D> block_;
  std::set<std::string> made_;
};

std::vector<std::size_t> frames_of(const RunFile& run, const MapOptions& o) {
  std::vector<std::size_t> frames = o.frames, within;
  if (frames.empty())
    for (std::size_t f = 0; f < run.frames(); ++f) frames.push_back(f);
  for (const std::size_t f : frames) {
    if (f >= run.frames())
      throw std::runtime_error(
          fmt::format("{}: no frame {} (it has {})", run.file().path(), f, run.frames()));
    if (o.span.empty() || (run.time(f) >= o.span[0] && run.time(f) <= o.span[1]))
      within.push_back(f);
  }
  if (within.empty())
    throw std::runtime_error(
        fmt::format("{}: no frame from {:g} to {:g} s", run.file().path(), o.span[0], o.span[1]));
  return within;
}

template <int D>
struct Mapping {
  const MapOptions& options;
  const Layout<D>& layout;
  const Kernel<D>& kernel;
  double reach;
  H5File& out;

  Cloud cloud(const RunFile& run, std::size_t frame) const {
    Cloud all = run.cloud(frame);
    for (const Range& range : layout.cuts(run, frame)) all = cut(all, range);
    layout.refuse_wide(run, frame, all);
    sort_by_cell(all, layout.grid(run, frame));
    return all;
  }

  void map_run(const RunFile& run, const std::string& group) const {
    const auto frames = frames_of(run, options);
    out.make_group(group);
    out.set(group, "engine", run.engine());
    out.set(group, "source", fs::path(run.file().path()).filename().string());
    out.set(group, "diameter", run.scene().grain.diameter);
    out.set(group, "grain_density", run.scene().grain.density);
    std::vector<double> times;
    for (const std::size_t f : frames) times.push_back(run.time(f));
    if (options.average) {
      average(run, group, frames);
      double sum = 0.0;
      for (const double t : times) sum += t;
      out.set(group, "averaged_frames", static_cast<double>(times.size()));
      out.set(group, "averaged_from", times.front());
      out.set(group, "averaged_to", times.back());
      times = {sum / static_cast<double>(times.size())};
    } else {
      each(run, group, frames);
    }
    out.write(group + "/time", times, {times.size()});
    out.set(group + "/time", "unit", "s");
    write_boxes(run, group, frames);
  }

  /// Where a domain that repeats lies, frame by frame.
  void write_boxes(const RunFile& run, const std::string& group,
                   const std::vector<std::size_t>& frames) const {
    const auto& periodic = run.scene().periodic;
    if (run.scene().has_case || std::none_of(periodic.begin(), periodic.end(), std::identity()))
      return;
    std::vector<double> lower, upper, volumes;
    for (const std::size_t f : frames) {
      const Box box = run.box(f);
      for (int a = 0; a < 3; ++a) lower.push_back(box.lower[a]), upper.push_back(box.upper[a]);
      volumes.push_back(layout.grid(run, f).cell_volume());
    }
    out.write(group + "/box_lower", lower, {frames.size(), 3});
    out.write(group + "/box_upper", upper, {frames.size(), 3});
    out.write(group + "/cell_volume", volumes, {frames.size()});
    for (const char* name : {"/box_lower", "/box_upper"}) out.set(group + name, "unit", "m");
    out.set(group + "/cell_volume", "unit", "m3");
  }

  void each(const RunFile& run, const std::string& group,
            const std::vector<std::size_t>& frames) const {
    std::optional<Series<D>> series;
    std::optional<Progress> progress;
    std::vector<SampleGrid<D>> pieces;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Cloud points = cloud(run, frames[i]);
      SampleGrid<D> grid = layout.grid(run, frames[i]);
      if (!series) {
        pieces = parts(grid, points, reach);
        series.emplace(out, group, frames.size(), pieces.front());
        progress.emplace(run.engine(), frames.size() * pieces.size(), options);
      }
      const auto fluctuation = fluctuations(points, grid, kernel);
      for (const auto& piece : pieces) {
        grid.part = piece.part;
        series->write(coarse_grain(points, grid, kernel, run.scene().grain, fluctuation), i, grid);
        progress->step();
      }
    }
  }

  void average(const RunFile& run, const std::string& group,
               const std::vector<std::size_t>& frames) const {
    const SampleGrid<D> grid = layout.grid(run, frames.front());
    std::vector<FrameSums<D>> sums;
    Progress progress(run.engine(), frames.size(), options);
    for (const std::size_t f : frames) {
      const Cloud points = cloud(run, f);
      const SampleGrid<D> now = layout.grid(run, f);
      if (std::abs(now.cell_volume() / grid.cell_volume() - 1.0) > 1e-9 ||
          ((now.lower - grid.lower).array().abs() > 1e-9 * grid.spacing.array()).any())
        throw std::runtime_error(
            fmt::format("{}: the domain of frame {} is another than that of frame {} (no steady "
                        "flow) leave --average out, or take fewer frames",
                        run.file().path(), f, frames.front()));
      if (sums.empty())
        for (const auto& part : parts(grid, points, reach)) sums.emplace_back(part);
      const auto fluctuation = fluctuations(points, grid, kernel);
      for (auto& sum : sums) average_frame(sum, points, kernel, fluctuation);
      progress.step();
    }
    Series<D> series(out, group, 1, sums.front().grid);
    for (const auto& sum : sums) series.write(average_fields(sum, run.scene().grain), 0, sum.grid);
  }
};

template <int D>
void map_all(const std::vector<RunFile>& runs, const MapOptions& o, H5File& out) {
  const Scene& scene = runs.front().scene();
  const double d = scene.unit;
  const double w = (o.width > 0.0 ? o.width : scene.width) * d,
               h = (o.spacing > 0.0 ? o.spacing : scene.spacing) * d;
  const std::string name = o.kernel.empty() ? scene.kernel : o.kernel;
  const Kernel<D> kernel = make_kernel<D>(name, w);
  const double reach = std::visit([](const auto& k) { return k.cutoff(); }, kernel);
  const Layout<D> layout(runs, o, h, w, reach);
  write_grid(out, layout.grid(runs.front(), o.frames.empty() ? 0 : o.frames.front()));
  out.set("/", "schema_version", 1.0);
  out.set("/", "software", "grainpair");
  out.set("/", "kernel", name);
  out.set("/", "width", w);
  out.set("/", "spacing", h);
  out.set("/", "cutoff", reach);
  out.set("/", "walls", o.walls);
  out.set("/", "notes", layout.notes().empty() ? "none" : layout.notes());
  const Mapping<D> mapping{o, layout, kernel, reach, out};
  for (const auto& run : runs)
    mapping.map_run(run, fmt::format("/{}", fs::path(run.file().path()).stem().string()));
}

void map(const MapOptions& o) {
  std::vector<RunFile> runs;
  std::set<std::string> names;
  for (const auto& path : o.runs) {
    runs.emplace_back(path, o.density);
    for (const std::size_t f : o.frames)
      if (f >= runs.back().frames())
        throw std::runtime_error(
            fmt::format("{}: no frame {} (it has {})", path, f, runs.back().frames()));
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

void declare(CommandLine& line, MapOptions& o) {
  line.option("runs", o.runs,
              "result files, mpm.h5, dem.h5 and grains.h5 alike; fields are kept under each file's "
              "name")
      .required()
      .option("-o,--output", o.output, "the fields")
      .required()
      .option("--width", o.width, "kernel width w in grain diameters (default: the case's, 0.75)")
      .positive()
      .option("--kernel", o.kernel, "gauss, lucy, heaviside or linear (default: the case's, gauss)")
      .one_of({"gauss", "lucy", "heaviside", "linear"})
      .option("--spacing", o.spacing, "grid spacing in grain diameters (default: the case's, 1)")
      .positive()
      .option("--dimension", o.dimension,
              "2: averaged over the thickness; 3; or 1: profiles along one axis")
      .within(1, 3)
      .option("--along", o.along, "axis of profiles: x, y or z (default: y)")
      .one_of({"x", "y", "z"})
      .option("--range,--range-x", o.ranges[0], "x range that is averaged over [m] (default: all)")
      .count(2)
      .option("--range-y", o.ranges[1], "y range that is averaged over [m] (default: all)")
      .count(2)
      .option("--range-z", o.ranges[2], "z range that is averaged over [m] (default: all)")
      .count(2)
      .option("--walls", o.walls,
              "mirror: fold back what the kernel puts behind a wall; open: let it spread there")
      .one_of({"mirror", "open"})
      .option("--frame", o.frames, "frames to map, counted from 0 (default: all)")
      .flag("--average", o.average, "one average over the frames, of a steady flow")
      .option("--span", o.span, "only frames from one time to another [s]")
      .count(2)
      .option("--density", o.density, "of grains whose mass the file does not tell [kg/m3]")
      .positive()
      .flag("--progress", o.progress, "progress lines on standard output")
      .option("--threads", o.threads, "threads (default: all cores)")
      .threads()
      .flag("--quiet", o.quiet, "no progress");
}

}  // namespace

int main(int argc, char** argv) {
  MapOptions o;
  CommandLine line("Coarse-grains runs and grains onto one grid: same kernel, same width.");
  declare(line, o);
  if (const auto done = line.parse(argc, argv)) return *done;
  for (std::size_t a = 0; a < 3; ++a)
    if (!o.ranges[a].empty() && !(o.ranges[a][0] < o.ranges[a][1])) {
      fmt::print(stderr, "grain_map: --range-{} X0 X1 needs X0 < X1\n", "xyz"[a]);
      return 2;
    }
  if (o.threads > 0) omp_set_num_threads(o.threads);
  // Tables of hundreds of megabytes come and go with every part: memory once had is kept.
  mallopt(M_MMAP_MAX, 0), mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  try {
    hdf5::with_room(o.output, 0.0, [&] { map(o); });
  } catch (const RoomError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 3;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: out of memory raise the spacing\n", o.output);
    return 3;
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 2;
  }
  return 0;
}
