// A body whose law is in a shared library: `external` in the registry of laws.
//
// The library is given the strain of the step and the stress turned with the material, and gives
// the stress after it. Around it stands what no such law knows: grains that part. A point whose
// elastic pressure would become tensile opens, and carries no stress until its volume is back.
//
// Energies: those the law tells; else the elastic energy is that of the stress under the moduli of
// unloading, and what of the stress's work is not stored counts as plastic.
#include <fmt/format.h>

#include <atomic>
#include <limits>
#include <mutex>
#include <numeric>

#include "cases/hints.hpp"
#include "mpm/external/called.hpp"
#include "mpm/external/guard.hpp"
#include "mpm/external/kept.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/solid_volume.hpp"
#include "mpm/points/by_batch.hpp"

namespace grainpair {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

class ExternalBody final : public Body {
 public:
  explicit ExternalBody(const Case& scene)
      : of_(scene),
        law_(make_external_law(scene)),
        volume_(scene),
        kept_(Kept::states + of_.initial_state.size()) {
    watch_over_libraries();
  }

  void resize(std::size_t points) override { kept_.resize(whole(points)); }

  void initialise(std::size_t first, std::span<const InitialState> initial, Batch& batch) override {
    for (std::size_t i = 0; i < initial.size(); ++i) {
      const InitialState& start = initial[i];
      const std::size_t p = first + i;
      const SymTensor own = start.sigma / cauchy(start.void_ratio);
      for (std::size_t c = 0; c < kept_.count(); ++c) kept_[c][p] = 0.0;
      for (std::size_t c = 0; c < 6; ++c) {
        const auto m = static_cast<Eigen::Index>(c);
        kept_[Kept::stress + c][p] = c < 3 ? own[m] : own[m] / std::numbers::sqrt2;
      }
      kept_[Kept::id][p] = static_cast<double>(p);
      for (std::size_t s = 0; s < of_.initial_state.size(); ++s)
        kept_[Kept::states + s][p] = of_.initial_state[s];
      if (reference_modulus_ == 0.0) probe(p, start);
      kept_[Kept::modulus][p] = reference_modulus_, kept_[Kept::bulk][p] = elastic_.bulk;
      const auto at = Scattered::one(p);
      const Wide energy =
          elastic_.energy(load_tensor([&](std::size_t c) { return kept(Kept::stress + c); }, at));
      kept_[Kept::stored][p] = counts_from_start_ ? 0.0 : energy[0] * volume(start.void_ratio);
      batch.sigma[i] = start.sigma;
      batch.energies.set(i, Energies{.stored = kept_[Kept::stored][p]});
      if (!batch.work.empty()) batch.work[i] = 0.0;
      batch.granular_temperature[i] = batch.collisional_pressure[i] = 0.0;
      batch.stability.set(i, Stability{reference_modulus_ * cauchy(start.void_ratio), 0.0});
      batch.regime[i] = 1;
    }
  }

  void update(std::size_t first, Batch& batch) override {
    const std::unique_lock<std::mutex> alone =
        of_.serial ? std::unique_lock(one_at_a_time_) : std::unique_lock<std::mutex>();
    for (std::size_t begin = 0, end; begin < batch.size; begin = end) {
      end = same_step(batch, begin);
      if (batch.in_plane)
        update_block<InPlane>(first, batch, begin, end);
      else
        update_block<InSpace>(first, batch, begin, end);
    }
    if (!in_step_) check();
  }

  void advance(MaterialPoints<2>& points, const CellsOfStep& cells, const Strip& strip,
               PointSums& sums) override {
    if (points.axisymmetric()) return advance_as<true>(points, cells, strip, sums);
    advance_as<false>(points, cells, strip, sums);
  }
  void advance(MaterialPoints<3>& points, const CellsOfStep& cells, const Strip& strip,
               PointSums& sums) override {
    advance_as<false>(points, cells, strip, sums);
  }

