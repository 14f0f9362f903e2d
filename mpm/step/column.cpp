#include "mpm/step/column.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>

#include "cases/rates.hpp"
#include "mpm/step/solver.hpp"

namespace grainpair {
namespace {

/// Gives the points the packing's mass, shared among those of each of its cells, and its stress;
/// void ratios follow from mass and volume. Throws CaseError where grains would be left without a
/// point.
template <int dim>
void start_from(const Packing& packing, const Case& scene, double volume, Points<dim>& points,
                std::vector<InitialState>& initial, const Ranks& ranks) {
  std::vector<std::size_t> count(packing.cells(), 0), cell(points.size());
  for (std::size_t p = 0; p < points.size(); ++p)
    ++count[cell[p] = packing.cell_of(points.x[p][0], points.x[p][1])];
  ranks.sum(std::span(count));
  for (std::size_t c = 0; c < count.size(); ++c)
    if ((count[c] == 0) != (packing.mass(c) == 0.0))
      throw CaseError(fmt::format(
          "{}: initial.state: a cell of the packing in {} holds {} points and {:.3g} kg of grains "
          "(mass would be lost or a point empty) use as many points as cells at least, and a "
          "packing of this case",
          scene.path(), packing.path(), count[c], packing.mass(c)));
  for (std::size_t p = 0; p < points.size(); ++p) {
    points.mass[p] = packing.mass(cell[p]) / static_cast<double>(count[cell[p]]);
    points.void_ratio[p] = initial[p].void_ratio =
        scene.number("grains.density") * volume / points.mass[p] - 1.0;
    initial[p].sigma = packing.stress(points.x[p][0], points.x[p][1]);
  }
}

/// Of the base [rad].
double slope(const Case& scene) {
  return scene.chute() ? scene.number("geometry.inclination") * std::numbers::pi / 180.0 : 0.0;
}

/// The part of gravity along -y [m/s2].
double normal_gravity(const Case& scene) {
  const double g = scene.number("geometry.gravity");
  return scene.chute() ? g * std::cos(slope(scene)) : g;
}

/// The place nearest to x that is half-way between two nodes [m].
double between_nodes(double x, double h) { return h * (std::round(x / h + 0.5) - 0.5); }

/// y of the bottom on which the column stands: the base, or the bottom of a silo [m].
double bottom(const Case& scene, double h) {
  return scene.silo() ? between_nodes(scene.number("geometry.fall"), h) : 0.0;
}

template <int dim>
SolverSetup<dim> setup_of(const Case& scene, const Numerics& numerics) {
  const double H = scene.number("geometry.height"), L = scene.number("geometry.length");
  const double W = scene.number("geometry.thickness"), h = numerics.h;
  SolverSetup<dim> setup;
  // room above the column for points thrown up; a point that leaves ends the run and says so
  const std::array<double, 3> extent{scene.chute() ? L : scene.number("geometry.floor_length"),
                                     bottom(scene, h) + 1.5 * H + 4.0 * h, W};
  for (int d = 0; d < dim; ++d)
    setup.cells[d] = static_cast<int>(std::ceil(extent[static_cast<std::size_t>(d)] / h - 1e-9));
  if (dim == 3 && std::abs(setup.cells[dim - 1] * h - W) > 1e-9 * W)
    throw CaseError(fmt::format(
        "{}: geometry.thickness {} m is not a whole number of cells of {} m (the front and back "
        "rollers are faces of the grid) choose mpm.cell_size to divide it",
        scene.path(), W, h));
  setup.point_size = h / static_cast<double>(scene.integer("mpm.points_per_cell"));
  setup.solid_density = scene.number("grains.density");
  setup.gravity.setZero();
  setup.gravity[1] = -normal_gravity(scene);
  if (scene.chute()) {
    setup.gravity[0] = scene.number("geometry.gravity") * std::sin(slope(scene));
    setup.period.cells = setup.cells[0];
    setup.cells[0] = setup.period.all_cells();
  }
  setup.numerics = numerics;
  setup.walls[0][0] = scene.word("walls.left") == "smooth"
                          ? Wall{Contact::roller}
                          : Wall{Contact::coulomb, scene.number("walls.left_friction")};
  setup.walls[1][0] = scene.word("walls.base") == "glued"
                          ? Wall{Contact::fixed}
                          : Wall{Contact::coulomb, scene.number("walls.base_friction")};
  setup.axisymmetric = scene.word("geometry.dimension") == "axisymmetric";
  if (scene.word("geometry.dimension") == "plane_strain") setup.thickness = W;
  if (scene.word("walls.gate") == "lifted")
    setup.gate = {L, scene.number("walls.gate_speed"), true};
  if (scene.silo()) {
    const double top = bottom(scene, h);
    setup.gate = {L, 0.0, true, top};
    const double begin = between_nodes(scene.number("geometry.orifice"), h);
    setup.shelf = {begin, top, h, {Contact::coulomb, scene.number("walls.base_friction")}, true};
  }
  return setup;
}

/// Where the points stand at the start.
struct Lattice {
  std::array<int, 3> count{1, 1, 1};
  std::array<double, 3> pitch;  // [m]
  double foot = 0.0;            // y that it stands on [m]

