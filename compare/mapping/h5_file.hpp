// An HDF5 file as reading runs and writing fields needs it. Errors are hdf5::Error with the file's
// and the object's name.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cases/hdf5.hpp"

namespace grainpair {

class H5File {
 public:
  static H5File open(const std::string& path);    // to read
  static H5File create(const std::string& path);  // to write, over what was there

  const std::string& path() const { return path_; }
  bool has(const std::string& object) const;  // every link of the path exists
  std::vector<std::string> members(const std::string& group) const;

  /// A whole dataset, or an openPMD constant component (a group with `value` and `shape`), in C
  /// order.
  std::vector<double> read(const std::string& dataset) const;
  double number(const std::string& object, const std::string& attribute) const;
  std::string text(const std::string& object, const std::string& attribute) const;
  bool has_attribute(const std::string& object, const std::string& attribute) const;

  void make_group(const std::string& group);
  void write(const std::string& dataset, std::span<const double> values,
             const std::vector<hsize_t>& shape);
  /// A compressed dataset of `frames` arrays of `shape`, to be filled frame by frame; `exact` keeps
  /// doubles.
  void make_series(const std::string& dataset, hsize_t frames, const std::vector<hsize_t>& shape,
                   bool exact);
  void write_frame(const std::string& dataset, hsize_t frame, std::span<const double> values);
  void set(const std::string& object, const std::string& attribute, const std::string& text);
  void set(const std::string& object, const std::string& attribute, double number);
  /// Throws where what was written does not reach the disk.
  void close() { file_.finish(); }

 private:
  H5File(std::string path, hdf5::Handle file);
  hdf5::Handle object(const std::string& name) const;
  std::string where(const std::string& name) const { return path_ + ":" + name; }

  std::string path_;
  hdf5::Handle file_;
};

}  // namespace grainpair
