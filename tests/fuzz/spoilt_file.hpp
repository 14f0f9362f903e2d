// Result files with something wrong in them. Bytes of the fuzzer choose what a file holds and what
// of its structure is spoilt; HDF5 writes each such file once, and keeps it. Other bytes replace
// numbers in it, wherever they lie, so most executions need not write HDF5 at all.
#pragma once

#include <hdf5.h>

#include <array>
#include <cmath>
#include <compare>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "tests/fuzz/fuzz.hpp"

namespace grainpair::fuzz {

/// A file's bytes, and where the numbers in them stand.
struct Image {
  std::string bytes;
  std::vector<std::size_t> numbers;
};

/// Which objects of a file, counted as they are written, are spoilt, and in which way.
struct Spoilt {
  std::uint8_t object = 255, way = 0;
  auto operator<=>(const Spoilt&) const = default;
};
using SpoiltObjects = std::array<Spoilt, 2>;

/// Three of four files are whole, one of 32 is spoilt twice: to write one takes as long as to read
/// it several times.
inline SpoiltObjects spoilt_objects(Choices& choices) {
  SpoiltObjects out;
  const unsigned how = choices.byte();
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto object = static_cast<std::uint8_t>(choices.byte() % 96);
    const auto way = static_cast<std::uint8_t>(choices.byte() % 96);
    if (const unsigned rarely = i == 0 ? 4 : 32; how % rarely == rarely - 1) out[i] = {object, way};
  }
  return out;
}