  std::size_t points() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
           static_cast<std::size_t>(count[2]);
  }
};

/// Whole numbers of points fill the column [0, L] x [0, H] (x [0, W]) above its foot exactly, as
/// near to the asked density as that allows.
template <int dim>
Lattice lattice_of(const Case& scene, const Numerics& numerics) {
  const double spacing = numerics.h / static_cast<double>(scene.integer("mpm.points_per_cell"));
  Lattice out;
  out.foot = bottom(scene, numerics.h);
  out.pitch = {scene.number("geometry.length"), scene.number("geometry.height"),
               scene.number("geometry.thickness")};
  for (std::size_t d = 0; d < dim; ++d) {
    out.count[d] = std::max(1, static_cast<int>(std::lround(out.pitch[d] / spacing)));
    out.pitch[d] /= out.count[d];
  }
  return out;
}

/// A rank's points on the lattice, as many of its columns as others have, and the K0 stress under
/// their own weight: sigma_yy = rho_s g (H - y)/(1 + e0), sigma_xx = sigma_zz = K0 sigma_yy; or
/// from a settled packing.
template <int dim>
Points<dim> points_of(const Case& scene, const Lattice& lattice, const Start& start,
                      bool axisymmetric, std::vector<InitialState>& initial, const Ranks& ranks) {
  const double H = scene.number("geometry.height"), g = normal_gravity(scene);
  const double rho_s = scene.number("grains.density"), e0 = scene.number("initial.void_ratio");
  const auto& [count, pitch, foot] = lattice;
  Points<dim> points;
  const auto column = lattice.points() / static_cast<std::size_t>(count[0]);
  const int begin = count[0] * ranks.here() / ranks.count();
  const int end = count[0] * (ranks.here() + 1) / ranks.count();
  const auto n = static_cast<std::size_t>(end - begin) * column;
  points.resize(n);
  initial.resize(n);
  std::mt19937_64 random(start.seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double jitter = scene.number("mpm.jitter");
  const double K0 = scene.number("initial.lateral_stress_ratio");
  const double temperature = scene.number("initial.granular_temperature");
  const double velocity = scene.number("initial.velocity");
  random.discard(static_cast<std::size_t>(begin) * column * dim);  // of the columns before
  const std::size_t before = static_cast<std::size_t>(begin) * column;
  std::size_t p = 0;
  for (int i = begin; i < end; ++i)
    for (int j = 0; j < count[1]; ++j)
      for (int k = 0; k < count[2]; ++k, ++p) {
        const std::array<int, 3> index{i, j, k};
        for (std::size_t d = 0; d < dim; ++d)
          points.x[p][static_cast<int>(d)] =
              pitch[d] * (index[d] + 0.5 + 0.5 * jitter * unit(random));
        // a ring of radius x in an axisymmetric column: the whole circle, not a slab
        const double depth = axisymmetric ? 2.0 * std::numbers::pi * points.x[p][0] : pitch[2];
        points.mass[p] = rho_s / (1.0 + e0) * pitch[0] * pitch[1] * depth;
        points.void_ratio[p] = e0;
        points.id[p] = static_cast<std::uint32_t>(before + p);
        const double sigma_v = rho_s * g / (1.0 + e0) * (H - points.x[p][1]);
        points.v[p][0] = 2.0 * velocity * points.x[p][1] / H;
        points.x[p][1] += foot;
        initial[p] = {SymTensor{K0 * sigma_v, sigma_v, K0 * sigma_v, 0.0, 0.0, 0.0}, e0,
                      temperature};
      }
  if (start.packing)
    start_from(*start.packing, scene, pitch[0] * pitch[1] * pitch[2], points, initial, ranks);
  return points;
}

template <int dim>
std::unique_ptr<TransferKernel<dim>> kernel_of(const Case& scene, const SolverSetup<dim>& setup) {
  const std::string& shape = scene.word("mpm.shape");
  const bool exact = scene.word("mpm.precision") == "double";
  const auto make = shape == "linear"          ? make_transfer_kernel<dim, BSpline<1>, Wide>
                    : shape == "gimp"          ? make_transfer_kernel<dim, Gimp, Wide>
                    : shape == "cubic_bspline" ? make_transfer_kernel<dim, BSpline<3>, Wide>
                    : exact                    ? make_transfer_kernel<dim, BSpline<2>, Wide>
                                               : make_transfer_kernel<dim, BSpline<2>, WideFloat>;
  return make(setup.cells, setup.numerics.h, setup.point_size);
}

template <int dim>
std::unique_ptr<Simulation> column(const Case& scene, const SolverSetup<dim>& setup,
                                   const Lattice& lattice, const Start& start) {
  std::vector<InitialState> initial;
  auto points = points_of<dim>(scene, lattice, start, setup.axisymmetric, initial, *setup.ranks);
  return std::make_unique<Solver<dim>>(setup, kernel_of<dim>(scene, setup), std::move(points),
                                       material_registry().at(scene.word("material.law"))(scene),
                                       initial);
}

}  // namespace

template <int dim>
std::unique_ptr<Simulation> make_column(const Case& scene, const Numerics& numerics,
                                        const Start& start, const Ranks& ranks) {
  auto setup = setup_of<dim>(scene, numerics);
  setup.ranks = &ranks;
  return column<dim>(scene, setup, lattice_of<dim>(scene, numerics), start);
}

template <int dim>
Cost cost_of_column(const Case& scene, const Numerics& numerics) {
  const auto setup = setup_of<dim>(scene, numerics);
  const Lattice lattice = lattice_of<dim>(scene, numerics);
  Cost out;
  out.points = lattice.points();
  const auto kernel = kernel_of<dim>(scene, setup);
  out.nodes = 1;
  for (const GridAxis& axis : kernel->axes()) out.nodes *= static_cast<std::size_t>(axis.nodes);
  const auto per_node = sizeof(Node<dim>) + (kernel->single ? sizeof(FloatNode<dim>) : 0);
  out.bytes =
      measured("continuum.bytes") +
      measured(dim == 2 ? "continuum.bytes_per_point.plane" : "continuum.bytes_per_point.space") *
          static_cast<double>(out.points) +
      static_cast<double>(per_node * out.nodes);
  // The column's foot alone, whose points bear all that stands on them and so are the stiffest.
  constexpr int high = 16, wide = 8;
  auto foot = setup;
  for (int d = setup.period ? 1 : 0; d < dim; ++d)  // a period stays whole
    foot.cells[d] = std::min(setup.cells[d], d == 1 ? high : wide);
  foot.gate = {}, foot.shelf = {};
  Lattice line = lattice;
  line.count = {1, std::min(lattice.count[1], high / 2), 1}, line.foot = 0.0;
  out.time_step = column<dim>(scene, foot, line, {})->stable_step().dt;
  return out;
}

template Cost cost_of_column<2>(const Case&, const Numerics&);
template Cost cost_of_column<3>(const Case&, const Numerics&);
template std::unique_ptr<Simulation> make_column<2>(const Case&, const Numerics&, const Start&,
                                                    const Ranks&);
template std::unique_ptr<Simulation> make_column<3>(const Case&, const Numerics&, const Start&,
                                                    const Ranks&);

}  // namespace grainpair
