// A rectangular block of material points in a box, for tests of the solver that need no case.
#pragma once

#include "cases/case.hpp"
#include "mpm/step/solver.hpp"

namespace grainpair::test {

/// That of the seed's column, with other values of some keys.
const Case& any_case(const std::vector<std::string>& keys = {});

/// A body of the law of inert.hpp: what is left is the transfer, the grid and the walls.
std::unique_ptr<Body> inert();

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
  std::unique_ptr<Body> body = inert();
  Period period = {};  // along x; the block's places are those within it, box[0] all its cells

  template <class Shape, class Exchanged = Wide>
  std::unique_ptr<Solver<dim>> build() {
    const double pitch = h / points_per_cell;
    const typename Shape::Axis axis(*std::max_element(box.begin(), box.end()) + 10, h, pitch);
    return build_with(make_transfer_kernel<dim, Shape, Exchanged>(box, h, pitch), [&](double x) {
      // interior weights: the box shifted away from its ends
      Weights<double, Shape::support> w;
      Shape::evaluate(axis, x + 5 * h, w);
      return w.inertia;
    });
  }

 private:
  /// inertia(x): of the functions along an axis, sum_i w_i (X_i - x)^2 [m2].
  std::unique_ptr<Solver<dim>> build_with(std::unique_ptr<TransferKernel<dim>> kernel,
                                          const std::function<double(double)>& inertia);
};

/// A law of the registry with constants for quick waves: c = 10 m/s at the block's density.
std::unique_ptr<Body> linear_elastic(double poisson_ratio);

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
