#include "compare/mapping/run_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "cases/file.hpp"
#include "compare/mapping/around.hpp"

namespace grainpair {
namespace {

constexpr double glued = 3.0;  // the record `kind` of a grain that belongs to the wall
constexpr double layout = 1.0;
// Records of contacts call walls that; of a quarter of a cylinder these two are no walls but planes
// of symmetry, whose forces are stress along the angle.
constexpr double left = -1.0, front = -4.0;
constexpr double quarter = 0.5 * std::numbers::pi;  // of a cylinder, which the grains simulate
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double longest_branch = 10.0;  // in the largest diameter; longer ones mistake a unit
constexpr std::int64_t outermost_id = std::int64_t{1} << 53;  // doubles hold all up to there

[[noreturn]] void refuse(const H5File& file, const std::string& where, const std::string& what) {
  throw std::runtime_error(hdf5::one_line(file.path() + ":" + where + ": " + what));
}

/// The case inside a result file was checked when the run began; here its keys are only looked up,
/// so that a run made with an older schema can still be mapped.
Scene scene_of_case(const H5File& file) {
  const toml::table table =
      parse_toml(file.text("/", "case_resolved"), file.path() + ":/@case_resolved");
  const auto key = [&](const char* section, const char* name) {
    const auto node = table[section][name];
    if (!node)
      throw std::runtime_error(file.path() + ": no " + section + "." + name + " in case_resolved");
    return node;
  };
  const auto number = [&](const char* section, const char* name) {
    const double value = key(section, name).value_or(0.0);
    if (!(value > 0.0 && std::isfinite(value)))
      refuse(file, "/@case_resolved", fmt::format("{}.{} is not positive", section, name));
    return value;
  };
  const auto word = [&](const char* section, const char* name) {
    return key(section, name).value_or(std::string());
  };
  Scene scene;
  if (word("geometry", "dimension") == "axisymmetric") {
    if (file.has_attribute("/", "source"))
      refuse(file, "/@case_resolved",
             "grains or points of another program about an axis (which sector is not told)");
    scene.angle = quarter;
  }
  scene.has_case = true;
  scene.thickness = number("geometry", "thickness");
  scene.periodic = {false, false, word("walls", "front_back") == "periodic"};
  scene.wall_low = Vec3::Zero();
  const std::string kind = table["geometry"]["scene"].value_or(std::string("collapse"));
  if (kind == "chute") {
    scene.length = number("geometry", "length");
    scene.periodic[0] = true, scene.wall_low[0] = nan;
  }
  scene.wall_high = {nan, nan, scene.angle > 0.0 ? nan : scene.thickness};
  scene.grain = {number("grains", "diameter"), number("grains", "density")};
  scene.unit = scene.grain.diameter;
  scene.kernel = word("compare", "kernel");
  scene.width = number("compare", "width");
  scene.spacing = number("compare", "spacing");
  return scene;
}

Vec3 vector(const H5File& file, const std::string& object, const std::string& attribute) {
  if (!file.has_attribute(object, attribute)) return Vec3::Constant(nan);
  const auto values = file.numbers(object, attribute, 3);
  return {values[0], values[1], values[2]};
}

Scene scene_of_grains(const H5File& file) {
  Scene scene;
  const Vec3 periodic = vector(file, "/", "periodic");
  for (std::size_t a = 0; a < 3; ++a)
    scene.periodic[a] = periodic[static_cast<Eigen::Index>(a)] > 0.0;
  scene.wall_low = vector(file, "/", "wall_low");
  scene.wall_high = vector(file, "/", "wall_high");
  for (int a = 0; a < 3; ++a)
    if (std::isinf(scene.wall_low[a]) || std::isinf(scene.wall_high[a]) ||
        scene.wall_low[a] >= scene.wall_high[a])
      refuse(file, "/@wall_low", "not below wall_high, or infinite");
  return scene;
}

std::int64_t whole(const H5File& file, const std::string& where, double value) {
  if (value != std::floor(value) || std::abs(value) > static_cast<double>(outermost_id))
    refuse(file, where, fmt::format("{} is no id", value));
  return static_cast<std::int64_t>(value);
}

/// Ids of a frame in ascending order, each with the index of the grain among those that move, -1
/// for a glued one.
class Ids {
 public:
  Ids(const H5File& file, const std::string& where, const std::vector<double>& ids,
      const std::vector<std::size_t>& moving)
      : list_(ids.size()) {
    for (std::size_t p = 0; p < ids.size(); ++p) list_[p] = {whole(file, where, ids[p]), -1};
    for (std::size_t i = 0; i < moving.size(); ++i)
      list_[moving[i]].second = static_cast<std::int64_t>(i);
    std::sort(list_.begin(), list_.end());
    const auto twice =
        std::adjacent_find(list_.begin(), list_.end(),
                           [](const auto& a, const auto& b) { return a.first == b.first; });
    if (twice != list_.end()) refuse(file, where, fmt::format("id {} twice", twice->first));
  }
  /// Nothing where no grain has that id.
  std::optional<std::int64_t> moving(std::int64_t id) const {
    const auto found =
        std::lower_bound(list_.begin(), list_.end(), std::pair{id, std::int64_t{-1}});
    if (found == list_.end() || found->first != id) return {};
    return found->second;
  }