  void check() override {
    if (!failed_.exchange(false)) return;
    throw SolverError(Failure::library, "{}", failure_);
  }

  void reorder(std::span<const std::uint32_t> order) override { kept_.reorder(order); }
  void archive(Archive& to) override { kept_.archive(to); }
  bool fluctuates() const override { return false; }
  bool tells_energies() const override { return tells_; }
  double conductivity(std::size_t, double) const override { return 0.0; }
  double heat(std::size_t, double) override { return 0.0; }
  SymTensor quasi_static_stress(std::size_t, const SymTensor& sigma, double) const override {
    return sigma;
  }

 private:
  struct Zeros {
    static constexpr Range energies{2, 5}, stability{1, 2};
  };

  /// End of a block that begins here: a library is told one time step for all of it.
  std::size_t same_step(const Batch& batch, std::size_t begin) const {
    const std::size_t most = std::min<std::size_t>(begin + GRAINPAIR_BLOCK, batch.size);
    if (in_step_) return most;
    std::size_t end = begin + 1;
    const double dt = Deformation(batch.steps[begin]).dt;
    while (end < most && Deformation(batch.steps[end]).dt == dt) ++end;
    return end;
  }

  /// What the body knows of a block beside what the law is told.
  struct Beside {
    Numbers closing;  // where it is not positive, the volumetric strain since a point opened [-]
    Numbers begun;    // work of the stress before on the strain of the step [J/m3]
  };

  template <bool Axisymmetric, int Dim>
  void advance_as(MaterialPoints<Dim>& points, const CellsOfStep& cells, const Strip& strip,
                  PointSums& sums) {
    in_step_ = true;
    advance_by_batch<Zeros, Accounts{false, false}, Axisymmetric>(
        points, cells, strip, sums, [&](std::size_t first, Batch& batch) { update(first, batch); });
  }

  /// sigma/tau of the stress that the law has.
  template <class Real>
  Real cauchy(const Real& e) const {
    return of_.kirchhoff ? volume_.cauchy(e) : Real(1.0);
  }
  /// Volume that the law's energies belong to [m3/kg].
  template <class Real>
  Real volume(const Real& e) const {
    return of_.kirchhoff ? Real(volume_.per_mass) : (1.0 + e) * (1.0 / volume_.grain_density);
  }
  double* kept(std::size_t column) { return kept_[column].data(); }

  template <class Where>
  void update_block(std::size_t first, Batch& batch, std::size_t begin, std::size_t end) {
    thread_local Called called(0);
    if (called.states.size() != of_.initial_state.size()) called = Called(of_.initial_state.size());
    thread_local Beside beside;
    const std::size_t size = end - begin;
    const double dt = Deformation(batch.steps[begin]).dt;
    std::size_t count = size, swaps = 0;
    std::array<std::array<std::size_t, 2>, GRAINPAIR_BLOCK> swapped;
    if (!take_all<Where>(first, batch, begin, end, called, beside))
      for (std::size_t k = 0; k < count;
           ++k) {  // the closed first: for them alone the law is called
        if (beside.closing[k] > 0.0) continue;
        while (--count > k && beside.closing[count] <= 0.0) continue;
        if (count > k) called.swap(k, count), swapped[swaps++] = {k, count};
      }
    if (count > 0 && !call(called, static_cast<int>(count), dt)) return;
    while (swaps > 0) --swaps, called.swap(swapped[swaps][0], swapped[swaps][1]);
    for (std::size_t k = size; k % Wide::size() != 0; ++k)  // the last fills its register
      called.repeat(size - 1, k);
    give_all<Where>(first, batch, begin, end, dt, called, beside);
  }

