// Laws that are called as a UMAT of Abaqus, point by point: tension positive, 11 22 33 12 13 23,
// engineering shear strains; the stress comes turned by DROT, tensors among the state variables are
// the law's to turn [Abaqus User Subroutines Reference Guide, UMAT].
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mpm/external/guard.hpp"
#include "mpm/external/law.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {
namespace {

using UmatFunction = void(double* stress, double* statev, double* ddsdde, double* sse, double* spd,
                          double* scd, double* rpl, double* ddsddt, double* drplde, double* drpldt,
                          double* stran, double* dstran, double* time, double* dtime, double* temp,
                          double* dtemp, double* predef, double* dpred, char* cmname, int* ndi,
                          int* nshr, int* ntens, int* nstatv, double* props, int* nprops,
                          double* coords, double* drot, double* pnewdt, double* celent,
                          double* dfgrd0, double* dfgrd1, int* noel, int* npt, int* layer,
                          int* kspt, int* kstep, int* kinc, std::size_t cmname_length);

constexpr double shortest = 1e-4;  // of the step, as PNEWDT may ask

/// What one call takes and leaves, between guards; saved, so that a step can be tried again.
struct Arguments {
  Guarded stress_, state_, tangent_, total_, strain_, constants_;
  double *stress, *state, *tangent, *total, *strain, *constants;
  std::array<double, 2> counted{};
  std::size_t states;

  Arguments(std::size_t state_count, const std::vector<double>& numbers)
      : stress(stress_.of(6)),
        state(state_.of(state_count)),
        tangent(tangent_.of(36)),
        total(total_.of(6)),
        strain(strain_.of(6)),
        constants(constants_.of(numbers.size())),
        states(state_count),
        saved_(state_count) {
    std::ranges::copy(numbers, constants);
  }
  void save() {
    std::copy_n(stress, 6, saved_stress_.begin()), std::copy_n(state, states, saved_.begin());
    saved_counted_ = counted;
  }
  void restore() {
    std::copy_n(saved_stress_.begin(), 6, stress), std::copy_n(saved_.begin(), states, state);
    counted = saved_counted_;
  }
  bool intact() const {
    for (const auto* one : {&stress_, &state_, &tangent_, &total_, &strain_, &constants_})
      if (!one->intact()) return false;
    return true;
  }

 private:
  std::array<double, 6> saved_stress_{};
  std::array<double, 2> saved_counted_{};
  std::vector<double> saved_;
};

class Umat final : public ExternalLaw {
 public:
  explicit Umat(const Case& scene)
      : constants_(scene), library_(scene, {"umat_", "umat", "UMAT"}) {}

  int update(ExternalPoints& points, std::string& why) const override {
    Arguments& mine = arguments();
    for (int i = 0; i < points.block.size; ++i)
      if (!update_one(points, static_cast<std::size_t>(i), mine, why)) return i + 1;
    return 0;
  }
  const double* tangent() const override { return arguments().tangent; }

 private:
  /// Of this thread and this law.
  Arguments& arguments() const {
    thread_local Arguments held(0, {});
    thread_local const Umat* owner = nullptr;
    if (owner != this)
      held = Arguments(static_cast<std::size_t>(constants_.state_count), constants_.numbers),
      owner = this;
    return held;
  }

