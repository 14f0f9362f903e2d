#include "compare/mapping/h5_file.hpp"

#include <isa-l/igzip_lib.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace grainpair {
namespace {

using hdf5::Error, hdf5::Handle;

constexpr double most = 9007199254740992.0;  // 2^53

Handle own(hid_t id, herr_t (*close)(hid_t), const std::string& otherwise) {
  if (id < 0) throw Error(otherwise);
  return {id, close, ""};
}

/// The values in `outer` pieces, each filled up with NaN to `length` of them: first bytes of all,
/// then second ones, as HDF5's shuffle filter has them.
template <class Real>
std::vector<unsigned char> shuffled(std::span<const double> values, std::size_t outer,
                                    std::size_t inner, std::size_t length) {
  const std::size_t n = outer * length;
  std::vector<Real> stored(n, std::numeric_limits<Real>::quiet_NaN());
  for (std::size_t o = 0; o < outer; ++o)
    for (std::size_t i = 0; i < inner; ++i)
      stored[o * length + i] = static_cast<Real>(values[o * inner + i]);
  std::vector<unsigned char> out(n * sizeof(Real));
  const auto* const from = reinterpret_cast<const unsigned char*>(stored.data());
  for (std::size_t b = 0; b < sizeof(Real); ++b)
    for (std::size_t i = 0; i < n; ++i) out[b * n + i] = from[i * sizeof(Real) + b];
  return out;
}

/// As HDF5's deflate filter has it: zlib's format.
std::vector<unsigned char> deflated(std::vector<unsigned char> plain) {
  constexpr std::size_t slack = 4096;  // headers, and of what cannot be made smaller
  std::vector<unsigned char> out(plain.size() + plain.size() / 256 + slack),
      room(ISAL_DEF_LVL1_DEFAULT);
  isal_zstream stream;
  isal_deflate_stateless_init(&stream);
  stream.gzip_flag = IGZIP_ZLIB, stream.end_of_stream = 1;
  stream.level = 1, stream.level_buf = room.data();
  stream.level_buf_size = static_cast<std::uint32_t>(room.size());
  stream.next_in = plain.data(), stream.avail_in = static_cast<std::uint32_t>(plain.size());
  stream.next_out = out.data(), stream.avail_out = static_cast<std::uint32_t>(out.size());
  if (isal_deflate_stateless(&stream) != COMP_OK) throw Error("a block could not be compressed");
  out.resize(stream.total_out);
  return out;
}

Handle dataspace(const std::vector<hsize_t>& shape) {
  return own(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose,
             "no dataspace");
}

void check(herr_t status, const std::string& what) {
  if (status < 0) throw Error(what);
}

}  // namespace

H5File::H5File(std::string path, Handle file) : path_(std::move(path)), file_(std::move(file)) {}

H5File H5File::open(const std::string& path) { return {path, hdf5::open_file(path)}; }

H5File H5File::create(const std::string& path) {
  hdf5::begin();
  return {path, own(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose,
                    path + ": cannot be written")};
}

Handle H5File::object(const std::string& name) const {
  return own(H5Oopen(file_, name.c_str(), H5P_DEFAULT), H5Oclose, where(name) + ": missing");
}

bool H5File::has(const std::string& name) const {
  if (name.empty() || name == "/" || name == there_) return true;
  const std::size_t last = name.rfind('/');
  const std::string parent = last == std::string::npos ? "" : name.substr(0, last);
  if (!has(parent)) return false;
  there_ = parent;
  return H5Lexists(file_, name.c_str(), H5P_DEFAULT) > 0;
}

