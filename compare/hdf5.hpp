// The little of HDF5 that reading runs and writing fields takes, owned by RAII. Errors are std::runtime_error with the
// file's and the object's name; HDF5's own error stack is silenced.
#pragma once

#include <hdf5.h>

#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace grainpair::hdf5 {

/// An identifier of HDF5, closed when it goes.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id < 0) throw std::runtime_error(what);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

class File {
 public:
  static File open(const std::string& path);    // to read
  static File create(const std::string& path);  // to write, over what was there

  const std::string& path() const { return path_; }
  bool has(const std::string& object) const;                      // every link of the path exists
  std::vector<std::string> members(const std::string& group) const;

  /// A whole dataset, or an openPMD constant component (a group with `value` and `shape`), in C order.
  std::vector<double> read(const std::string& dataset) const;
  double number(const std::string& object, const std::string& attribute) const;
  std::string text(const std::string& object, const std::string& attribute) const;
  bool has_attribute(const std::string& object, const std::string& attribute) const;

  void make_group(const std::string& group);
  void write(const std::string& dataset, std::span<const double> values, const std::vector<hsize_t>& shape);
  /// A compressed dataset of `frames` arrays of `shape`, to be filled frame by frame; `exact` keeps doubles.
  void make_series(const std::string& dataset, hsize_t frames, const std::vector<hsize_t>& shape, bool exact);
  void write_frame(const std::string& dataset, hsize_t frame, std::span<const double> values);
  void set(const std::string& object, const std::string& attribute, const std::string& text);
  void set(const std::string& object, const std::string& attribute, double number);

 private:
  File(std::string path, hid_t id);
  Handle object(const std::string& name) const;
  std::string where(const std::string& name) const { return path_ + ":" + name; }

  std::string path_;
  Handle file_;
};

}  // namespace grainpair::hdf5
