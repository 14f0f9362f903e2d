// mpm_point: one material point along a strain or stress path.
#include <fmt/format.h>

#include "cases/command_line.hpp"
#include "cases/hdf5.hpp"
#include "mpm/programs/point.hpp"

int main(int argc, char** argv) {
  grainpair::CommandLine line("Drives one material point along a path of strains and stresses.");
  std::string path, out;
  std::vector<std::string> overrides;
  line.option("path", path, "path file (TOML)")
      .required()
      .option("-o,--out", out, "result: HDF5, or CSV where it ends in .csv")
      .required()
      .repeated("--set", overrides,
                "key=value of the case, e.g. material.law=solid_fluid; may be repeated");
  if (const auto done = line.parse(argc, argv)) return *done;
  try {
    const auto points = grainpair::PointPath::load(path, overrides);
    const auto history = grainpair::drive(points);
    grainpair::hdf5::with_room(out, 0.0, [&] { grainpair::write(history, points, out); });
    fmt::print("{}: {} steps, {} changes of regime, {:.0f} ns per update\n", out, history.updates,
               history.regime_switches,
               1e9 * history.update_seconds / static_cast<double>(history.updates));
  } catch (const grainpair::CaseError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const grainpair::RoomError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: out of memory ask for fewer steps\n", path);
    return 3;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", path, error.what());
    return 3;
  }
}