  bool update_one(ExternalPoints& points, std::size_t i, Arguments& a, std::string& why) const {
    auto& block = points.block;
    const auto states = static_cast<std::size_t>(constants_.state_count);
    std::array<double, 6> strain{};
    for (std::size_t c = 0; c < 6; ++c) {
      a.stress[abaqus_place[c]] = -block.stress[c][i];
      strain[abaqus_place[c]] = (c < 3 ? -1.0 : -2.0) * block.strain[c][i];
      a.total[abaqus_place[c]] = (c < 3 ? -1.0 : -2.0) * points.total[c][i];
    }
    for (std::size_t s = 0; s < states; ++s) a.state[s] = block.state[s][i];
    for (std::size_t k = 0; k < 2; ++k) a.counted[k] = points.counted[k][i];
    const Vec3 angle = block.dt * Vec3(block.spin[0][i], block.spin[1][i], block.spin[2][i]);
    const double size = angle.norm();
    Mat3 turn = size > 0.0 ? Eigen::AngleAxisd(size, angle / size).toRotationMatrix()
                           : Mat3(Mat3::Identity());
    // PNEWDT < 1 asks for this step again, shorter; the steps that follow are as short.
    double share = 1.0;
    for (double done = 0.0; done < 1.0;) {
      a.save();
      const double left = 1.0 - done, h = std::min(share, left);
      for (std::size_t c = 0; c < 6; ++c) a.strain[c] = h * strain[c];
      const double asked = call(points, i, h, done, turn, a, why);
      if (!why.empty()) return false;
      if (asked < 1.0) {
        share = h * std::clamp(asked, 0.1, 0.9);
        if (share < shortest) {
          why = "it asks for ever smaller steps (PNEWDT)";
          return false;
        }
        a.restore();
        continue;
      }
      for (std::size_t c = 0; c < 6; ++c) a.total[c] += h * strain[c];
      done = h == left ? 1.0 : done + h;
      turn = Mat3::Identity();
    }
    for (std::size_t c = 0; c < 6; ++c) block.stress[c][i] = -a.stress[abaqus_place[c]];
    for (std::size_t s = 0; s < states; ++s) block.state[s][i] = a.state[s];
    block.modulus[i] = std::max({a.tangent[0], a.tangent[7], a.tangent[14]});
    double sum = 0.0;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) sum += a.tangent[6 * r + c];
    points.bulk[i] = sum / 9.0;
    if (a.counted[0] != 0.0 || a.counted[1] != 0.0) {
      block.stored[i] = a.counted[0];
      block.dissipated[i] = a.counted[1] - points.counted[1][i];
    }
    for (std::size_t k = 0; k < 2; ++k) points.counted[k][i] = a.counted[k];
    return true;
  }

  /// PNEWDT of one call over a share h of the step.
  double call(ExternalPoints& points, std::size_t i, double h, double done, const Mat3& turn,
              Arguments& a, std::string& why) const {
    const auto& block = points.block;
    double scd = 0.0, rpl = 0.0, drpldt = 0.0, temp = 0.0, dtemp = 0.0, predef = 0.0, dpred = 0.0;
    double dt = h * block.dt, now = points.time[i] + done * block.dt, time[] = {now, now};
    double pnewdt = 1.0, size = constants_.cell_size;
    double ddsddt[6] = {}, drplde[6] = {}, coords[3] = {};
    Mat3 rotation = turn, still = Mat3::Identity(), moved = still;
    const double w[] = {block.spin[0][i], block.spin[1][i], block.spin[2][i]};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const std::size_t shear = r + c == 1 ? 3 : r + c == 3 ? 4 : 5;
        moved(r, c) -= h * block.strain[r == c ? static_cast<std::size_t>(r) : shear][i];
      }
    const double t = h * block.dt;
    moved(0, 1) -= t * w[2], moved(1, 0) += t * w[2], moved(0, 2) += t * w[1];
    moved(2, 0) -= t * w[1], moved(1, 2) -= t * w[0], moved(2, 1) += t * w[0];
    std::array<char, 80> name;
    name.fill(' '), std::ranges::copy(std::string_view("GRAINPAIR"), name.begin());
    int ndi = 3, nshr = 3, ntens = 6, nstatv = constants_.state_count,
        nprops = static_cast<int>(constants_.numbers.size()),
        noel = static_cast<int>(points.id[i]) + 1, npt = 1, layer = 1, kspt = 1,
        kstep[] = {1, 0, 0, 0}, kinc = static_cast<int>(points.steps[i]) + 1;
    std::fill_n(a.tangent, 36, 0.0);
    const Inside here(points.id[i]);
    const int failed = guarded(why, [&] {
      library_.function<UmatFunction>()(
          a.stress, a.state, a.tangent, &a.counted[0], &a.counted[1], &scd, &rpl, ddsddt, drplde,
          &drpldt, a.total, a.strain, time, &dt, &temp, &dtemp, &predef, &dpred, name.data(), &ndi,
          &nshr, &ntens, &nstatv, a.constants, &nprops, coords, rotation.data(), &pnewdt, &size,
          still.data(), moved.data(), &noel, &npt, &layer, &kspt, kstep, &kinc, name.size());
      return 0;
    });
    if (!failed && !a.intact()) why = "the law writes beside its arrays";
    return pnewdt;
  }

  ExternalConstants constants_;
  Library library_;
};

}  // namespace

std::unique_ptr<ExternalLaw> make_umat(const Case& scene) { return std::make_unique<Umat>(scene); }

}  // namespace grainpair
