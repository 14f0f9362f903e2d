#include "tests/cpp/block.hpp"

#include <fmt/format.h>

#include "mpm/transfer/transfer.hpp"
#include "tests/cpp/inert.hpp"

namespace grainpair::test {

const Case& any_case(const std::vector<std::string>& keys) {
  static std::map<std::vector<std::string>, Case> cases;
  const auto found = cases.find(keys);
  if (found != cases.end()) return found->second;
  std::vector<std::string> sets{"mpm.stiffness=as given"};
  sets.insert(sets.end(), keys.begin(), keys.end());
  return cases.emplace(keys, Case::load(GRAINPAIR_SOURCE "/cases/column", sets)).first->second;
}

std::unique_ptr<Body> inert() { return std::make_unique<BodyOf<Inert>>(Inert(any_case())); }

std::unique_ptr<Body> linear_elastic(double poisson_ratio) {
  const double modulus = density * 100.0;  // P-wave modulus [Pa]
  const double young =
      modulus * (1 + poisson_ratio) * (1 - 2 * poisson_ratio) / (1 - poisson_ratio);
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/column",
                                {"material.law=linear_elastic", "mpm.stiffness=as given",
                                 fmt::format("material.young_modulus={:.17g}", young),
                                 fmt::format("material.poisson_ratio={:.17g}", poisson_ratio),
                                 fmt::format("grains.density={:.17g}", solid_density),
                                 fmt::format("initial.void_ratio={:.17g}", void_ratio)});
  return material_registry().at("linear_elastic")(scene);
}

template <class Kinematics>
auto Cuboid<Kinematics>::build_with(std::unique_ptr<TransferKernel<dim>> kernel,
                                    const std::function<double(double)>& inertia)
    -> std::unique_ptr<Solver<dim>> {
  const double pitch = h / points_per_cell;
  std::array<int, 3> n{1, 1, 1};
  for (std::size_t d = 0; d < dim; ++d) n[d] = (high[d] - low[d]) * points_per_cell;
  Points<dim> points;
  points.resize(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  std::vector<InitialState> initial;
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
        if (affine_of(numerics.transfer) == Affine::moment)  // B = C D with D that of each axis
          for (int d = 0; d < dim; ++d) points.affine[p].col(d) *= inertia(points.x[p][d]);
        points.mass[p] = density * std::pow(pitch, dim);
        points.void_ratio[p] = void_ratio;
        points.id[p] = static_cast<std::uint32_t>(p);
        initial.push_back({stress(points.x[p]), void_ratio, granular_temperature(points.x[p])});
      }
  numerics.h = h;
  return std::make_unique<Solver<dim>>(SolverSetup<dim>{box,
                                                        pitch,
                                                        solid_density,
                                                        gravity,
                                                        walls,
                                                        {},
                                                        Kinematics::axisymmetric,
                                                        numerics,
                                                        period},
                                       std::move(kernel), std::move(points), std::move(body),
                                       initial);
}

template struct Cuboid<PlaneStrain>;
template struct Cuboid<Axisymmetric>;
template struct Cuboid<ThreeDimensional>;

}  // namespace grainpair::test
