#include "mpm/output/output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <ctime>

#include "mpm/step/simulation.hpp"
#include "mpm/version.hpp"

namespace grainpair {

namespace {

// openPMD unitDimension: powers of length, mass, time, current, temperature, amount, luminosity
using Dimension = std::array<double, 7>;
constexpr Dimension none{}, length{1}, mass{0, 1}, volume{3}, speed{1, 0, -1},
    speed_squared{2, 0, -2}, stress{-1, 1, -2};

void describe_component(hid_t object, const std::string& unit) {
  hdf5::write_attribute(object, "unitSI", 1.0);
  hdf5::write_attribute(object, "unit", unit);
}

/// `doc` says what the numbers mean where name and unit do not.
void describe_record(hid_t object, const Dimension& dimension, const std::string& doc) {
  hdf5::write_attribute(object, "unitDimension", std::span<const double>(dimension));
  hdf5::write_attribute(object, "timeOffset", 0.0);
  if (!doc.empty()) hdf5::write_attribute(object, "doc", doc);
}

/// Columns of a frame. Points move between frames in memory, and from rank to rank; in the file a
/// point keeps its row. The first rank brings the rows together and writes them, so many at a time
/// that it needs little room for what others have.
class Records {
 public:
  /// `parent`: none where another rank writes what this one has.
  Records(std::optional<hid_t> parent, const Simulation& simulation, std::size_t at_once)
      : ranks_(simulation.ranks()), parent_(parent), at_once_(at_once) {
    simulation.visit_points([&](const auto& points) {
      for (const std::size_t p : points.occupied())
        own_.push_back({points.id[p], static_cast<std::uint32_t>(p)});
    });
    rows_ = own_.size();
    ranks_.sum(std::span(&rows_, 1));
    if (rows_ > at_once_) std::ranges::sort(own_, {}, &Row::number);
  }

  /// value(place of a point of this rank)
  template <class T, class F>
  void scalar(const std::string& name, const std::string& unit, const Dimension& dimension,
              F&& value, const std::string& doc = "") {
    component<T>(parent_, name, unit, value,
                 [&](hid_t dataset) { describe_record(dataset, dimension, doc); });
  }

  template <class F>
  void tensor(const std::string& name, const std::string& unit, const Dimension& dimension,
              const std::vector<std::string>& components, F&& value, const std::string& doc = "") {
    const auto group = group_of(name, dimension, doc);
    for (std::size_t c = 0; c < components.size(); ++c)
      component<double>(
          group ? std::optional<hid_t>(*group) : std::nullopt, components[c], unit,
          [&](std::size_t p) { return value(p, static_cast<int>(c)); }, [](hid_t) {});
  }

  /// A record that is zero everywhere: one number for each component.
  void zero(const std::string& name, const std::string& unit, const Dimension& dimension,
            const std::vector<std::string>& components) {
    const auto group = group_of(name, dimension, "");
    if (!group) return;
    const std::uint64_t shape[] = {rows_};
    for (const auto& each : components) {
      const auto component = hdf5::create_group(*group, each);
      hdf5::write_attribute(component, "value", 0.0);
      hdf5::write_attribute(component, "shape", std::span<const std::uint64_t>(shape));
      describe_component(component, unit);
    }
  }

 private:
  std::unique_ptr<hdf5::Handle> group_of(const std::string& name, const Dimension& dimension,
                                         const std::string& doc) {
    if (!parent_) return nullptr;
    auto out = std::make_unique<hdf5::Handle>(hdf5::create_group(*parent_, name));
    describe_record(*out, dimension, doc);
    return out;
  }
  template <class T, class F, class G>
  void component(std::optional<hid_t> parent, const std::string& name, const std::string& unit,
                 F&& value, G&& describe) {
    std::optional<hdf5::Handle> dataset;
    if (parent)
      dataset.emplace(hdf5::create_dataset(*parent, name, hdf5::type_of<T>(), rows_,
                                           std::min(rows_, at_once_)));
    auto next = own_.cbegin();
    for (std::size_t begin = 0; begin < rows_; begin += at_once_) {
      const std::size_t end = std::min(begin + at_once_, rows_);
      const auto first = next;
      next = std::find_if(first, own_.cend(), [&](const Row& row) { return row.number >= end; });
      const auto in_order = brought_together<T>(std::span(first, next), begin, end, value);
      if (dataset) hdf5::write_rows<T>(*dataset, begin, in_order);
    }
    if (!dataset) return;
    describe_component(*dataset, unit);
    describe(*dataset);
  }

