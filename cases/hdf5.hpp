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
#include <cstring>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace grainpair::hdf5 {

/// Why the library's last call failed, in the system's words where it has them ("No space left on
/// device").
inline std::string reason() {
  std::string found;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_DOWNWARD,
      [](unsigned, const H5E_error2_t* error, void* out) -> herr_t {
        constexpr std::string_view mark = "error message = '";
        const std::string_view text = error->desc ? error->desc : "";
        const auto at = text.find(mark);
        if (at == std::string_view::npos) return 0;
        const auto words = text.substr(at + mark.size());
        *static_cast<std::string*>(out) =
            " (" + std::string(words.substr(0, words.find('\''))) + ")";
        return 0;
      },
      &found);
  return found;
}

struct Error : std::runtime_error {
  explicit Error(const std::string& what) : std::runtime_error(what + reason()) {}
};

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
    if (id_ >= 0) close_(id_);
  }
  /// Closes it now, and throws where that fails: what was written may reach the disk only then.
  void finish() {
    if (close_(std::exchange(id_, -1)) < 0) throw Error("HDF5: cannot write the end of a file");
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

/// A compressed one-dimensional dataset, stored as `stored` (native type of T by default).
template <class T>
Handle write_dataset(hid_t parent, const std::string& name, std::span<const T> values,
                     hid_t stored = H5I_INVALID_HID) {
  const hsize_t n = values.size();
  const Handle space(H5Screate_simple(1, &n, nullptr), H5Sclose, "make a dataspace");
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "make a property list");
  if (n > 0) {
    H5Pset_chunk(creation, 1, &n);
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, 2);
  }
  Handle dataset(H5Dcreate2(parent, name.c_str(), stored == H5I_INVALID_HID ? type_of<T>() : stored,
                            space, H5P_DEFAULT, creation, H5P_DEFAULT),
                 H5Dclose, "create dataset " + name);
  if (H5Dwrite(dataset, type_of<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw Error("HDF5: cannot write dataset " + name);
  return dataset;
}

template <class T>
std::vector<T> read_dataset(hid_t parent, const std::string& name) {
  const Handle dataset(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose,
                       "open dataset " + name);
  const Handle space(H5Dget_space(dataset), H5Sclose, "read a dataspace");
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  if (H5Dread(dataset, type_of<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw Error("HDF5: cannot read dataset " + name);
  return values;
}

}  // namespace grainpair::hdf5
