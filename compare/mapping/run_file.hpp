// A run of either engine, or grains of another code, read back from the HDF5 file as a sequence of
// clouds. Whatever a file holds, it is either read or refused in one line: lengths are held against
// each other and against the file, numbers must be finite, ids unique.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "compare/mapping/coarse_grain.hpp"
#include "compare/mapping/h5_file.hpp"

namespace grainpair {

/// What the mapping needs to know besides the points: of a run of ours from the file's attribute
/// `case_resolved`, of other grains from the file's root attributes.
struct Scene {
  bool has_case = false;
  std::array<bool, 3> periodic{};
  Vec3 wall_low, wall_high;  // plane walls that a kernel is folded at [m], NaN where there is none
  double thickness = 0.0;    // W of a case [m]
  double length = 0.0;       // of a chute, which repeats after it along x [m]
  // Angle of the sector that is mapped about the axis x = z = 0 [rad]; zero where there is none.
  double angle = 0.0;
  Grain grain{};
  double unit = 0.0;  // what width and spacing are told in [m]
  std::string kernel = "gauss";
  double width = 0.75, spacing = 1.0;  // [d]
};

/// The domain in one frame; NaN where it is not told [m].
struct Box {
  Vec3 lower, upper;
};

/// How far centres reach, and grains [m].
struct Reach {
  Vec3 lower, upper, grains_lower, grains_upper;
};

/// The values of the points `which`.
template <class T>
std::vector<T> pick(const std::vector<T>& all, const std::vector<std::size_t>& which) {
  std::vector<T> out;
  out.reserve(which.size());
  for (const auto p : which) out.push_back(all[p]);
  return out;
}

class RunFile {
 public:
  /// `density`: of grains whose mass the file does not tell [kg/m3]; NaN where nobody does.
  explicit RunFile(const std::string& path,
                   double density = std::numeric_limits<double>::quiet_NaN());

  const Scene& scene() const { return scene_; }
  const std::string& engine() const { return engine_; }  // "mpm" or "dem"
  const H5File& file() const { return file_; }
  std::size_t frames() const { return steps_.size(); }
  double time(std::size_t frame) const;  // [s], NaN where it is not told
  Box box(std::size_t frame) const;
  std::optional<Reach> reach(std::size_t frame) const;  // of what moves, if anything does
  Cloud cloud(std::size_t frame) const;

 private:
  /// The points of a frame: how many, and which of them move; glued grains are part of the wall.
  struct Points {
    std::string at;
    std::size_t count;
    std::vector<std::size_t> moving;
  };

  std::string group(std::size_t frame) const { return "/data/" + std::to_string(steps_[frame]); }
  Points points(std::size_t frame) const;
  std::vector<Vec3> vectors(const std::string& record, std::size_t expected) const;
  std::vector<double> positive(const std::string& record, std::size_t expected) const;
  /// Of solid, of what moves [m3]; NaN where points of another program do not tell it.
  std::vector<double> volumes(const Points& points) const;
  std::vector<double> masses(const Points& points) const;  // [kg]
  std::vector<Vec3> positions(std::size_t frame, const Points& points) const;
  void grains_themselves();
  /// About an axis: turns places and vectors to radius, height and angle.
  void turn(Cloud& cloud) const;
  double spacing(const Points& points) const;
  std::vector<std::string> untold(const Points& points, const Cloud& cloud) const;
  void read_state(const Points& points, Cloud& cloud) const;
  void read_contacts(std::size_t frame, const Points& points, double size, Cloud& cloud) const;

  H5File file_;
  std::string engine_;
  Scene scene_;
  double density_;
  std::vector<std::int64_t> steps_;
};

}  // namespace grainpair