std::vector<std::string> H5File::members(const std::string& group) const {
  const Handle g = object(group);
  H5G_info_t info;
  check(H5Gget_info(g, &info), where(group) + ": not a group");
  std::vector<std::string> names;
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    const auto length =
        H5Lget_name_by_idx(g, ".", H5_INDEX_NAME, H5_ITER_INC, i, nullptr, 0, H5P_DEFAULT);
    std::string name(static_cast<std::size_t>(std::max<ssize_t>(length, 0)), '\0');
    H5Lget_name_by_idx(g, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size() + 1,
                       H5P_DEFAULT);
    names.push_back(std::move(name));
  }
  return names;
}

bool H5File::stored(const std::string& name) const {
  const Handle found = object(name);
  return H5Iget_type(found) == H5I_DATASET;
}

std::size_t H5File::length(const std::string& name) const { return length(name, object(name)); }

std::size_t H5File::length(const std::string& name, const Handle& found) const {
  if (H5Iget_type(found) != H5I_DATASET) {
    const double n = number(name, "shape");
    if (!(n >= 0.0 && n < most && n == std::floor(n)))
      throw Error(where(name) + "@shape: no number of entries");
    return static_cast<std::size_t>(n);
  }
  const Handle type = own(H5Dget_type(found), H5Tclose, where(name) + ": no type");
  const auto kind = H5Tget_class(type);
  if (kind != H5T_FLOAT && kind != H5T_INTEGER) throw Error(where(name) + ": not numbers");
  const Handle space = own(H5Dget_space(found), H5Sclose, where(name) + ": no dataspace");
  if (H5Sget_simple_extent_ndims(space) != 1) throw Error(where(name) + ": not one-dimensional");
  const auto n = static_cast<double>(H5Sget_simple_extent_npoints(space));
  hdf5::check_room(found, type, n, where(name));
  return static_cast<std::size_t>(n);
}