  /// Whether all of them are closed.
  template <class Where>
  [[gnu::noinline]] GRAINPAIR_FLATTEN bool take_all(std::size_t first, const Batch& batch,
                                                    std::size_t begin, std::size_t end,
                                                    Called& called, Beside& beside) {
    Wide open = 0.0;
    by_fours(begin, end, [&](const auto& at, const Block& row) {
      open += take<Where>(first, batch, at, row, called, beside);
    });
    return reduce(open) == 0.0;
  }
  template <class Where>
  [[gnu::noinline]] GRAINPAIR_FLATTEN void give_all(std::size_t first, Batch& batch,
                                                    std::size_t begin, std::size_t end, double dt,
                                                    const Called& called, const Beside& beside) {
    by_fours(begin, end, [&](const auto& at, const Block& row) {
      give<Where>(first, batch, at, row, dt, called, beside);
    });
  }

  /// Four points, or what is left of them, into a row of the block. 1 for each that is open.
  template <class Where, class At>
  Wide take(std::size_t first, const Batch& batch, const At& at, const Block& row, Called& out,
            Beside& beside) {
    const auto p = at.beyond(first);
    const auto step = batch.steps.load(at, Where::step);
    const auto turned = [&](std::size_t column) {
      return corotated<Wide>(load_tensor([&](std::size_t c) { return kept(column + c); }, p),
                             step.spin, step.dt);
    };
    WideTensor strain = strain_increment(step), sigma = turned(Kept::stress);
    const Wide volumetric = trace(strain), opening = p.load(kept(Kept::opening));
    Wide closing = 1.0, open = 0.0;
    if (of_.separates) {
      const Wide bulk = p.load(kept(Kept::bulk));
      const auto was_open = opening < 0.0;
      closing = select(was_open, opening, trace(sigma) * (1.0 / 3) / bulk) + volumetric;
      open = select(closing <= 0.0, Wide(1.0), Wide(0.0));
      if (const auto closes = was_open && closing > 0.0; any(closes)) {
        strain = select(closes, plus_isotropic(strain, (closing - volumetric) * (1.0 / 3)), strain);
        sigma = select(closes, WideTensor::Zero(), sigma);
      }
    }
    row.store(closing, beside.closing.data());
    row.store(sigma.dot(strain), beside.begun.data());
    const auto into = [](std::array<Numbers, 6>& six) {
      return [&](std::size_t c) { return six[c].data(); };
    };
    store_tensor(sigma, into(out.stress), row), store_tensor(strain, into(out.strain), row);
    if (of_.umat) store_tensor(turned(Kept::total), into(out.total), row);
    for (int a = 0; a < 3; ++a)
      row.store(step.spin[a], out.spin[static_cast<std::size_t>(a)].data());
    row.store(step.void_ratio_old, out.e_old.data()), row.store(step.void_ratio, out.e.data());
    for (Numbers* none : {&out.modulus, &out.bulk, &out.stored, &out.dissipated})
      row.store(Wide(nan), none->data());
    row.store(p.load(kept(Kept::id)), out.id.data());
    row.store(p.load(kept(Kept::clock)), out.clock.data());
    row.store(p.load(kept(Kept::steps)), out.steps.data());
    for (std::size_t c = 0; c < 2; ++c)
      row.store(p.load(kept(Kept::counted + c)), out.counted[c].data());
    for (std::size_t s = 0; s < out.states.size(); ++s)
      row.store(
          s + 1 == of_.void_ratio_state ? step.void_ratio_old : p.load(kept(Kept::states + s)),
          out.states[s].data());
    return open;
  }

