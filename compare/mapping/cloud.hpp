// A cloud: points with mass and velocity, and the forces between them. Grains and material points
// both become one and pass through the same kernel, so that what is compared has been filtered
// once, and alike.
#pragma once

#include <algorithm>
#include <string>
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
  std::vector<double> volume;  // with voids [m3]; empty: solid_volume (1 + void_ratio)

  /// Fields that points of another program lack records for; what stands here for those is NaN.
  std::vector<std::string> untold;

  double volume_of(std::size_t p) const {
    return volume.empty() ? solid_volume[p] * (1.0 + void_ratio[p]) : volume[p];
  }
  std::size_t size() const { return x.size(); }
  /// Whether these are grains of different masses (material points are no grains).
  bool of_several_masses() const {
    if (mass.empty() || !stress.empty()) return false;
    const auto [low, high] = std::minmax_element(mass.begin(), mass.end());
    return *high - *low > 1e-9 * *high;
  }
};

/// A range of one axis, lower <= x < upper; `period` of the domain there, 0 where it does not
/// repeat [m].
struct Range {
  int axis;
  double lower, upper;
  double period = 0.0;
};

/// The part of a branch between two planes, with the share of its force that lies there. False
/// where nothing of the contact does.
inline bool cut(Contact& k, const Range& range) {
  const auto inside = [&](const Vec3& r) {
    return r[range.axis] >= range.lower && r[range.axis] < range.upper;
  };
  // Points r(s) = start - s branch, s in [0, 1]; those with lower <= r[axis] < upper.
  double s0 = 0.0, s1 = 1.0;
  const double a = k.start[range.axis], b = -k.branch[range.axis];
  if (b == 0.0) {
    if (!inside(k.start)) s1 = -1.0;
  } else {
    const double sl = (range.lower - a) / b, su = (range.upper - a) / b;
    s0 = std::max(s0, std::min(sl, su));
    s1 = std::min(s1, std::max(sl, su));
  }
  const bool point_inside = inside(k.point);
  if (s1 <= s0 && !point_inside) return false;
  k.start -= s0 * k.branch;
  k.branch *= std::max(0.0, s1 - s0);
  k.wall = k.wall && point_inside;
  if (!point_inside) k.dissipation = 0.0;
  return true;
}

/// The part of a cloud within a range; branches are cut at the two planes. For profiles, which
/// average over a range of the other coordinates. Where the domain repeats, the images next to it
/// count as well.
inline Cloud cut(const Cloud& c, const Range& range) {
  Cloud out;
  out.has_contacts = c.has_contacts;
  out.has_dissipation = c.has_dissipation;
  out.untold = c.untold;
  const auto keep = [](const auto& from, auto& to, std::size_t p) {
    if (!from.empty()) to.push_back(from[p]);
  };
  for (const int image : {0, -1, 1}) {
    if (image != 0 && range.period == 0.0) break;
    Vec3 shift = Vec3::Zero();
    shift[range.axis] = image * range.period;
    for (std::size_t p = 0; p < c.size(); ++p) {
      const Vec3 x = c.x[p] + shift;
      if (!(x[range.axis] >= range.lower && x[range.axis] < range.upper)) continue;
      out.x.push_back(x);
      keep(c.v, out.v, p), keep(c.mass, out.mass, p), keep(c.solid_volume, out.solid_volume, p);
      keep(c.spin, out.spin, p), keep(c.inertia, out.inertia, p),
          keep(c.contact_number, out.contact_number, p);
      keep(c.void_ratio, out.void_ratio, p),
          keep(c.granular_temperature, out.granular_temperature, p);
      keep(c.stress, out.stress, p), keep(c.volume, out.volume, p);
    }
    for (Contact k : c.contacts) {
      k.start += shift, k.point += shift;
      if (cut(k, range)) out.contacts.push_back(k);
    }
  }
  return out;
}

}  // namespace grainpair
