// mpm.h5: frames of points and the energy history, in the layout that CONTRIBUTING.md describes.
// The schema of the continuum's result file is written here, once.
#pragma once

#include <memory>

#include "cases/case.hpp"
#include "cases/draft.hpp"
#include "cases/hdf5.hpp"
#include "mpm/step/simulation.hpp"

namespace grainpair {

/// How a run came about and what it took.
struct Provenance {
  std::string command;
  unsigned seed = 0;
  int threads = 1;
};

/// Processor time of a run, all threads together [s].
struct Spent {
  double whole = 0.0;
  double engine = 0.0;  // of it: the solver's own steps, with the watch over them: what is left
  double output = 0.0;  // frames and files
  double setup = 0.0;   // start of the program, reading, first state

  Spent& operator+=(const Spent& more) {
    whole += more.whole, engine += more.engine, output += more.output, setup += more.setup;
    return *this;
  }
};

class Output {
 public:
  /// Rows of a frame that are brought together, and compressed, at a time.
  static constexpr std::size_t rows_at_once = std::size_t{1} << 20;

  /// Nothing appears at the draft's path before finish(). Of ranks that share a run the first alone
  /// has a draft; the others send it what they have.
  Output(Draft* draft, const Case& scene, const Provenance& provenance,
         std::size_t at_once = rows_at_once);

  /// The draft can be read up to the last frame if the process is killed (h5clear -s first).
  void frame(const Simulation& simulation, long step, double dt);
  void energies(const Simulation& simulation, const TimeStep& step);
  /// Closes the draft, if it holds frames, and returns whether it did: it is a file of its own
  /// then, which may be moved, and further frames begin another.
  bool close_frames();
  /// What spoiled the result without ending the run; `warnings` of the file's root.
  void warnings(const std::vector<std::string>& lines);
  /// Of ranks: points of the fullest over the mean, and what it has sent to neighbours [bytes].
  void shares(double imbalance, double sent);
  /// `earlier`: files of frames that were closed before, which become part of the result.
  void finish(const std::string& end_reason, const Spent& spent, double wall_seconds, long steps,
              const std::vector<std::string>& earlier);

  /// The energy history so far.
  void archive(Archive& to) { to.structs<double>("energy", rows_); }

 private:
  struct Row {
    double time, time_step;
    EnergyLedger ledger;
    double limit;
  };
  hid_t file();  // begun where there is none
  void write_history();
  Draft* draft_;
  const Case& scene_;
  Provenance provenance_;
  std::size_t at_once_;
  std::unique_ptr<hdf5::Handle> file_;
  bool has_frames_ = false;
  std::vector<Row> rows_;
};

}  // namespace grainpair