 private:
  std::vector<std::pair<std::int64_t, std::int64_t>> list_;
};

double diameter_of(double volume) { return std::cbrt(6.0 * volume / std::numbers::pi); }

}  // namespace

RunFile::RunFile(const std::string& path, double density)
    : file_(H5File::open(path)), engine_(file_.text("/", "engine")), density_(density) {
  if (engine_ != "dem" && engine_ != "mpm")
    refuse(file_, "/@engine", "neither dem nor mpm ('" + engine_ + "')");
  if (file_.has_attribute("/", "schema_version") && file_.number("/", "schema_version") != layout)
    refuse(file_, "/@schema_version",
           fmt::format("{:g}, where {:g} is known (of another version of grainpair)",
                       file_.number("/", "schema_version"), layout));
  for (const auto& name : file_.members("/data")) {
    if (name.empty() || name.size() > 18 ||
        name.find_first_not_of("0123456789") != std::string::npos)
      refuse(file_, "/data/" + name, "not the number of a step");
    steps_.push_back(std::stoll(name));
  }
  std::sort(steps_.begin(), steps_.end());
  if (steps_.empty()) refuse(file_, "/data", "no frames");
  const bool has_case = file_.has_attribute("/", "case_resolved");
  scene_ = has_case ? scene_of_case(file_) : scene_of_grains(file_);
  if (!has_case || file_.has_attribute("/", "diameter")) grains_themselves();
}

/// Diameter and density: as the file says, else those of the first frame.
void RunFile::grains_themselves() {
  const auto told = [&](const char* name) {
    const double value = file_.has_attribute("/", name) ? file_.number("/", name) : nan;
    if (value <= 0.0 || std::isinf(value)) refuse(file_, std::string("/@") + name, "not positive");
    return value;
  };
  Grain grain{told("diameter"), told("density")};
  if (!std::isnan(grain.density)) density_ = grain.density;  // the file's word goes first
  if (std::isnan(grain.diameter) || std::isnan(grain.density)) {
    const auto points = this->points(0);
    const auto volume = volumes(points), mass = masses(points);
    if (volume.empty()) refuse(file_, group(0), "nothing in it moves, and no diameter is told");
    double d4 = 0.0, d3 = 0.0, m = 0.0;
    for (std::size_t p = 0; p < volume.size(); ++p)
      d4 += volume[p] * diameter_of(volume[p]), d3 += volume[p], m += mass[p];
    if (std::isnan(grain.diameter)) grain.diameter = std::isnan(d3) ? spacing(points) : d4 / d3;
    if (std::isnan(grain.density)) grain.density = m / d3;
  }
  scene_.grain = grain;
  if (!scene_.has_case) scene_.unit = grain.diameter;
}

/// What lengths are told in where points tell no volumes: how far apart they are in the box around
/// them [m].
double RunFile::spacing(const Points& points) const {
  const auto x = pick(vectors(points.at + "position", points.count), points.moving);
  Vec3 lower = x.front(), upper = x.front();
  for (const Vec3& r : x) lower = lower.cwiseMin(r), upper = upper.cwiseMax(r);
  const Vec3 size = upper - lower;
  double product = 1.0, axes = 0.0;
  for (int a = 0; a < 3; ++a)
    if (size[a] > 1e-6 * size.maxCoeff()) product *= size[a], axes += 1.0;
  if (axes == 0.0)
    refuse(file_, points.at + "solid_volume", "missing, and one place tells no length");
  return std::pow(product / static_cast<double>(x.size()), 1.0 / axes);
}

double RunFile::time(std::size_t frame) const { return file_.number(group(frame), "time"); }

Box RunFile::box(std::size_t frame) const {
  const Scene& s = scene_;
  if (s.has_case && s.length > 0.0) return {{0.0, nan, 0.0}, {s.length, nan, s.thickness}};
  if (s.has_case) return {{nan, nan, 0.0}, {nan, nan, s.thickness}};
  const std::string at = group(frame);
  Box box{vector(file_, at, "box_lower"), vector(file_, at, "box_upper")};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto i = static_cast<Eigen::Index>(a);
    const double period = box.upper[i] - box.lower[i];
    if (s.periodic[a] && !(period > 0.0 && std::isfinite(period)))
      refuse(file_, at,
             fmt::format("no box_lower and box_upper along {}, which repeats", "xyz"[a]));
  }
  return box;
}

