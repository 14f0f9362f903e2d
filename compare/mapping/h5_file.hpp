// An HDF5 file as reading runs and writing fields needs it. Errors are hdf5::Error with the file's
// and the object's name.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cases/hdf5.hpp"

namespace grainpair {

/// A block of a dataset as the file holds it: bytes of like weight together, then deflated.
struct PackedBlock {
  std::vector<unsigned char> bytes;

  /// Of `values` of the shape `count`, NaN where `block`, as long or longer along one axis, holds
  /// more. Threads may pack at once.
  PackedBlock(std::span<const double> values, const std::vector<hsize_t>& count,
              const std::vector<hsize_t>& block, bool exact);
};

class H5File {
 public:
  static H5File open(const std::string& path);    // to read
  static H5File create(const std::string& path);  // to write, over what was there

  const std::string& path() const { return path_; }
  bool has(const std::string& object) const;  // every link of the path exists
  std::vector<std::string> members(const std::string& group) const;

  /// Numbers in a one-dimensional dataset, or an openPMD constant component (a group with `value`
  /// and `shape`). Throws where it is none, or says it holds more than the file has room for.
  std::size_t length(const std::string& dataset) const;
  bool stored(const std::string& dataset) const;  // a dataset, not a constant
  /// All of them, finite, of which there must be `expected`.
  std::vector<double> read(const std::string& dataset, std::size_t expected) const;
  double number(const std::string& object, const std::string& attribute) const;
  /// As many numbers as are expected.
  std::vector<double> numbers(const std::string& object, const std::string& attribute,
                              std::size_t expected) const;
  std::string text(const std::string& object, const std::string& attribute) const;
  bool has_attribute(const std::string& object, const std::string& attribute) const;

  void make_group(const std::string& group);
  void write(const std::string& dataset, std::span<const double> values,
             const std::vector<hsize_t>& shape);
  /// A compressed dataset of `frames` arrays of `shape`, NaN where nothing is written, to be filled
  /// by blocks of the shape `block`; `exact` keeps doubles.
  void make_series(const std::string& dataset, hsize_t frames, const std::vector<hsize_t>& shape,
                   const std::vector<hsize_t>& block, bool exact);
  /// A block of one frame, at `start`; start is as long as the shape of a frame.
  void write_block(const std::string& dataset, hsize_t frame, const std::vector<hsize_t>& start,
                   const PackedBlock& block);
  void set(const std::string& object, const std::string& attribute, const std::string& text);
  void set(const std::string& object, const std::string& attribute, double number);
  /// Throws where what was written does not reach the disk.
  void close() { file_.finish(); }

 private:
  H5File(std::string path, hdf5::Handle file);
  hdf5::Handle object(const std::string& name) const;
  std::size_t length(const std::string& name, const hdf5::Handle& found) const;
  hdf5::Handle attribute(const std::string& object, const std::string& attribute,
                         std::size_t expected) const;
  std::string where(const std::string& name) const { return path_ + ":" + name; }

  std::string path_;
  hdf5::Handle file_;
  mutable std::string there_;  // where has() found something last: its siblings are asked for next
};

}  // namespace grainpair