  struct Row {
    std::uint32_t number, place;  // in the file; of the point in memory
  };

  /// On the first rank the values of rows begin ... end - 1, of which this one has `own`.
  template <class T, class F>
  std::vector<T> brought_together(std::span<const Row> own, std::size_t begin, std::size_t end,
                                  F&& value) const {
    std::vector<T> out(parent_ ? end - begin : 0);
    const auto of = [&](const Row& row) { return static_cast<T>(value(std::size_t{row.place})); };
    if (!ranks_.many()) {
      for (const Row& row : own) out[row.number - begin] = of(row);
      return out;
    }
    std::vector<std::uint32_t> numbers(own.size());
    std::vector<T> values(own.size());
    std::ranges::transform(own, numbers.begin(), &Row::number);
    std::ranges::transform(own, values.begin(), of);
    numbers = ranks_.gathered(std::move(numbers)), values = ranks_.gathered(std::move(values));
    for (std::size_t k = 0; k < numbers.size(); ++k) out[numbers[k] - begin] = values[k];
    return out;
  }

  const Ranks& ranks_;
  std::optional<hid_t> parent_;
  std::size_t at_once_;   // rows that are brought together
  std::vector<Row> own_;  // of this rank, in the order they are brought together in
  std::size_t rows_;      // of all ranks
};

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  const std::size_t written =
      std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S +0000", &utc);
  return {text.data(), written};
}

std::string told(const std::vector<std::string>& lines) {
  return lines.empty() ? "none" : fmt::format("{}", fmt::join(lines, "\n"));
}

std::string host() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// As they are, without packing them anew.
void copy_frames(const std::string& path, hid_t to) {
  const auto from = hdf5::open_file(path);
  const hdf5::Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, "make a property list");
  H5Pset_create_intermediate_group(links, 1);
  std::vector<std::string> names;
  const auto note = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->push_back(fmt::format("data/{}", name));
    return 0;
  };
  H5Literate_by_name(from, "data", H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, note, &names,
                     H5P_DEFAULT);
  for (const std::string& name : names)
    if (H5Ocopy(from, name.c_str(), to, name.c_str(), H5P_DEFAULT, links) < 0)
      throw hdf5::Error("HDF5: cannot copy " + name);
}

}  // namespace

Output::Output(Draft* draft, const Case& scene, const Provenance& provenance, std::size_t at_once)
    : draft_(draft), scene_(scene), provenance_(provenance), at_once_(at_once) {
  if (draft_) file();
}

hid_t Output::file() {
  if (file_) return *file_;
  file_ = std::make_unique<hdf5::Handle>(hdf5::create_file(draft_->name()));
  const auto write = [&](const char* name, const auto& value) {
    hdf5::write_attribute(*file_, name, value);
  };
  write("openPMD", std::string("1.1.0"));
  write("openPMDextension", std::uint32_t{0});
  write("basePath", std::string("/data/%T/"));
  write("particlesPath", std::string("particles/"));
  write("iterationEncoding", std::string("groupBased"));
  write("iterationFormat", std::string("/data/%T/"));
  write("software", std::string("grainpair"));
  write("softwareVersion", std::string(GRAINPAIR_COMMIT));
  write("date", today());
  write("machine", host());
  write("schema_version", 1);
  write("engine", std::string("mpm"));
  write("engine_version", std::string(GRAINPAIR_COMMIT));
  write("commit", std::string(GRAINPAIR_COMMIT));
  write("seed", static_cast<int>(provenance_.seed));
  write("case", scene_.text());
  write("case_resolved", scene_.resolved());
  write("contradictions", told(scene_.contradictions()));
  const Stiffness& stiffness = scene_.stiffness().continuum;
  write("stiffness_factor", stiffness.factor);
  write("weight_to_stiffness", stiffness.weight);
  write("softening_error", stiffness.error);
  write("command", provenance_.command);
  write("threads", provenance_.threads);
  write("time_scale", time_scale(scene_));
  return *file_;
}

