// mpm_steady: a law in steady simple shear at given pressures and shear rates.
#include <fmt/format.h>
#include <omp.h>

#include "cases/command_line.hpp"
#include "cases/failure.hpp"
#include "cases/hdf5.hpp"
#include "mpm/programs/law_alone.hpp"
#include "mpm/programs/steady.hpp"

int main(int argc, char** argv) {
  grainpair::CommandLine line("Shears material points at constant pressure until nothing changes.");
  std::string scene, given, out;
  std::vector<std::string> overrides;
  int threads = 1;
  line.option("case", scene, "case file, or the folder of its case.toml: law, material, grains")
      .required()
      .option("--conditions", given,
              "HDF5 file of datasets pressure [Pa], shear_rate [1/s] and, where it is imposed, "
              "granular_temperature [m2/s2]")
      .required()
      .option("-o,--out", out, "result: HDF5")
      .required()
      .repeated("--set", overrides,
                "key=value of the case, e.g. material.law=solid_fluid; may be repeated")
      .option("--threads", threads, "threads")
      .threads();
  if (const auto done = line.parse(argc, argv)) return *done;
  omp_set_num_threads(threads);
  try {
    overrides.insert(overrides.begin(), grainpair::law_alone.begin(), grainpair::law_alone.end());
    const auto material = grainpair::Case::load(scene, overrides);
    const auto conditions = grainpair::read_conditions(given);
    const auto answers = steady_shear(material, conditions);
    grainpair::hdf5::with_room(out, 0.0, [&] { write(answers, conditions, material, out); });
  } catch (const grainpair::CaseError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const grainpair::RoomError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: out of memory ask for fewer conditions\n", given);
    return 3;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", given, error.what());
    return 3;
  }
}
