// Every contact force of a moment, rebuilt from the grains' state: the engine reports forces, but
// no energies.
//
// LIGGGHTS evaluates a force with the positions of time t and the velocities of t - dt/2. Rebuilt
// with those half-step velocities, the sum of contact forces on each grain agrees with the engine's
// own to round-off (force_error), which is what makes the energies below trustworthy.
//
// Energies and powers of one contact [symbols in dem_reference/grains.py]; u is the relative
// velocity at time t, v the one at t - dt/2:
//     U_n = 8/15 Y* sqrt(R*) delta^(5/2)          U_t = 1/2 k_t |s|^2
//     P_n = gamma_n v_n u_n                         P_t = -F_t . u_t - dU_t/dt
// The work of a force over one step is F . u dt exactly, since u is the mean of the velocities
// before and after it; with v in its place the dissipation came out 4 % too large. With dU_t/dt
// written out, P_t = gamma_t v_t . u_t - 1/2 dk_t/dt |s|^2 while sticking, and
// -F_t . u_t - d/dt[(mu F_n)^2 / (2 k_t)] while sliding. The second terms matter: k_t follows the
// overlap, so U_t is no true potential, and what it gains or loses without work must be booked for
// the balance to close. All of them are smooth in time and can therefore be sampled.
//
// Rolling resistance of LIGGGHTS' models epsd and epsd2 is a torque M on the second grain, -M on
// the first, w the relative spin at time t, w_t its part across the normal:
//     U_r = |M_s|^2 / (2 k_r)                       P_r = M . w - dU_r/dt
// M_s is the spring's share of M, which the engine keeps as it is while k_r follows the overlap: so
// dU_r/dt = M_s . w_t - U_r dk_r/dt / k_r while it winds up.
//
// Ranks: a moment is of the grains that one rank owns, the first `owned` of those it is handed, and
// of the others that touch them. Their contacts all push on owned grains here; in sums and in
// Accounts a contact counts on the rank that owns its grain of the lower id, and nowhere else.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace grainpair::ledger {

using Vector = Eigen::Vector3d;

constexpr std::int32_t kMobile = 1;  // type of a moving grain (dem_reference/scene.py)
// Columns of the engine's contacts (dem_reference/scripts/bodies.in), and with rolling resistance.
constexpr int kPlainColumns = 7, kRollingColumns = 10;

/// Rolling resistance, by the code of its model in moment.py.
enum class Rolling { none, epsd, epsd2 };

/// Spheres of one material, and what moves them [SI units]. The same as in moment.py. Radius, mass
/// and inertia are those of all, or of a grain of the nominal diameter where Atoms tells each its
/// own.
struct Scene {
  double radius, mass, inertia;
  double contact_modulus, contact_shear_modulus, damping_factor, friction;
  double wall_damping_factor;
  double rolling_model, rolling_friction, rolling_damping;
  double time_step, gravity;  // gravity along -y
  double thickness, length;   // periods along z and x; 0 where there is none
  double pull;                // gravity along x

  Rolling rolling() const { return static_cast<Rolling>(static_cast<int>(rolling_model)); }
  int columns() const { return rolling() == Rolling::none ? kPlainColumns : kRollingColumns; }
};

/// A wall that stands: a part of the plane across `axis` at `position`, its lower edge at y =
/// `lowest`, its left one at x = `begin`.
struct Plane {
  double position, friction, lowest, begin, rise;  // rise: its speed along y [m/s]
  std::int64_t code, axis;
};

/// What the engine holds of its grains, read where it lies; x, v, f, omega, torque: (count, 3).
struct Atoms {
  std::int64_t count, owned;
  const double *x, *v, *f, *omega, *torque;
  const std::int32_t *id, *type;
  const double* radius;  // (count,) [m]; none: all have the scene's
};

/// Of a contact: normal, tangential, rolling.
using Parts = std::array<double, 3>;

/// A contact of two grains, by their places in the engine's order. The same as in moment.py.
struct Pair {
  std::int64_t first, second;
  std::int64_t counts;           // 1 where this rank owns the grain of the lower id
  std::uint64_t key;             // of the pair of ids, the lower one in front
  Vector branch, normal, force;  // normal: from the second grain to the first; force: on the first
  Vector torque;                 // of rolling resistance, on the first
  double arm, overlap;           // arm: from the first centre to the contact point
  Parts elastic, power, work_rate;  // [J, W, W]
};

/// A contact with a wall. The same as in moment.py.
struct Touch {
  std::int64_t grain, code;
  std::int64_t rough;            // whether the wall has friction
  Vector normal, branch, force;  // branch: grain's centre - contact point
  double overlap, elastic, power, work_rate;
  double driven;  // what the wall's own motion does on the grain [W]
};

/// Energies held by grains and contacts [J]. The same as in moment.py.
struct Held {
  double kinetic, rotational, potential;
  double normal, tangential, rolling, wall;  // elastic
  double force_error;                        // of the engine's forces against the rebuilt ones [N]
  double torque_error;  // of its torques, with rolling resistance [N m]; else 0
};

class Moment {
 public:
  explicit Moment(const Scene& scene) : scene_(scene) {}

  /// rows: the engine's contacts, (count, columns): two ids, periodic flag, spring s (3), with
  /// rolling resistance its spring's torque M_s (3), overlap.
  /// Throws std::out_of_range where one is of a grain that was not handed over.
  void look(const Atoms& atoms, std::span<const double> rows, std::span<const Plane> planes);

  const Atoms& atoms() const { return atoms_; }
  bool mobile(std::int64_t grain) const { return mobile_[grain]; }
  const std::vector<Pair>& pairs() const { return pairs_; }
  const std::vector<Touch>& touches() const { return touches_; }
  const Held& held() const { return held_; }
  const Scene& scene() const { return scene_; }

 private:
  double radius(std::int64_t k) const { return atoms_.radius ? atoms_.radius[k] : scene_.radius; }
  /// Of a grain's mass over the scene's.
  double share(std::int64_t k) const {
    const double of = atoms_.radius[k] / scene_.radius;
    return of * of * of;
  }
  double mass(std::int64_t k) const { return atoms_.radius ? scene_.mass * share(k) : scene_.mass; }
  double inertia(std::int64_t k) const {
    return atoms_.radius ? 0.4 * mass(k) * atoms_.radius[k] * atoms_.radius[k] : scene_.inertia;
  }
  void half_step_velocities();
  template <bool Equal, bool Rolls>
  Pair pair(const double* row, double reach) const;
  struct Stiffness;
  void roll(const Vector& spring, const Stiffness& of, Pair& pair) const;
  void add_torque(const Pair& pair);
  void touch(const Plane& plane);
  void wall_friction();
  void wall_rolling();
  void sums();

  Scene scene_;
  Atoms atoms_{};
  std::vector<std::int64_t> place_;  // of an id in the engine's order, -1 where it is not here
  std::vector<char> mobile_;
  std::vector<int> rough_walls_;  // that a grain touches
  std::vector<Vector> v_half_, omega_half_, pair_force_, rest_;
  std::vector<Vector> pair_torque_, rest_torque_;  // with rolling resistance alone
  std::vector<Pair> pairs_;
  std::vector<Touch> touches_;
  Held held_{};
};

}  // namespace grainpair::ledger