std::vector<double> H5File::read(const std::string& name, std::size_t expected) const {
  const Handle found = object(name);
  const std::size_t n = length(name, found);
  if (n != expected)
    throw Error(where(name) + ": " + std::to_string(n) + " entries where the others have " +
                std::to_string(expected));
  std::vector<double> values(n);
  if (H5Iget_type(found) != H5I_DATASET)
    std::fill(values.begin(), values.end(), number(name, "value"));
  else
    check(H5Dread(found, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
          where(name) + ": unreadable");
  const auto bad =
      std::find_if_not(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
  if (bad != values.end())
    throw Error(where(name) + ": entry " + std::to_string(bad - values.begin()) +
                " is not a number");
  return values;
}

bool H5File::has_attribute(const std::string& name, const std::string& attribute) const {
  return has(name) && H5Aexists_by_name(file_, name.c_str(), attribute.c_str(), H5P_DEFAULT) > 0;
}

Handle H5File::attribute(const std::string& name, const std::string& attribute,
                         std::size_t expected) const {
  const std::string at = where(name) + "@" + attribute;
  Handle a = own(H5Aopen_by_name(file_, name.c_str(), attribute.c_str(), H5P_DEFAULT, H5P_DEFAULT),
                 H5Aclose, at + ": missing attribute");
  const Handle space = own(H5Aget_space(a), H5Sclose, at + ": no dataspace");
  if (H5Sget_simple_extent_npoints(space) != static_cast<hssize_t>(expected))
    throw Error(
        at + (expected == 1 ? ": not one value" : ": not " + std::to_string(expected) + " values"));
  return a;
}

double H5File::number(const std::string& name, const std::string& attribute) const {
  return numbers(name, attribute, 1).front();
}

std::vector<double> H5File::numbers(const std::string& name, const std::string& attribute,
                                    std::size_t expected) const {
  const Handle a = this->attribute(name, attribute, expected);
  std::vector<double> values(expected);
  check(H5Aread(a, H5T_NATIVE_DOUBLE, values.data()),
        where(name) + "@" + attribute + ": not a number");
  return values;
}

std::string H5File::text(const std::string& name, const std::string& attribute) const {
  const std::string at = where(name) + "@" + attribute;
  const Handle a = this->attribute(name, attribute, 1);
  const Handle type = own(H5Aget_type(a), H5Tclose, at + ": no type");
  if (H5Tget_class(type) != H5T_STRING) throw Error(at + ": not a text");
  if (H5Tis_variable_str(type) > 0) {
    char* value = nullptr;
    const Handle memory = own(H5Tcopy(H5T_C_S1), H5Tclose, at + ": no type");
    H5Tset_size(memory, H5T_VARIABLE);
    H5Tset_cset(memory, H5Tget_cset(type));
    check(H5Aread(a, memory, &value), at + ": unreadable");
    std::string out = value ? value : "";
    H5free_memory(value);
    return out;
  }
  std::string out(H5Tget_size(type), '\0');
  check(H5Aread(a, type, out.data()), at + ": unreadable");
  out.resize(std::min(out.size(), out.find('\0')));
  return out;
}

void H5File::make_group(const std::string& group) {
  const Handle made = own(H5Gcreate2(file_, group.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                          H5Gclose, where(group) + ": cannot make group");
}

void H5File::write(const std::string& name, std::span<const double> values,
                   const std::vector<hsize_t>& shape) {
  const Handle space = dataspace(shape);
  const Handle data = own(H5Dcreate2(file_, name.c_str(), H5T_NATIVE_DOUBLE, space, H5P_DEFAULT,
                                     H5P_DEFAULT, H5P_DEFAULT),
                          H5Dclose, where(name) + ": cannot make dataset");
  check(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
        where(name) + ": not written");
}

void H5File::make_series(const std::string& name, hsize_t frames, const std::vector<hsize_t>& shape,
                         const std::vector<hsize_t>& block, bool exact) {
  std::vector<hsize_t> all{frames}, chunk{1};
  all.insert(all.end(), shape.begin(), shape.end());
  chunk.insert(chunk.end(), block.begin(), block.end());
  const Handle space = dataspace(all);
  const Handle plist = own(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "no property list");
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  H5Pset_fill_value(plist, H5T_NATIVE_DOUBLE, &nothing);
  H5Pset_chunk(plist, static_cast<int>(chunk.size()), chunk.data());
  H5Pset_shuffle(plist);
  H5Pset_deflate(plist, 1);
  const Handle data =
      own(H5Dcreate2(file_, name.c_str(), exact ? H5T_NATIVE_DOUBLE : H5T_NATIVE_FLOAT, space,
                     H5P_DEFAULT, plist, H5P_DEFAULT),
          H5Dclose, where(name) + ": cannot make dataset");
}

PackedBlock::PackedBlock(std::span<const double> values, const std::vector<hsize_t>& count,
                         const std::vector<hsize_t>& block, bool exact) {
  std::size_t outer = 1, inner = 1, wanted = 1, given = 1;  // values before and after that axis
  for (std::size_t a = 0; a < block.size(); ++a) {
    (wanted == given && count[a] == block[a] ? outer : inner) *= count[a];
    wanted *= block[a], given *= count[a];
  }
  bytes = exact ? deflated(shuffled<double>(values, outer, inner, wanted / outer))
                : deflated(shuffled<float>(values, outer, inner, wanted / outer));
}

void H5File::write_block(const std::string& name, hsize_t frame, const std::vector<hsize_t>& start,
                         const PackedBlock& block) {
  const Handle data =
      own(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose, where(name) + ": missing dataset");
  std::vector<hsize_t> from{frame};
  from.insert(from.end(), start.begin(), start.end());
  check(H5Dwrite_chunk(data, H5P_DEFAULT, 0, from.data(), block.bytes.size(), block.bytes.data()),
        where(name) + ": not written");
}

void H5File::set(const std::string& name, const std::string& attribute, const std::string& text) {
  hdf5::write_attribute(object(name), attribute, text);
}

void H5File::set(const std::string& name, const std::string& attribute, double number) {
  hdf5::write_attribute(object(name), attribute, number);
}

}  // namespace grainpair