std::vector<Vec3> RunFile::vectors(const std::string& record, std::size_t expected) const {
  std::vector<Vec3> out(expected);
  for (int a = 0; a < 3; ++a) {
    const auto values = file_.read(record + "/" + "xyz"[a], expected);
    for (std::size_t p = 0; p < expected; ++p) out[p][a] = values[p];
  }
  return out;
}

std::vector<double> RunFile::positive(const std::string& record, std::size_t expected) const {
  auto values = file_.read(record, expected);
  const auto bad = std::find_if_not(values.begin(), values.end(), [](double x) { return x > 0.0; });
  if (bad != values.end())
    refuse(file_, record, fmt::format("entry {} is not positive", bad - values.begin()));
  return values;
}

std::vector<double> RunFile::volumes(const Points& points) const {
  const bool spheres = file_.has(points.at + "radius");
  if (file_.has(points.at + "solid_volume") || (!spheres && engine_ == "dem"))
    return pick(positive(points.at + "solid_volume", points.count), points.moving);
  if (!spheres) {
    auto out = pick(positive(points.at + "mass", points.count), points.moving);
    const double density = scene_.has_case ? scene_.grain.density : density_;
    for (double& m : out) m /= density;
    return out;
  }
  auto out = pick(positive(points.at + "radius", points.count), points.moving);
  for (double& r : out) r = 4.0 / 3.0 * std::numbers::pi * r * r * r;
  return out;
}

std::vector<double> RunFile::masses(const Points& points) const {
  if (file_.has(points.at + "mass"))
    return pick(positive(points.at + "mass", points.count), points.moving);
  if (std::isnan(density_))
    refuse(file_, points.at + "mass", "missing, and no density is told: --density RHO");
  auto out = volumes(points);
  for (double& m : out) m *= density_;
  return out;
}

RunFile::Points RunFile::points(std::size_t frame) const {
  Points points{group(frame) + "/particles/cloud/", 0, {}};
  if (!file_.has(points.at + "position")) refuse(file_, points.at + "position", "missing");
  // What all other lengths are held against is a dataset: a constant can say any.
  for (const char* name : {"position/x", "position/y", "position/z", "id", "radius"})
    if (file_.has(points.at + name) && file_.stored(points.at + name)) {
      points.count = file_.length(points.at + name);
      break;
    }
  std::vector<double> kind;
  if (file_.has(points.at + "kind")) kind = file_.read(points.at + "kind", points.count);
  for (std::size_t p = 0; p < points.count; ++p)
    if (kind.empty() || kind[p] != glued) points.moving.push_back(p);
  return points;
}

/// Within the domain where it repeats: other codes let grains wander off it.
std::vector<Vec3> RunFile::positions(std::size_t frame, const Points& points) const {
  auto x = pick(vectors(points.at + "position", points.count), points.moving);
  if (scene_.has_case && !(scene_.length > 0.0)) return x;
  const Box box = this->box(frame);
  for (int a = 0; a < 3; ++a) {
    if (!scene_.periodic[static_cast<std::size_t>(a)]) continue;
    const double period = box.upper[a] - box.lower[a];
    for (Vec3& r : x) r[a] -= period * std::floor((r[a] - box.lower[a]) / period);
  }
  return x;
}

std::optional<Reach> RunFile::reach(std::size_t frame) const {
  const Points points = this->points(frame);
  auto x = positions(frame, points);
  if (x.empty()) return {};
  if (scene_.angle > 0.0)
    for (Vec3& place : x) place = Around(place)(place);
  std::vector<double> radius(x.size(), 0.5 * scene_.grain.diameter);
  if (!scene_.has_case && file_.has(points.at + "radius"))
    radius = pick(positive(points.at + "radius", points.count), points.moving);
  Reach out{x[0], x[0], x[0], x[0]};
  for (std::size_t p = 0; p < x.size(); ++p) {
    const Vec3 r = Vec3::Constant(radius[p]);
    out.lower = out.lower.cwiseMin(x[p]), out.upper = out.upper.cwiseMax(x[p]);
    out.grains_lower = out.grains_lower.cwiseMin(x[p] - r);
    out.grains_upper = out.grains_upper.cwiseMax(x[p] + r);
  }
  return out;
}

