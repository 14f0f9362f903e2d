// HDF5 for result files: groups, datasets and attributes with handles that close themselves.
// Failures throw.
#pragma once

#include <fcntl.h>
#include <hdf5.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cases/room.hpp"

namespace grainpair::hdf5 {

/// Why the library's last call failed: the system's errno, 0 where it is not the system's failure.
inline int reason() {
  int found = 0;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_DOWNWARD,
      [](unsigned, const H5E_error2_t* error, void* out) -> herr_t {
        constexpr std::string_view mark = "errno = ";
        const std::string_view text = error->desc ? error->desc : "";
        const auto at = text.find(mark);
        if (at != std::string_view::npos)
          *static_cast<int*>(out) = std::atoi(text.data() + at + mark.size());
        return 0;
      },
      &found);
  return found;
}

/// One line, whatever names and texts a file holds.
inline std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  return text;
}

/// With the system's words where it has any ("No space left on device").
struct Error : std::runtime_error {
  explicit Error(const std::string& what) : Error(one_line(what), reason()) {}
  int code;  // errno, or 0

 private:
  Error(const std::string& what, int why)
      : std::runtime_error(why ? what + " (" + std::strerror(why) + ")" : what), code(why) {}
};

/// What a destructor could not write, until finish() or flush() tells it: much reaches the file
/// only when a dataset is closed.
inline std::optional<Error> lost;
inline void tell_losses() {
  if (auto error = std::exchange(lost, {})) throw Error(*error);
}

/// Owns one HDF5 identifier.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id < 0) throw Error("HDF5: cannot " + what);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() {
    if (id_ >= 0 && close_(id_) < 0 && !lost) lost.emplace("HDF5: cannot write all of a file");
  }
  /// Closes it now, and throws where that fails: what was written may reach the disk only then.
  void finish() {
    if (close_(std::exchange(id_, -1)) < 0) throw Error("HDF5: cannot write the end of a file");
    tell_losses();
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

template <class T>
hid_t type_of();
template <>
inline hid_t type_of<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
inline hid_t type_of<std::uint32_t>() {
  return H5T_NATIVE_UINT32;
}
template <>
inline hid_t type_of<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}
template <>
inline hid_t type_of<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
inline hid_t type_of<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
template <>
inline hid_t type_of<int>() {
  return H5T_NATIVE_INT;
}

/// Errors are exceptions, not prints; and what could not be written is not tried again at the end
/// of the program, where the library would crash over it.
inline void begin() {
  lost.reset();
  H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

/// In the format of HDF5 1.10, whose groups and attributes are the smaller and faster.
inline Handle create_file(const std::string& path) {
  begin();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "make a property list");
  H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
  return {H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, "create " + path};
}

/// Brings all that was written into the file, which can be read up to here if the process is killed
/// later. Throws where that fails.
inline void flush(hid_t file) {
  if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0) throw Error("HDF5: cannot write a file");
  tell_losses();
}

/// Why a file that HDF5 does not open cannot be read.
inline std::string unreadable(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK);
  if (file < 0) return std::strerror(errno);
  struct stat about {};
  const bool regular = ::fstat(file, &about) == 0 && S_ISREG(about.st_mode);
  // HDF5 locks what it writes.
  const bool held = ::flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(file);
  return held      ? "another process is writing it; wait until that has ended"
         : regular ? "not HDF5, or cut short"
                   : "not a file";
}

inline Handle open_file(const std::string& path) {
  begin();
  std::error_code unknown;
  const hid_t file = std::filesystem::is_regular_file(path, unknown)
                         ? H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT)
                         : H5I_INVALID_HID;
  if (file < 0) throw Error(path + ": cannot be read (" + unreadable(path) + ")");
  return {file, H5Fclose, ""};
}

/// Creates a group and whatever groups lead to it.
inline Handle create_group(hid_t parent, const std::string& name) {
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, "make a property list");
  H5Pset_create_intermediate_group(links, 1);
  return {H5Gcreate2(parent, name.c_str(), links, H5P_DEFAULT, H5P_DEFAULT), H5Gclose,
          "create group " + name};
}