/// Writes a file in memory, spoiling some of its objects.
class SpoiltFile {
 public:
  explicit SpoiltFile(const SpoiltObjects& spoilt) : spoilt_(spoilt) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, 1 << 14, 0);
    file_ = H5Fcreate("spoilt", H5F_ACC_TRUNC, H5P_DEFAULT, access);
    H5Pclose(access);
    if (file_ < 0) std::abort();
  }
  ~SpoiltFile() { H5Fclose(file_); }
  SpoiltFile(const SpoiltFile&) = delete;
  SpoiltFile& operator=(const SpoiltFile&) = delete;

  void group(const std::string& name) {
    if (const auto way = spoilt_now()) return lead_astray(name, *way);
    H5Gclose(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }

  void dataset(const std::string& name, std::vector<double> values) {
    const auto way = spoilt_now();
    if (H5Lexists(file_, name.substr(0, name.rfind('/')).c_str(), H5P_DEFAULT) <= 0) return;
    std::vector<hsize_t> shape{values.size()};
    hid_t type = H5T_NATIVE_DOUBLE;
    bool none = false;
    if (way) switch (*way % 16) {
        case 0:
          return constant(name, static_cast<double>(values.size()));
        case 1:
          return constant(name, 1e15);
        case 2:
          return text(name);
        case 3:
          return unwritten(name, hsize_t{1} << 40);
        case 4:
          return unwritten(name, values.size());
        case 5:
          shape[0] = *way / 16, values.resize(shape[0], 1.0);
          break;
        case 6:
          shape = {values.size(), 2}, values.resize(2 * values.size(), 0.5);
          break;
        case 7:
          shape.clear(), values.resize(1, 1.0);
          break;
        case 8:
          type = H5T_STD_I16BE;
          break;
        case 9:
          type = H5T_IEEE_F32BE;
          break;
        case 10:
          none = true;
          break;
        default:
          return lead_astray(name, *way);
      }
    const hid_t space =
        none            ? H5Screate(H5S_NULL)
        : shape.empty() ? H5Screate(H5S_SCALAR)
                        : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t data =
        H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (data >= 0) {
      H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
      H5Dclose(data);
    }
    H5Sclose(space);
    remember(values);
  }

  void attribute(const std::string& object, const char* name, std::vector<double> values) {
    const auto way = spoilt_now();
    if (object != "/" && H5Lexists(file_, object.c_str(), H5P_DEFAULT) <= 0) return;
    if (way) switch (*way % 4) {
        case 0:
          return;
        case 1:
          return put_text(object, name, "3");
        case 2:
          values.resize(*way / 16, 1.0);
          break;
        default:
          if (!values.empty()) values[0] = nan;
      }
    const hid_t at = H5Oopen(file_, object.c_str(), H5P_DEFAULT);
    if (at < 0) return;
    const hsize_t size = values.size();
    const hid_t space = size == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &size, nullptr);
    const hid_t made = H5Acreate2(at, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    if (made >= 0) {
      if (size > 0) H5Awrite(made, H5T_NATIVE_DOUBLE, values.data());
      H5Aclose(made);
    }
    H5Sclose(space), H5Oclose(at);
    remember(values);
  }

  void word(const std::string& object, const char* name, const std::string& value) {
    const auto way = spoilt_now();
    if (!way) return put_text(object, name, value);
    switch (*way % 5) {
      case 0:
        return;
      case 1:
        return put_text(object, name, "");
      case 2:
        return put_text(object, name, "two\nlines\x01\xff");
      case 3:
        return attribute(object, name, {3.0});
      default:
        return put_text(object, name, value.substr(0, value.size() * *way / 256));
    }
  }

  /// What was written, and where in it any of the numbers stand. Ends the writing.
  Image image() {
    H5Fflush(file_, H5F_SCOPE_GLOBAL);
    Image out;
    const ssize_t size = H5Fget_file_image(file_, nullptr, 0);
    if (size < 0) std::abort();
    out.bytes.resize(static_cast<std::size_t>(size));
    if (H5Fget_file_image(file_, out.bytes.data(), out.bytes.size()) < 0) std::abort();
    for (std::size_t i = 0; i + sizeof(double) <= out.bytes.size(); i += 4) {
      double number;
      std::memcpy(&number, out.bytes.data() + i, sizeof number);
      if (std::isnormal(number) && written_.contains(number)) out.numbers.push_back(i), i += 4;
    }
    return out;
  }

 private:
  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  void remember(const std::vector<double>& values) {
    for (const double one : values)
      if (std::isnormal(one)) written_.insert(one);
  }

  std::optional<std::uint8_t> spoilt_now() {
    const std::size_t object = objects_++;
    for (const Spoilt& one : spoilt_)
      if (one.object == object) return one.way;
    return std::nullopt;
  }

  /// Something else under that name, or nothing.
  void lead_astray(const std::string& name, std::uint8_t way) {
    const char* at = name.c_str();
    switch (way / 16 % 6) {
      case 0:
        return;
      case 1:
        H5Lcreate_soft("/nowhere", file_, at, H5P_DEFAULT, H5P_DEFAULT);
        return;
      case 2:
        H5Lcreate_soft(at, file_, at, H5P_DEFAULT, H5P_DEFAULT);
        return;
      case 3:
        H5Lcreate_soft("/", file_, at, H5P_DEFAULT, H5P_DEFAULT);
        return;
      case 4:
        H5Lcreate_external("elsewhere.h5", "/", file_, at, H5P_DEFAULT, H5P_DEFAULT);
        return;
      default:
        return unwritten(name, 3);
    }
  }

  /// A constant component of openPMD.
  void constant(const std::string& name, double shape) {
    H5Gclose(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    attribute(name, "value", {0.25}), attribute(name, "shape", {shape});
  }

  /// In pieces of which none is there.
  void unwritten(const std::string& name, hsize_t size) {
    const hid_t space = H5Screate_simple(1, &size, nullptr), how = H5Pcreate(H5P_DATASET_CREATE);
    const hsize_t piece = 16;
    H5Pset_chunk(how, 1, &piece);
    const hid_t data =
        H5Dcreate2(file_, name.c_str(), H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    if (data >= 0) H5Dclose(data);
    H5Pclose(how), H5Sclose(space);
  }

  void text(const std::string& name) {
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, 16);
    const hid_t data =
        H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const char room[16] = "a word";
    if (data >= 0) H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, room), H5Dclose(data);
    H5Sclose(space), H5Tclose(type);
  }

  void put_text(const std::string& object, const char* name, const std::string& value) {
    const hid_t at = H5Oopen(file_, object.c_str(), H5P_DEFAULT);
    if (at < 0) return;
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, std::max<std::size_t>(1, value.size()));
    const hid_t made = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    if (made >= 0) H5Awrite(made, type, value.data()), H5Aclose(made);
    H5Sclose(space), H5Tclose(type), H5Oclose(at);
  }

  SpoiltObjects spoilt_;
  std::size_t objects_ = 0;
  std::set<double> written_;
  hid_t file_;
};

/// Puts other numbers into a file: of the fuzzer's bytes two choose where, one what.
inline void replace_numbers(Image& image, Choices& choices) {
  static constexpr double odd[] = {std::numeric_limits<double>::quiet_NaN(),
                                   INFINITY,
                                   -INFINITY,
                                   -1.0,
                                   0.0,
                                   1e300,
                                   -1e300,
                                   1e-300,
                                   1e9,
                                   4294967296.0,
                                   9007199254740993.0,
                                   -0.5,
                                   5e-324,
                                   1.0,
                                   2.0,
                                   3.0};
  for (int k = 0; k < 16 && choices.left() >= 3 && !image.numbers.empty(); ++k) {
    const std::size_t at = image.numbers[choices.below(image.numbers.size())];
    const std::uint8_t what = choices.byte();
    double number = odd[what % std::size(odd)];
    if (what >= 128) {
      std::memcpy(&number, image.bytes.data() + at, sizeof number);
      number *= what >= 192 ? std::ldexp(1.0, what - 224) : what - 160.0;
    }
    std::memcpy(image.bytes.data() + at, &number, sizeof number);
  }
}

}  // namespace grainpair::fuzz