  /// What the law answered, to the points. A point that opens, or is open, is without stress: what
  /// its shape had stored is gone, and its volume gives back its own.
  template <class Where, class At>
  void give(std::size_t first, Batch& batch, const At& at, const Block& row, double dt,
            const Called& c, const Beside& beside) {
    const auto p = at.beyond(first);
    const auto from = [](const std::array<Numbers, 6>& six) {
      return [&](std::size_t a) { return six[a].data(); };
    };
    WideTensor sigma = load_tensor(from(c.stress), row);
    const WideTensor strain = load_tensor(from(c.strain), row);
    // What is not told, as of an open point, or is zero, as at an apex, is known from before.
    const Wide told = row.load(c.modulus.data()), known = p.load(kept(Kept::modulus));
    const Wide modulus = select(told > known, told, known);
    const Wide own = row.load(c.bulk.data());
    Wide bulk = select(own == own, own, bulk_over_modulus_ * told);
    bulk = select(bulk > 0.0, bulk, p.load(kept(Kept::bulk)));
    const Wide pressure = trace(sigma) * (1.0 / 3);
    Wide opening = row.load(beside.closing.data());
    const auto was_closed = opening > 0.0;
    auto open = !was_closed;
    if (of_.separates) {
      open = open || pressure < 0.0;
      opening = select(was_closed && pressure < 0.0, pressure / bulk, opening);
    }
    const Wide e = row.load(c.e.data()), now = volume(e);
    const Wide held = p.load(kept(Kept::stored));
    const Wide shape = smaller(held, elastic_.energy(deviator(sigma)) * now);
    sigma = select(open, WideTensor::Zero(), sigma);
    EnergiesOf<Wide> energies;
    if (tells_) {
      energies.stored = row.load(c.stored.data()) * now;
      energies.plastic = row.load(c.dissipated.data()) * now;
    } else {
      const Wide mean = volume(0.5 * (row.load(c.e_old.data()) + e));
      energies.stored = elastic_.energy(sigma) * now;
      energies.plastic = 0.5 * mean * (row.load(beside.begun.data()) + sigma.dot(strain)) -
                         (energies.stored - held);
    }
    energies.stored = select(open, Wide(0.0), energies.stored);
    energies.plastic = select(open, shape, energies.plastic);
    p.store(bulk, kept(Kept::bulk));
    keep(p, row, c, sigma, strain, modulus, select(open, opening, Wide(0.0)), energies.stored, dt);
    batch.sigma.store(cauchy(e) * sigma, at, Where::tensor);
    batch.energies.store(energies, at, Zeros::energies);
    if (!batch.work.empty()) at.store(energies.stored - held + energies.plastic, batch.work);
    batch.stability.store({modulus * cauchy(e), 0.0}, at, Zeros::stability);
    const auto flows = energies.plastic > 1e-9 * energies.stored;
    for (std::size_t lane = 0; lane < Wide::size(); ++lane)
      batch.regime[at(lane)] = open[lane] ? 0 : flows[lane] ? 2 : 1;
  }

  template <class At>
  void keep(const At& p, const Block& row, const Called& c, const WideTensor& sigma,
            const WideTensor& strain, const Wide& modulus, const Wide& opening, const Wide& stored,
            const Wide& dt) {
    store_tensor(
        sigma, [&](std::size_t a) { return kept(Kept::stress + a); }, p);
    if (of_.umat) {
      const auto total = load_tensor([&](std::size_t a) { return c.total[a].data(); }, row);
      store_tensor(
          total + strain, [&](std::size_t a) { return kept(Kept::total + a); }, p);
    }
    p.store(modulus, kept(Kept::modulus)), p.store(opening, kept(Kept::opening));
    p.store(stored, kept(Kept::stored));
    for (std::size_t a = 0; a < 2; ++a)
      p.store(row.load(c.counted[a].data()), kept(Kept::counted + a));
    p.store(row.load(c.clock.data()) + dt, kept(Kept::clock));
    p.store(row.load(c.steps.data()) + 1.0, kept(Kept::steps));
    for (std::size_t s = 0; s < c.states.size(); ++s)
      p.store(row.load(c.states[s].data()), kept(Kept::states + s));
  }

  /// False, and the failure noted, where the law cannot go on.
  bool call(Called& c, int size, double dt) {
    ExternalPoints points = c.points(size, dt);
    std::string why;
    if (const int at = law_->update(points, why))
      return note(c, static_cast<std::size_t>(at - 1), why);
    for (std::size_t k = 0; k < static_cast<std::size_t>(size); ++k) {
      double sum = c.modulus[k];
      for (const auto& component : c.stress) sum += component[k];
      for (const auto& state : c.states) sum += state[k];
      if (!std::isfinite(sum)) return note(c, k, "its answer is no number");
    }
    return true;
  }