template <class T>
void write_attribute(hid_t object, const std::string& name, std::span<const T> values) {
  const hsize_t n = values.size();
  const Handle space(H5Screate_simple(1, &n, nullptr), H5Sclose, "make a dataspace");
  const Handle attribute(
      H5Acreate2(object, name.c_str(), type_of<T>(), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
      "create attribute " + name);
  if (H5Awrite(attribute, type_of<T>(), values.data()) < 0)
    throw Error("HDF5: cannot write attribute " + name);
}

template <class T>
requires std::is_arithmetic_v<T>
void write_attribute(hid_t object, const std::string& name, T value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "make a dataspace");
  const Handle attribute(
      H5Acreate2(object, name.c_str(), type_of<T>(), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
      "create attribute " + name);
  if (H5Awrite(attribute, type_of<T>(), &value) < 0)
    throw Error("HDF5: cannot write attribute " + name);
}

/// Text of fixed length, as openPMD wants it.
inline void write_attribute(hid_t object, const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "copy a type");
  H5Tset_size(type, std::max<std::size_t>(value.size(), 1));
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  const bool ascii = std::ranges::all_of(value, [](unsigned char c) { return c < 0x80; });
  H5Tset_cset(type, ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "make a dataspace");
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose, "create attribute " + name);
  if (H5Awrite(attribute, type, value.c_str()) < 0)
    throw Error("HDF5: cannot write attribute " + name);
}

/// A one-dimensional dataset of `n` numbers of type `stored`, of which `together` are compressed at
/// a time.
inline Handle create_dataset(hid_t parent, const std::string& name, hid_t stored, hsize_t n,
                             hsize_t together) {
  const Handle space(H5Screate_simple(1, &n, nullptr), H5Sclose, "make a dataspace");
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "make a property list");
  if (n > 0) {
    H5Pset_chunk(creation, 1, &together);
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, 2);
  }
  return {H5Dcreate2(parent, name.c_str(), stored, space, H5P_DEFAULT, creation, H5P_DEFAULT),
          H5Dclose, "create dataset " + name};
}

/// Puts `values` into a dataset, from number `begin` on.
template <class T>
void write_rows(hid_t dataset, hsize_t begin, std::span<const T> values) {
  const hsize_t n = values.size();
  const Handle ours(H5Screate_simple(1, &n, nullptr), H5Sclose, "make a dataspace");
  const Handle there(H5Dget_space(dataset), H5Sclose, "read a dataspace");
  H5Sselect_hyperslab(there, H5S_SELECT_SET, &begin, nullptr, &n, nullptr);
  if (H5Dwrite(dataset, type_of<T>(), ours, there, H5P_DEFAULT, values.data()) < 0)
    throw Error("HDF5: cannot write rows of a dataset");
}

/// A compressed one-dimensional dataset, stored as `stored` (native type of T by default).
template <class T>
Handle write_dataset(hid_t parent, const std::string& name, std::span<const T> values,
                     hid_t stored = H5I_INVALID_HID) {
  Handle dataset = create_dataset(parent, name, stored == H5I_INVALID_HID ? type_of<T>() : stored,
                                  values.size(), values.size());
  if (H5Dwrite(dataset, type_of<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw Error("HDF5: cannot write dataset " + name);
  return dataset;
}

/// Throws where a dataset says it holds more numbers than the file has room for.
inline void check_room(hid_t dataset, hid_t type, double numbers, const std::string& where) {
  constexpr double densest = 1040.0;  // bytes that deflate can make of one, at most
  const double bytes = static_cast<double>(H5Dget_storage_size(dataset));
  if (numbers * static_cast<double>(H5Tget_size(type)) > densest * bytes)
    throw Error(where + ": holds fewer numbers than it says (cut short?)");
}

template <class T>
std::vector<T> read_dataset(hid_t parent, const std::string& name) {
  const Handle dataset(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose,
                       "open dataset " + name);
  const Handle space(H5Dget_space(dataset), H5Sclose, "read a dataspace");
  const Handle type(H5Dget_type(dataset), H5Tclose, "read a type");
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 0) throw Error("HDF5: no length of dataset " + name);
  check_room(dataset, type, static_cast<double>(count), "dataset " + name);
  std::vector<T> values(static_cast<std::size_t>(count));
  if (H5Dread(dataset, type_of<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw Error("HDF5: cannot read dataset " + name);
  return values;
}

/// Calls `work`, which writes the file `path`. Throws RoomError where room runs out in it, once
/// what it leaves behind is removed.
template <class Work>
void with_room(const std::string& path, double needs, Work&& work) {
  int code = 0;
  try {
    work();
    return;
  } catch (const Error& error) {
    if (!is_full(error.code)) throw;
    code = error.code;
  }
  throw RoomError(path, code, needs);
}

}  // namespace grainpair::hdf5
