// A rectangular block of material points in a box, for tests of the solver that need no case.
#pragma once

#include "cases/case.hpp"
#include "mpm/materials/body_of.hpp"
#include "mpm/step/solver.hpp"
#include "mpm/transfer/transfer.hpp"

namespace grainpair::test {

/// A law without stress: what is left is the transfer, the grid and the walls.
struct Inert : Athermal {
  template <class Real>
  struct State {
    Real none = 0.0;
  };
  explicit Inert(const Case&) {}
  Response<double, State> initial(const InitialState&) const { return respond<double>(); }
  template <class Real>
  Response<Real, State> update(const State<Real>&, const DeformationOf<Real>&) const {
    return respond<Real>();
  }
  template <class Real>
  StabilityOf<Real> stability(const State<Real>&, const Real&) const {
    return {1.0, 0.0};
  }

 private:
  template <class Real>
  static Response<Real, State> respond() {
    Response<Real, State> r;
    r.sigma = Tensor<Real>::Zero();
    return r;
  }
};

inline const Case& any_case(const std::vector<std::string>& keys = {}) {
  static std::map<std::vector<std::string>, Case> cases;
  const auto found = cases.find(keys);
  if (found != cases.end()) return found->second;
  return cases.emplace(keys, Case::load(GRAINPAIR_SOURCE "/cases/column", keys)).first->second;
}

/// Bulk density of the block, e0 = 1 [kg/m3].
inline constexpr double solid_density = 2000.0, void_ratio = 1.0, density = 1000.0;

/// One slice, no motion across it; stress is 3x3 all the same.
struct PlaneStrain {
  static constexpr int dimension = 2;
  static constexpr bool axisymmetric = false;
};

/// x is the radius; the hoop strain rate is v_r/r [1/s] and its stress pulls on the radial
/// momentum.
struct Axisymmetric {
  static constexpr int dimension = 2;
  static constexpr bool axisymmetric = true;
};

struct ThreeDimensional {
  static constexpr int dimension = 3;
  static constexpr bool axisymmetric = false;
};

/// What a block is made of; sizes in cells of size h.
template <class Kinematics>
struct Cuboid {
  static constexpr int dim = Kinematics::dimension;
  using Vec = Eigen::Matrix<double, dim, 1>;
  using Mat = Eigen::Matrix<double, dim, dim>;

  double h = 0.1;                       // [m]
  std::array<int, dim> box, low, high;  // grid, and the block in it, in cells
  int points_per_cell = 2;
  Vec gravity = Vec::Zero();
  Walls<dim> walls{};  // rollers
  Numerics numerics{};
  std::function<Vec(const Vec&)> velocity = [](const Vec&) { return Vec(Vec::Zero()); };
  Mat gradient = Mat::Zero();  // of the velocity, for the affine transfers [1/s]
  std::function<SymTensor(const Vec&)> stress = [](const Vec&) {
    return SymTensor(SymTensor::Zero());
  };
  std::function<double(const Vec&)> granular_temperature = [](const Vec&) { return 0.0; };
  std::unique_ptr<Body> body = std::make_unique<BodyOf<Inert>>(Inert(any_case()));

  template <class Shape, class Exchanged = Wide>
  std::unique_ptr<Solver<dim>> build() {
    const double pitch = h / points_per_cell;
    std::array<int, 3> n{1, 1, 1};
    for (std::size_t d = 0; d < dim; ++d) n[d] = (high[d] - low[d]) * points_per_cell;
    Points<dim> points;
    points.resize(static_cast<std::size_t>(n[0] * n[1] * n[2]));
    std::vector<InitialState> initial;
    const typename Shape::Axis axis(*std::max_element(box.begin(), box.end()) + 10, h, pitch);
    std::size_t p = 0;
    for (int i = 0; i < n[0]; ++i)
      for (int j = 0; j < n[1]; ++j)
        for (int k = 0; k < n[2]; ++k, ++p) {
          const std::array<int, 3> index{i, j, k};
          for (int d = 0; d < dim; ++d)
            points.x[p][d] = h * low[static_cast<std::size_t>(d)] +
                             pitch * (index[static_cast<std::size_t>(d)] + 0.5);
          points.v[p] = velocity(points.x[p]);
          points.affine[p] = gradient;
          if (affine_of(numerics.transfer) ==
              Affine::moment) {  // B = C D with D = sum_i w_i (X_i - x)^2 of each axis
            for (int d = 0; d < dim; ++d) {
              // interior weights: the box shifted away from its ends
              Weights<double, Shape::support> w;
              Shape::evaluate(axis, points.x[p][d] + 5 * h, w);
              points.affine[p].col(d) *= w.inertia;
            }
          }
          points.mass[p] = density * std::pow(pitch, dim);
          points.void_ratio[p] = void_ratio;
          points.id[p] = static_cast<std::uint32_t>(p);
          initial.push_back({stress(points.x[p]), void_ratio, granular_temperature(points.x[p])});
        }
    numerics.h = h;
    return std::make_unique<Solver<dim>>(
        SolverSetup<dim>{
            box, pitch, solid_density, gravity, walls, {}, Kinematics::axisymmetric, numerics},
        make_transfer_kernel<dim, Shape, Exchanged>(box, h, pitch), std::move(points),
        std::move(body), initial);
  }
};

/// A law of the registry with constants for quick waves: c = 10 m/s at the block's density.
inline std::unique_ptr<Body> linear_elastic(double poisson_ratio) {
  const double modulus = density * 100.0;  // P-wave modulus [Pa]
  const double young =
      modulus * (1 + poisson_ratio) * (1 - 2 * poisson_ratio) / (1 - poisson_ratio);
  const Case scene = Case::load(
      GRAINPAIR_SOURCE "/cases/column",
      {"material.law=linear_elastic", fmt::format("material.young_modulus={:.17g}", young),
       fmt::format("material.poisson_ratio={:.17g}", poisson_ratio),
       fmt::format("grains.density={:.17g}", solid_density),
       fmt::format("initial.void_ratio={:.17g}", void_ratio)});
  return material_registry().at("linear_elastic")(scene);
}

/// Angular momentum about the origin, affine moments included if asked: sum m (x v_y - y v_x + B_yx
/// - B_xy) [kg m2/s].
template <class Simulation>
double angular_momentum(const Simulation& s, bool moments) {
  double sum = 0.0;
  s.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied()) {
      const auto& x = points.x[p];
      const auto& v = points.v[p];
      sum += points.mass[p] * (x[0] * v[1] - x[1] * v[0] +
                               (moments ? points.affine[p](1, 0) - points.affine[p](0, 1) : 0.0));
    }
  });
  return sum;
}

}  // namespace grainpair::test