void Output::frame(const Simulation& simulation, long step, double dt) {
  std::optional<hdf5::Handle> cloud;
  if (draft_) {
    const auto group = hdf5::create_group(file(), fmt::format("data/{}", step));
    hdf5::write_attribute(group, "time", simulation.time());
    hdf5::write_attribute(group, "dt", dt);
    hdf5::write_attribute(group, "timeUnitSI", 1.0);
    cloud.emplace(hdf5::create_group(group, "particles/cloud"));
  }
  const std::vector<std::string> xyz{"x", "y", "z"};
  simulation.visit_points([&](const auto& points) {
    const double solid_density = simulation.solid_density();
    Records records(cloud ? std::optional<hid_t>(*cloud) : std::nullopt, simulation, at_once_);
    const auto of = [](const auto& field) { return [&](std::size_t p) { return field[p]; }; };
    records.tensor("position", "m", length, xyz,
                   [&](std::size_t p, int c) { return simulation.position(p)[c]; });
    records.zero("positionOffset", "m", length, xyz);
    records.tensor("velocity", "m/s", speed, xyz,
                   [&](std::size_t p, int c) { return simulation.velocity(p)[c]; });
    records.tensor(
        "stress", "Pa", stress, {"xx", "yy", "zz", "xy", "yz", "zx"},
        [&](std::size_t p, int c) {
          // what the grid feels: the pressure averaged as the volumetric rate is
          return c < 3 ? points.sigma[p][c] + simulation.pressure_correction(p)
                       : points.sigma[p][c] / std::numbers::sqrt2;
        },
        "total, compression positive");
    records.template scalar<std::uint64_t>("id", "-", none, of(points.id));
    records.template scalar<double>("mass", "kg", mass, of(points.mass));
    records.template scalar<double>("solid_volume", "m3", volume,
                                    [&](std::size_t p) { return points.mass[p] / solid_density; });
    records.template scalar<double>("void_ratio", "-", none, of(points.void_ratio));
    records.template scalar<double>("granular_temperature", "m2/s2", speed_squared,
                                    of(points.granular_temperature));
    records.template scalar<std::uint8_t>(
        "regime", "-", none, of(points.regime),
        "1 visco-elastic, 2 visco-elasto-plastic, 3 critical, 4 collisional, 0 none");
    records.template scalar<double>("deviatoric_strain", "-", none, of(points.deviatoric_strain));
    records.template scalar<double>("plastic_dissipation", "J/kg", speed_squared,
                                    of(points.plastic));
    records.template scalar<double>("regime_4_dissipation", "J/kg", speed_squared,
                                    of(points.regime_4));
    records.template scalar<double>("contact_dissipation", "J/kg", speed_squared,
                                    of(points.contact));
    records.template scalar<double>("conducted", "J/kg", speed_squared, of(points.conducted));
  });
  if (!draft_) return;
  hdf5::flush(*file_);
  has_frames_ = true;
}

bool Output::close_frames() {
  if (!std::exchange(has_frames_, false)) return false;
  file_->finish();
  file_.reset();
  return true;
}

void Output::energies(const Simulation& simulation, const TimeStep& step) {
  rows_.push_back(
      {simulation.time(), step.dt, simulation.ledger(), static_cast<double>(step.limit)});
}

void Output::warnings(const std::vector<std::string>& lines) {
  if (draft_) hdf5::write_attribute(file(), "warnings", told(lines));
}

