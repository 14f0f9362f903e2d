#include "compare/mapping/run_file.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace grainpair {
namespace {

constexpr double glued = 3.0;  // the record `kind` of a grain that belongs to the wall

/// The case inside a result file was checked when the run began; here its keys are only looked up,
/// so that a run made with an older schema can still be mapped.
Scene read_scene(const H5File& file) {
  const toml::table table = toml::parse(file.text("/", "case_resolved"));
  const auto key = [&](const char* section, const char* name) {
    const auto node = table[section][name];
    if (!node)
      throw std::runtime_error(file.path() + ": no " + section + "." + name + " in case_resolved");
    return node;
  };
  const auto number = [&](const char* section, const char* name) {
    return key(section, name).value_or(0.0);
  };
  const auto word = [&](const char* section, const char* name) {
    return key(section, name).value_or(std::string());
  };
  if (word("geometry", "dimension") == "axisymmetric")
    throw std::runtime_error(file.path() +
                             ": an axisymmetric run has no common grid with grains yet");
  return {number("geometry", "thickness"),
          word("walls", "front_back") == "periodic",
          {number("grains", "diameter"), number("grains", "density")},
          word("compare", "kernel"),
          number("compare", "width"),
          number("compare", "spacing")};
}

template <class T>
std::vector<T> pick(const std::vector<T>& all, const std::vector<std::size_t>& which) {
  std::vector<T> out;
  out.reserve(which.size());
  for (const auto p : which) out.push_back(all[p]);
  return out;
}

}  // namespace

RunFile::RunFile(const std::string& path)
    : file_(H5File::open(path)), engine_(file_.text("/", "engine")), scene_(read_scene(file_)) {
  for (const auto& name : file_.members("/data")) steps_.push_back(std::stol(name));
  std::sort(steps_.begin(), steps_.end());
  if (steps_.empty()) throw std::runtime_error(path + ":/data: no frames");
}

double RunFile::time(std::size_t frame) const { return file_.number(group(frame), "time"); }

std::vector<Vec3> RunFile::vectors(const std::string& record) const {
  const auto x = file_.read(record + "/x"), y = file_.read(record + "/y"),
             z = file_.read(record + "/z");
  if (y.size() != x.size() || z.size() != x.size())
    throw std::runtime_error(file_.path() + ":" + record + ": components of different length");
  std::vector<Vec3> out(x.size());
  for (std::size_t p = 0; p < x.size(); ++p) out[p] = {x[p], y[p], z[p]};
  return out;
}

std::vector<std::size_t> RunFile::moving(std::size_t frame) const {
  const std::string cloud = group(frame) + "/particles/cloud";
  std::vector<double> kind;
  if (file_.has(cloud + "/kind")) kind = file_.read(cloud + "/kind");
  const std::size_t n = kind.empty() ? file_.read(cloud + "/mass").size() : kind.size();
  std::vector<std::size_t> out;
  for (std::size_t p = 0; p < n; ++p)
    if (kind.empty() || kind[p] != glued) out.push_back(p);
  return out;
}

std::vector<Vec3> RunFile::positions(std::size_t frame) const {
  return pick(vectors(group(frame) + "/particles/cloud/position"), moving(frame));
}

Cloud RunFile::cloud(std::size_t frame) const {
  const std::string at = group(frame) + "/particles/cloud/";
  const auto which = moving(frame);
  Cloud c;
  c.x = pick(vectors(at + "position"), which);
  c.v = pick(vectors(at + "velocity"), which);
  c.mass = pick(file_.read(at + "mass"), which);
  c.solid_volume = pick(file_.read(at + "solid_volume"), which);
  if (file_.has(at + "angular_velocity")) {
    c.spin = pick(vectors(at + "angular_velocity"), which);
    const auto radius = pick(file_.read(at + "radius"), which);
    for (std::size_t p = 0; p < c.size(); ++p)
      c.inertia.push_back(0.4 * c.mass[p] * radius[p] * radius[p]);
  }
  if (file_.has(at + "stress")) {
    c.void_ratio = pick(file_.read(at + "void_ratio"), which);
    c.granular_temperature = pick(file_.read(at + "granular_temperature"), which);
    std::array<std::vector<double>, 6> s;
    constexpr std::array names{"xx", "yy", "zz", "xy", "yz", "zx"};
    for (std::size_t i = 0; i < 6; ++i) s[i] = pick(file_.read(at + "stress/" + names[i]), which);
    for (std::size_t p = 0; p < c.size(); ++p) {
      Mat3 m;
      m << s[0][p], s[3][p], s[5][p], s[3][p], s[1][p], s[4][p], s[5][p], s[4][p], s[2][p];
      c.stress.push_back(from_matrix(m));
    }
  }
  if (file_.has(group(frame) + "/contacts")) read_contacts(frame, which, c);
  return c;
}

void RunFile::read_contacts(std::size_t frame, const std::vector<std::size_t>& moving,
                            Cloud& cloud) const {
  const std::string at = group(frame) + "/contacts/";
  const auto id = file_.read(group(frame) + "/particles/cloud/id");
  std::unordered_map<long, std::size_t> index;  // of a moving grain, by its id
  for (std::size_t i = 0; i < moving.size(); ++i) index.emplace(std::lround(id[moving[i]]), i);

  const auto first = file_.read(at + "first"), second = file_.read(at + "second");
  const auto branch = vectors(at + "branch"), point = vectors(at + "position"),
             force = vectors(at + "force");
  std::vector<double> power;
  if (file_.has(at + "dissipation")) power = file_.read(at + "dissipation");

  const double period = scene_.periodic ? scene_.thickness : 0.0;
  const auto nearest = [period](Vec3 r) {
    if (period > 0.0) r.z() -= period * std::round(r.z() / period);
    return r;
  };
  cloud.has_contacts = true;
  cloud.has_dissipation = !power.empty();
  cloud.contact_number.assign(cloud.size(), 0.0);
  for (std::size_t i = 0; i < first.size(); ++i) {
    auto a = index.find(std::lround(first[i])), b = index.find(std::lround(second[i]));
    const bool wall = second[i] < 0.0;
    Vec3 f = force[i];
    Vec3 l = branch[i];
    if (a == index.end()) {  // a glued grain comes first: seen from the moving one, force and
                             // branch turn round
      if (b == index.end()) continue;
      std::swap(a, b);
      f = -f, l = -l;
    }
    Contact c;
    c.start = cloud.x[a->second];
    c.force = f;
    c.dissipation = power.empty() ? 0.0 : power[i];
    c.wall = b == index.end();
    const Vec3 to_point = nearest(point[i] - c.start);
    c.point = c.start + to_point;
    c.branch = c.wall && !wall ? Vec3(-to_point) : l;
    cloud.contact_number[a->second] += 1.0;
    if (b != index.end()) cloud.contact_number[b->second] += 1.0;
    cloud.contacts.push_back(c);
  }
}

}  // namespace grainpair
