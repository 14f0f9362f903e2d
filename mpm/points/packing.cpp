#include "mpm/points/packing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cases/case.hpp"
#include "cases/hdf5.hpp"

namespace grainpair {

namespace {

/// Why these are no packing; empty where they are one.
std::string fault(const std::vector<double>& x, const std::vector<double>& y,
                  const std::vector<double>& mass, const std::vector<double>& void_ratio,
                  const std::vector<SymTensor>& stress) {
  const auto rises = [](const std::vector<double>& faces) {
    return faces.size() > 1 &&
           std::ranges::all_of(faces, [](double f) { return std::isfinite(f); }) &&
           std::ranges::adjacent_find(faces, std::greater_equal()) == faces.end();
  };
  if (!rises(x) || !rises(y)) return "the faces of its cells do not rise";
  const std::size_t cells = (x.size() - 1) * (y.size() - 1);
  if (mass.size() != cells || void_ratio.size() != cells || stress.size() != cells)
    return fmt::format("{} cells, but {} masses, {} void ratios and {} stresses", cells,
                       mass.size(), void_ratio.size(), stress.size());
  for (std::size_t i = 0; i < cells; ++i)
    if (!(mass[i] >= 0.0 && void_ratio[i] > 0.0 && mass[i] + void_ratio[i] < INFINITY &&
          stress[i].allFinite()))
      return fmt::format("cell {} has a mass, void ratio or stress that is none", i);
  return "";
}

}  // namespace

Packing::Packing(const std::string& path) : path_(path) {
  try {
    const hdf5::Handle file = hdf5::open_file(path);
    const auto read = [&](const std::string& name) {
      return hdf5::read_dataset<double>(file, "packing/profile_" + name);
    };
    x_ = read("x"), y_ = read("y"), mass_ = read("mass"), void_ratio_ = read("void_ratio");
    stress_.resize(mass_.size());
    constexpr const char* components[] = {"xx", "yy", "zz", "xy", "yz", "zx"};
    for (int c = 0; c < 6; ++c) {
      const auto values = read(std::string("stress_") + components[c]);
      if (values.size() != mass_.size())
        throw CaseError(fmt::format("{}: the packing has {} masses, but {} stresses {}", path,
                                    mass_.size(), values.size(), components[c]));
      for (std::size_t i = 0; i < values.size(); ++i)
        stress_[i][c] = c < 3 ? values[i] : std::numbers::sqrt2 * values[i];
    }
  } catch (const hdf5::Error& error) {
    throw CaseError(
        fmt::format("{}: no settled packing to start from ({}) give the result of a grain run of "
                    "this case, such as dem.h5",
                    path, error.what()));
  }
  if (const std::string why = fault(x_, y_, mass_, void_ratio_, stress_); !why.empty())
    throw CaseError(fmt::format("{}: no packing to start from ({})", path, why));
}

namespace {

/// The cell between `faces` that holds x; the first or last beyond them.
std::size_t between(const std::vector<double>& faces, double x) {
  const auto next = std::upper_bound(faces.begin() + 1, faces.end() - 1, x);
  return static_cast<std::size_t>(next - faces.begin()) - 1;
}

/// Neighbouring cells of x and how far x is from the first centre to the second, 0 to 1.
struct Neighbours {
  std::size_t first, second;
  double share;
};
Neighbours neighbours(const std::vector<double>& faces, double x) {
  const auto centre = [&](std::size_t i) { return 0.5 * (faces[i] + faces[i + 1]); };
  const std::size_t i = between(faces, x), last = faces.size() - 2;
  const std::size_t a = x < centre(i) && i > 0 ? i - 1 : i, b = std::min(a + 1, last);
  return {a, b, a == b ? 0.0 : std::clamp((x - centre(a)) / (centre(b) - centre(a)), 0.0, 1.0)};
}

}  // namespace

std::array<double, 3> Packing::extent(double grain_density) const {
  const double volume = mass_.at(0) * (1.0 + void_ratio_.at(0)) / grain_density;
  return {x_.back(), y_.back(), volume / ((x_[1] - x_[0]) * (y_[1] - y_[0]))};
}

std::size_t Packing::cell_of(double x, double y) const {
  return between(x_, x) * (y_.size() - 1) + between(y_, y);
}

SymTensor Packing::stress(double x, double y) const {
  const Neighbours i = neighbours(x_, x), j = neighbours(y_, y);
  const auto at = [&](std::size_t a, std::size_t b) -> const SymTensor& {
    return stress_[a * (y_.size() - 1) + b];
  };
  return (1.0 - i.share) *
             ((1.0 - j.share) * at(i.first, j.first) + j.share * at(i.first, j.second)) +
         i.share * ((1.0 - j.share) * at(i.second, j.first) + j.share * at(i.second, j.second));
}

}  // namespace grainpair
