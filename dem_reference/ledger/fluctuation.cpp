#include "dem_reference/ledger/fluctuation.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace grainpair::ledger {

namespace {

constexpr double kCell = 3.0;          // side of the cells in x and y, in diameters
constexpr std::ptrdiff_t kFewest = 8;  // the fit of an affine field through fewer leaves too little
// Eigenvalues below this share of the largest are round-off: grains of a cell on one line.
constexpr double kSingular = 1e-15;

struct Grain {
  std::pair<std::int64_t, std::int64_t> cell;
  Eigen::Vector2d x;  // in diameters
  Vector v;
  double share;  // of the nominal mass
};

Grain grain_of(const Atoms& atoms, std::int64_t k, double diameter, bool radial) {
  Vector x = Eigen::Map<const Vector>(atoms.x + 3 * k),
         v = Eigen::Map<const Vector>(atoms.v + 3 * k);
  if (radial) {
    const double r = std::hypot(x.x(), x.z()), theta = std::atan2(x.z(), x.x());
    const double c = std::cos(theta), s = std::sin(theta);
    v = Vector(c * v.x() + s * v.z(), v.y(), c * v.z() - s * v.x());
    x.x() = r;
  }
  const auto cell = [&](double at) {
    return static_cast<std::int64_t>(std::floor(at / (kCell * diameter)));
  };
  const double size = atoms.radius ? 2 * atoms.radius[k] / diameter : 1.0;
  return {{cell(x.x()), cell(x.y())}, x.head<2>() / diameter, v, size * size * size};
}

/// Sum of m |v - (a + B x)|^2 over the grains of one cell, masses in the nominal one.
double squares(const Grain* begin, const Grain* end) {
  double whole = 0.0;
  Eigen::Vector2d mean_x = Eigen::Vector2d::Zero();
  Vector mean_v = Vector::Zero();
  for (const Grain* g = begin; g != end; ++g)
    whole += g->share, mean_x += g->share * g->x, mean_v += g->share * g->v;
  mean_x /= whole;
  mean_v /= whole;
  Eigen::Matrix2d gram = Eigen::Matrix2d::Zero();
  Eigen::Matrix<double, 2, 3> moment = Eigen::Matrix<double, 2, 3>::Zero();
  for (const Grain* g = begin; g != end; ++g) {
    const Eigen::Vector2d x = g->x - mean_x;
    gram += g->share * x * x.transpose();
    moment += g->share * x * (g->v - mean_v).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solved(gram);
  const Eigen::Vector2d& values = solved.eigenvalues();
  Eigen::Vector2d inverse = Eigen::Vector2d::Zero();
  for (int k = 0; k < 2; ++k)
    if (values[k] > kSingular * values[1]) inverse[k] = 1.0 / values[k];
  const Eigen::Matrix2d& axes = solved.eigenvectors();
  const Eigen::Matrix<double, 2, 3> gradient =
      axes * inverse.asDiagonal() * axes.transpose() * moment;
  double sum = 0.0;
  for (const Grain* g = begin; g != end; ++g)
    sum += g->share * (g->v - mean_v - gradient.transpose() * (g->x - mean_x)).squaredNorm();
  return sum;
}

}  // namespace

double fluctuation_energy(const Atoms& atoms, double diameter, double mass, bool radial) {
  std::vector<Grain> grains;
  for (std::int64_t k = 0; k < atoms.count; ++k)
    if (atoms.type[k] == kMobile) grains.push_back(grain_of(atoms, k, diameter, radial));
  std::stable_sort(grains.begin(), grains.end(),
                   [](const Grain& a, const Grain& b) { return a.cell < b.cell; });
  double sum = 0.0;
  for (auto begin = grains.begin(); begin != grains.end();) {
    const auto end = std::find_if(begin, grains.end(),
                                  [&](const Grain& other) { return other.cell != begin->cell; });
    const auto n = end - begin;
    if (n >= kFewest)
      sum += squares(&*begin, &*begin + n) * static_cast<double>(n) / static_cast<double>(n - 3);
    begin = end;
  }
  return mass / 2 * sum;
}

}  // namespace grainpair::ledger