  bool note(const Called& c, std::size_t k, const std::string& why) {
    const std::lock_guard lock(noting_);
    if (failed_) return false;
    const auto numbers = [&](const auto& six) {
      return fmt::format("{:.4g} {:.4g} {:.4g} {:.4g} {:.4g} {:.4g}", six[0][k], six[1][k],
                         six[2][k], six[3][k], six[4][k], six[5][k]);
    };
    failure_ = fmt::format(
        "point {:.0f}: {} (step {:.0f}, strain {}, void ratio {:.4g}) run law-test on the library",
        c.id[k], why, c.steps[k] + 1.0, numbers(c.strain), c.e[k]);
    failed_ = true;
    return false;
  }

  /// What the law tells of itself under a small strain from a point's stress: its modulus, the
  /// share of it that is the bulk's, and whether and from where it counts energies.
  void probe(std::size_t p, const InitialState& start) {
    constexpr double small = 1e-6;
    Called c(of_.initial_state.size());
    const auto pressure = [&] { return (c.stress[0][0] + c.stress[1][0] + c.stress[2][0]) / 3.0; };
    for (std::size_t a = 0; a < 6; ++a) {
      c.stress[a][0] = kept(Kept::stress + a)[p];
      c.strain[a][0] = c.total[a][0] = 0.0;
    }
    const double before = pressure(), change = before > 0.0 ? -small : small;
    for (std::size_t a = 0; a < 3; ++a) c.strain[a][0] = change / 3.0, c.spin[a][0] = 0.0;
    c.e_old[0] = start.void_ratio, c.e[0] = (1.0 + start.void_ratio) * std::exp(-change) - 1.0;
    c.modulus[0] = c.bulk[0] = c.stored[0] = c.dissipated[0] = nan;
    c.id[0] = kept(Kept::id)[p];
    c.clock[0] = c.steps[0] = c.counted[0][0] = c.counted[1][0] = 0.0;
    for (std::size_t s = 0; s < c.states.size(); ++s)
      c.states[s][0] = s + 1 == of_.void_ratio_state ? start.void_ratio : of_.initial_state[s];
    if (!call(c, 1, small)) check();
    if (!(c.modulus[0] > 0.0)) {
      note(c, 0, "it tells no stiffness (DDSDDE, EUNLOADING, modulus)");
      check();
    }
    reference_modulus_ = c.modulus[0];
    bulk_over_modulus_ =
        std::clamp((pressure() - before) / change / reference_modulus_, 0.05, 0.95);
    elastic_.bulk = bulk_over_modulus_ * reference_modulus_;
    elastic_.shear = 0.75 * (reference_modulus_ - elastic_.bulk);
    tells_ = std::isfinite(c.stored[0]) && std::isfinite(c.dissipated[0]);
    const auto at = Block{0};
    const Wide energy =
        elastic_.energy(load_tensor([&](std::size_t a) { return c.stress[a].data(); }, at));
    counts_from_start_ = tells_ && std::abs(c.stored[0]) < 0.5 * energy[0];
  }

  ExternalConstants of_;
  std::unique_ptr<ExternalLaw> law_;
  SolidVolume volume_;
  Columns kept_;
  bool tells_ = false;
  bool counts_from_start_ = false;  // its elastic energy, not that of the stress it starts with
  std::atomic<bool> in_step_ = false;
  double reference_modulus_ = 0.0, bulk_over_modulus_ = 0.5;
  Elastic elastic_;
  std::mutex one_at_a_time_, noting_;
  std::atomic<bool> failed_ = false;
  std::string failure_;
};

[[maybe_unused]] const bool registered =
    material_registry()
        .emplace("external", [](const Case& c) { return std::make_unique<ExternalBody>(c); })
        .second;

}  // namespace
}  // namespace grainpair
