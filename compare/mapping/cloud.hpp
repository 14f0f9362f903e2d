// A cloud: points with mass and velocity, and the forces between them. Grains and material points
// both become one and pass through the same kernel, so that what is compared has been filtered
// once, and alike.
#pragma once

#include <optional>
#include <vector>

#include "mpm/numbers/tensor.hpp"

namespace grainpair {

/// A force along a branch. Between two moving grains the branch runs from centre to centre; against
/// a wall or a glued grain it ends at the contact point, and the force also enters the
/// interaction-force density there (Weinhart et al. 2012).
struct Contact {
  Vec3 start;                // centre of the first grain [m]
  Vec3 branch;               // from the other end to `start`, nearest image [m]
  Vec3 point;                // contact point [m]
  Vec3 force;                // on the first grain [N]
  double dissipation = 0.0;  // [W]
  bool wall = false;
};

struct Cloud {
  // Per point p.
  std::vector<Vec3> x, v;            // [m], [m/s]
  std::vector<double> mass;          // [kg]
  std::vector<double> solid_volume;  // without voids [m3]

  // Grains only; empty otherwise.
  std::vector<Vec3> spin;              // [1/s]
  std::vector<double> inertia;         // [kg m2]
  std::vector<double> contact_number;  // contacts of each grain, walls included
  std::vector<Contact> contacts;
  bool has_contacts = false;
  bool has_dissipation = false;

  // What the material points know themselves; empty otherwise.
  std::vector<double> void_ratio;            // [-]
  std::vector<double> granular_temperature;  // [m2/s2]
  std::vector<SymTensor> stress;             // [Pa]

  std::size_t size() const { return x.size(); }
};

/// The part of a cloud with lower <= x[axis] < upper; branches are cut at the two planes, and each
/// keeps the share of its force that lies inside. For profiles, which average over a range of the
/// other coordinates.
inline Cloud cut(const Cloud& c, int axis, double lower, double upper) {
  const auto inside = [&](const Vec3& r) { return r[axis] >= lower && r[axis] < upper; };
  Cloud out;
  out.has_contacts = c.has_contacts;
  out.has_dissipation = c.has_dissipation;
  const auto keep = [](const auto& from, auto& to, std::size_t p) {
    if (!from.empty()) to.push_back(from[p]);
  };
  for (std::size_t p = 0; p < c.size(); ++p) {
    if (!inside(c.x[p])) continue;
    keep(c.x, out.x, p), keep(c.v, out.v, p), keep(c.mass, out.mass, p),
        keep(c.solid_volume, out.solid_volume, p);
    keep(c.spin, out.spin, p), keep(c.inertia, out.inertia, p),
        keep(c.contact_number, out.contact_number, p);
    keep(c.void_ratio, out.void_ratio, p),
        keep(c.granular_temperature, out.granular_temperature, p);
    keep(c.stress, out.stress, p);
  }
  for (Contact k : c.contacts) {
    // Points r(s) = start - s branch, s in [0, 1]; those with lower <= r[axis] < upper.
    double s0 = 0.0, s1 = 1.0;
    const double a = k.start[axis], b = -k.branch[axis];
    if (b == 0.0) {
      if (!inside(k.start)) s1 = -1.0;
    } else {
      const double sl = (lower - a) / b, su = (upper - a) / b;
      s0 = std::max(s0, std::min(sl, su));
      s1 = std::min(s1, std::max(sl, su));
    }
    const bool point_inside = inside(k.point);
    if (s1 <= s0 && !point_inside) continue;
    k.start -= s0 * k.branch;
    k.branch *= std::max(0.0, s1 - s0);
    k.wall = k.wall && point_inside;
    if (!point_inside) k.dissipation = 0.0;
    out.contacts.push_back(k);
  }
  return out;
}

}  // namespace grainpair