void Output::shares(double imbalance, double sent) {
  if (!draft_) return;
  hdf5::write_attribute(file(), "rank_imbalance", imbalance);
  hdf5::write_attribute(file(), "rank_sent_bytes", sent);
}

void Output::write_history() {
  const auto group = hdf5::create_group(*file_, "energy");
  const auto column = [&](const char* name, const char* unit, const char* doc, auto&& value) {
    std::vector<double> values;
    for (const Row& row : rows_) values.push_back(value(row));
    const auto dataset = hdf5::write_dataset<double>(group, name, values);
    hdf5::write_attribute(dataset, "unit", std::string(unit));
    hdf5::write_attribute(dataset, "doc", std::string(doc));
  };
  const auto account = [&](const char* name, const char* doc, double EnergyLedger::*field) {
    column(name, "J", doc, [field](const Row& row) { return row.ledger.*field; });
  };
  column("time", "s", "time since the release", [](const Row& row) { return row.time; });
  account("kinetic", "kinetic energy of the points [Ceccato2019, Eq. 18]", &EnergyLedger::kinetic);
  account("potential", "potential energy, zero at y = 0 [Ceccato2019, Eq. 17]",
          &EnergyLedger::potential);
  account("elastic", "elastic energy stored", &EnergyLedger::stored);
  account("fluctuation", "kinetic energy of velocity fluctuations [Ceccato2019, Eq. 11]",
          &EnergyLedger::fluctuation);
  account("dissipated_plastic", "dissipated by plastic flow [Ceccato2019, Eq. 9]",
          &EnergyLedger::plastic);
  account("dissipated_regime_4", "dissipated in regime 4, by the collisions of a law",
          &EnergyLedger::regime_4);
  account("dissipated_contact", "dissipated by enduring contacts of grains that flow",
          &EnergyLedger::contact);
  account("dissipated_wall", "work done on the walls", &EnergyLedger::wall);
  account("loss_transfer", "numerical: lost between points and grid", &EnergyLedger::transfer);
  account("loss_time_integration", "numerical: lost by the finite step",
          &EnergyLedger::time_integration);
  account("loss_mixing", "numerical: lost where void ratios mix within a cell",
          &EnergyLedger::mixing);
  account("loss_detached", "numerical: work of points on motion beyond the volume of their cell",
          &EnergyLedger::detached);
  account("loss_conduction", "numerical: made where conduction asks a point for more than it holds",
          &EnergyLedger::conduction);
  if (scene_.chute())
    column("driven", "J", "work of gravity along the slope since the release",
           [this](const Row& row) { return rows_.front().ledger.slope - row.ledger.slope; });
  account("conducted", "fluctuation that conduction has passed from point to point; part of no sum",
          &EnergyLedger::conducted);
  column("dissipated", "J", "all physical dissipation",
         [](const Row& row) { return row.ledger.dissipated(); });
  column("unaccounted", "J", "sum of the numerical losses",
         [](const Row& row) { return row.ledger.numerical(); });
  column("time_step", "s", "time step", [](const Row& row) { return row.time_step; });
  column("limit", "-", "what limits the step: 1 elastic, 2 critical state, 3 viscous",
         [](const Row& row) { return row.limit; });
}

void Output::finish(const std::string& end_reason, const Spent& spent, double wall_seconds,
                    long steps, const std::vector<std::string>& earlier) {
  if (!draft_) return;
  for (const std::string& path : earlier) copy_frames(path, file());
  hdf5::write_attribute(file(), "end_reason", end_reason);
  hdf5::write_attribute(*file_, "cpu_seconds", spent.whole);
  hdf5::write_attribute(*file_, "cpu_seconds_engine", spent.engine);
  hdf5::write_attribute(*file_, "cpu_seconds_output", spent.output);
  hdf5::write_attribute(*file_, "cpu_seconds_setup", spent.setup);
  hdf5::write_attribute(*file_, "wall_seconds", wall_seconds);
  hdf5::write_attribute(*file_, "steps", static_cast<std::int64_t>(steps));
  write_history();
  file_->finish();
  draft_->finish();
}

}  // namespace grainpair
