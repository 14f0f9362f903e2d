// A run about an axis, brought to radius, height and angle.
#include <numbers>

#include "compare/mapping/around.hpp"
#include "compare/mapping/run_file.hpp"

namespace grainpair {

void RunFile::turn(Cloud& c) const {
  for (std::size_t p = 0; p < c.size(); ++p) {
    const Around here(c.x[p]);
    c.x[p] = here(c.x[p]), c.v[p] = here(c.v[p]);
    if (!c.spin.empty()) c.spin[p] = here(c.spin[p]);
  }
  for (Contact& k : c.contacts) {
    const Around middle(k.start - 0.5 * k.branch);
    for (Vec3* one : {&k.start, &k.branch, &k.point, &k.force}) *one = middle(*one);
  }
  if (engine_ != "mpm") return;
  const double share = scene_.angle / (2.0 * std::numbers::pi);  // points are whole circles
  for (auto* of_circle : {&c.mass, &c.solid_volume, &c.volume})
    for (double& value : *of_circle) value *= share;
}

}  // namespace grainpair
