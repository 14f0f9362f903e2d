// A run of either engine, read back from its HDF5 file as a sequence of clouds.
#pragma once

#include <string>
#include <vector>

#include "compare/mapping/coarse_grain.hpp"
#include "compare/mapping/h5_file.hpp"

namespace grainpair {

/// What the mapping needs of the case, from the file's attribute `case_resolved`.
struct Scene {
  double thickness;  // W [m]
  bool periodic;     // front and back
  Grain grain;
  std::string kernel;
  double width, spacing;  // [d]
};

class RunFile {
 public:
  explicit RunFile(const std::string& path);

  const Scene& scene() const { return scene_; }
  const std::string& engine() const { return engine_; }  // "mpm" or "dem"
  const H5File& file() const { return file_; }
  std::size_t frames() const { return steps_.size(); }
  double time(std::size_t frame) const;                  // [s]
  std::vector<Vec3> positions(std::size_t frame) const;  // of what moves
  Cloud cloud(std::size_t frame) const;

 private:
  std::string group(std::size_t frame) const { return "/data/" + std::to_string(steps_[frame]); }
  std::vector<Vec3> vectors(const std::string& record) const;
  /// Indices of the points that move: glued grains are part of the wall.
  std::vector<std::size_t> moving(std::size_t frame) const;
  void read_contacts(std::size_t frame, const std::vector<std::size_t>& moving, Cloud& cloud) const;

  H5File file_;
  std::string engine_;
  Scene scene_;
  std::vector<long> steps_;
};

}  // namespace grainpair