Cloud RunFile::cloud(std::size_t frame) const {
  const Points points = this->points(frame);
  const std::string& at = points.at;
  const auto& which = points.moving;
  Cloud c;
  c.x = positions(frame, points);
  c.v = pick(vectors(at + "velocity", points.count), which);
  c.mass = masses(points);
  c.solid_volume = volumes(points);
  if (file_.has(at + "angular_velocity")) {
    c.spin = pick(vectors(at + "angular_velocity", points.count), which);
    const auto radius = pick(positive(at + "radius", points.count), which);
    for (std::size_t p = 0; p < c.size(); ++p)
      c.inertia.push_back(0.4 * c.mass[p] * radius[p] * radius[p]);
  }
  if (engine_ == "mpm") read_state(points, c);
  if (file_.has(group(frame) + "/contacts")) {
    double largest = scene_.grain.diameter;
    for (const double volume : c.solid_volume) largest = std::max(largest, diameter_of(volume));
    read_contacts(frame, points, largest, c);
  } else if (file_.has(at + "id")) {
    Ids(file_, at + "id", file_.read(at + "id", points.count), which);
  }
  if (scene_.angle > 0.0) turn(c);
  return c;
}

void RunFile::read_contacts(std::size_t frame, const Points& points, double size,
                            Cloud& cloud) const {
  const std::string at = group(frame) + "/contacts/", ids = points.at + "id";
  const Ids known(file_, ids, file_.read(ids, points.count), points.moving);
  if (!file_.stored(at + "first")) refuse(file_, at + "first", "not a dataset");
  const std::size_t count = file_.length(at + "first");
  const auto first = file_.read(at + "first", count), second = file_.read(at + "second", count);
  const auto branch = vectors(at + "branch", count), point = vectors(at + "position", count),
             force = vectors(at + "force", count);
  std::vector<double> power;
  if (file_.has(at + "dissipation")) power = file_.read(at + "dissipation", count);

  const Box box = this->box(frame);
  const auto nearest = [&](Vec3 r) {
    for (int a = 0; a < 3; ++a)
      if (scene_.periodic[static_cast<std::size_t>(a)]) {
        const double period = box.upper[a] - box.lower[a];
        r[a] -= period * std::round(r[a] / period);
      }
    return r;
  };
  const auto grain = [&](const std::string& name, double id) {
    const auto found = known.moving(whole(file_, at + name, id));
    if (!found) refuse(file_, at + name, fmt::format("{} is no grain of the frame", id));
    return *found;
  };
  cloud.has_contacts = true;
  cloud.has_dissipation = !power.empty();
  cloud.contact_number.assign(cloud.size(), 0.0);
  cloud.contacts.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const bool wall = second[i] < 0.0;
    std::int64_t a = grain("first", first[i]), b = wall ? -1 : grain("second", second[i]);
    Vec3 f = force[i];
    Vec3 l = scene_.has_case ? branch[i] : nearest(branch[i]);
    if (a <
        0) {  // a glued grain comes first: seen from the moving one, force and branch turn round
      if (b < 0) continue;
      std::swap(a, b);
      f = -f, l = -l;
    }
    Contact c;
    c.start = cloud.x[static_cast<std::size_t>(a)];
    c.force = f;
    c.dissipation = power.empty() ? 0.0 : power[i];
    c.wall = b < 0 && !(scene_.angle > 0.0 && (second[i] == left || second[i] == front));
    const Vec3 to_point = nearest(point[i] - c.start);
    c.point = c.start + to_point;
    c.branch = b < 0 && !wall ? Vec3(-to_point) : l;
    if (!(c.branch.norm() < longest_branch * size && to_point.norm() < longest_branch * size))
      refuse(file_, at + "branch",
             fmt::format("contact {} is {:.3g} m long, of grains of {:.3g} m (units? images?)", i,
                         std::max(c.branch.norm(), to_point.norm()), size));
    cloud.contact_number[static_cast<std::size_t>(a)] += 1.0;
    if (b >= 0) cloud.contact_number[static_cast<std::size_t>(b)] += 1.0;
    cloud.contacts.push_back(c);
  }
}

}  // namespace grainpair
