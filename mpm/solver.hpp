// The material point method: one explicit step, read from top to bottom in Solver::step().
//
// Points are kept in cell order and cut into strips of columns of cells; strips of one parity never touch the same
// node, so two sweeps scatter without atomics, and sums are taken strip by strip: results do not depend on the
// number of threads, to the last bit.
#pragma once

#include <fmt/format.h>

#include <cstring>
#include <numeric>
#include <stdexcept>

#include "mpm/body.hpp"
#include "mpm/grid.hpp"
#include "mpm/kinematics.hpp"
#include "mpm/ledger.hpp"
#include "mpm/points.hpp"
#include "mpm/transfer/transfer.hpp"
#include "mpm/walls.hpp"

namespace grainpair {

/// The run cannot go on; programs print it and exit with code 3.
struct SolverError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class StressUpdate { first, last, musl };
enum class VolumetricAveraging { none, cell, nodal };
enum class Limit { none = 0, elastic = 1, critical_state = 2, viscous = 3 };

struct Numerics {
  double h = 0.0;                                // cell size [m]
  TransferScheme transfer = TransferScheme::affine_flip;
  double relaxation_time = 0.0;                  // of flip and affine_flip, and ... [s]
  double gradient_relaxation_time = 0.0;         // ... of the gradient of affine_flip [s]
  double void_ratio_relaxation_time = 0.0;       // within cells; 0: none [s]
  int xpic_order = 2;
  StressUpdate stress_update = StressUpdate::last;
  VolumetricAveraging averaging = VolumetricAveraging::cell;
  double time_step_fraction = 0.5;
};

struct TimeStep {
  double dt = 0.0;  // [s]
  Limit limit = Limit::none;
  std::uint32_t point = 0;  // id of the point that limits
};

/// What output and driver see of a solver, whatever its dimension and shape functions.
class Simulation {
 public:
  virtual ~Simulation() = default;
  virtual TimeStep stable_step() const = 0;
  virtual void step(double dt) = 0;
  virtual double time() const = 0;
  virtual const EnergyLedger& ledger() const = 0;
  virtual std::size_t size() const = 0;
  virtual double solid_density() const = 0;  // [kg/m3]
  /// Position and velocity of point p, with zeros for the axes the grid lacks.
  virtual Vec3 position(std::size_t p) const = 0;
  virtual Vec3 velocity(std::size_t p) const = 0;
  virtual const Points<2>* plane() const { return nullptr; }
  virtual const Points<3>* space() const { return nullptr; }

  /// Calls f with the points, of either dimension.
  template <class F>
  void visit_points(F&& f) const {
    if (plane()) return f(*plane());
    f(*space());
  }
};

template <class Kinematics, class Shape>
class Solver final : public Simulation {
 public:
  static constexpr int dim = Kinematics::dimension;
  using Vec = Eigen::Matrix<double, dim, 1>;
  using Mat = Eigen::Matrix<double, dim, dim>;

  struct Setup {
    std::array<int, dim> cells;
    double point_size;     // [m]
    double solid_density;  // rho_s [kg/m3]
    Vec gravity;           // [m/s2]
    Walls<dim> walls;
    Gate gate;
    Numerics numerics;
  };

  /// Takes the points as they are (x, v, mass, void_ratio, id set) and lets the law initialise its state.
  Solver(const Setup& setup, Points<dim> points, std::unique_ptr<Body> body,
         const std::vector<InitialState>& initial)
      : setup_(setup), grid_(setup.cells, setup.numerics.h, setup.point_size), points_(std::move(points)),
        body_(std::move(body)), deformation_(points_.size()), displacement_(points_.size()),
        work_(points_.size()), step_energies_(points_.size()), scratch_(points_.size()), mixing_(points_.size()) {
    for (const double e : points_.void_ratio) loosest_mixed_ = std::max(loosest_mixed_, 2.0 * e);
    for (std::size_t p = 0; p < points_.size(); ++p)
      cell_volume_ = std::max(cell_volume_, volume(p) * std::pow(setup.numerics.h / setup.point_size, dim));
    body_->resize(points_.size());
    std::vector<Stability> stability(points_.size());
    body_->initialise(0, initial,
                      {deformation_, points_.sigma, step_energies_, work_, points_.granular_temperature, stability,
                       points_.regime});
    store_update(0, points_.size(), stability);
    bin_points();
    measure_held_energy();
    update_pressure_correction();
  }

  /// The algorithm. Each stage books the energy it moves.
  void step(double dt) override {
    if (drift_ + max_speed_ * dt > 0.9 * setup_.numerics.h) bin_points();
    clear_grid();
    if (setup_.numerics.stress_update == StressUpdate::first) {
      scatter<true, false>();                                // mass and momentum
      constrain(0.0);                                        // nodal velocity at the walls
      gather<false, true>(dt);
      update_stress(dt);
      clear_grid();
    }
    scatter<true, true>();                                   // mass, momentum, internal force
    accelerate(dt);                                          // momentum balance [Ceccato2019, Eq. 2]
    if (setup_.numerics.transfer == TransferScheme::xpic) sharpen_velocity();
    if (setup_.numerics.stress_update == StressUpdate::last) {
      gather<true, true>(dt);                                // v, B or C, and displacement of the points; grad v
    } else {
      gather<true, false>(dt);
    }
    if (setup_.numerics.stress_update == StressUpdate::musl) {
      clear_grid();
      scatter<true, false>();                                // the points' new momenta, where they were
      constrain(dt);
      gather<false, true>(dt);
    }
    move(dt);
    if (setup_.numerics.stress_update != StressUpdate::first) update_stress(dt);
    update_pressure_correction();
    time_ += dt;
  }

  TimeStep stable_step() const override;

  double time() const override { return time_; }
  const EnergyLedger& ledger() const override { return ledger_; }
  std::size_t size() const override { return points_.size(); }
  double solid_density() const override { return setup_.solid_density; }
  Vec3 position(std::size_t p) const override { return padded(points_.x[p]); }
  Vec3 velocity(std::size_t p) const override { return padded(points_.v[p]); }
  const Points<2>* plane() const override {
    if constexpr (dim == 2) return &points_;
    return nullptr;
  }
  const Points<3>* space() const override {
    if constexpr (dim == 3) return &points_;
    return nullptr;
  }
  const Grid<dim, Shape>& grid() const { return grid_; }
  Points<dim>& points() { return points_; }

 private:
  friend struct SolverStages;  // times the stages one by one
  static constexpr int strip_width = 5;  // cells; supports reach at most 3 cells beyond, drift one more
  using AxisWeights = std::array<Weights<Shape::support>, dim>;

  struct Strip {
    std::size_t begin, end;  // points
  };
  /// Fraction of the way to the grid's velocity, and to its gradient, that a point goes in one step.
  struct Filter {
    double velocity, gradient;
  };
  /// Sums a sweep makes, kept by strip so that their order never changes.
  struct Sums {
    double kinetic_before = 0.0, kinetic_after = 0.0, potential = 0.0, speed = 0.0;
    double stored = 0.0, fluctuation = 0.0, plastic = 0.0, collisional = 0.0, detached = 0.0, mixing = 0.0;
    std::ptrdiff_t escaped = -1;
  };

  void bin_points();
  void clear_grid();
  template <bool Momentum, bool Force>
  void scatter();
  template <bool Momentum, bool Force, Affine Carried>
  void scatter_strip(const Strip& strip);
  void accelerate(double dt);
  void constrain(double time_offset);
  void sharpen_velocity();
  template <bool Velocity, bool Gradient>
  void gather(double dt);
  template <bool Velocity, bool Gradient, Affine Carried>
  Sums gather_strip(const Strip& strip, const Filter& filter, double dt);
  void average_volumetric_rate();
  void mix_void_ratios(double dt);
  void move(double dt);
  void update_stress(double dt);
  void update_pressure_correction();
  void average_over_cells(std::vector<double>& field);
  void average_over_nodes(std::vector<double>& field);
  void average(std::vector<double>& field);
  void measure_held_energy();
  void store_update(std::size_t begin, std::size_t end, const std::vector<Stability>& stability);

  Vec constrained(Vec v, const std::array<int, dim>& node, double time) const;
  double volume(std::size_t p) const { return points_.mass[p] * (1.0 + points_.void_ratio[p]) / setup_.solid_density; }
  /// Void ratio at which a point fills its cell. A detached point sees no neighbours to keep det F from growing, and its
  /// volume multiplies whatever stress it is left with; yet it cannot stand for more than the cell it lies in.
  double loosest_void_ratio(std::size_t p) const {
    const double h = setup_.numerics.h;
    const double cell = Kinematics::axisymmetric ? 2.0 * std::numbers::pi * points_.x[p][0] * h * h : cell_volume_;
    return cell * setup_.solid_density / points_.mass[p] - 1.0;
  }
  AxisWeights weights(std::size_t p) const {
    AxisWeights out;
    for (int d = 0; d < dim; ++d) out[d] = Shape::evaluate(grid_.axes[d], points_.x[p][d]);
    return out;
  }
  static Vec3 padded(const Vec& a) {
    Vec3 out = Vec3::Zero();
    out.template head<dim>() = a;
    return out;
  }
  static Lanes lanes(const Vec& a, double first = 0.0) {
    Lanes out = Lanes{};
    out[0] = first;
    for (int d = 0; d < dim; ++d) out[d + 1] = a[d];
    return out;
  }
  static Vec unlanes(const Lanes& a) {
    Vec out;
    if constexpr (dim == 2) {  // stored whole: what is stored by parts and loaded whole waits for the cache
      const auto pair = __builtin_shufflevector(a, a, 1, 2);
      std::memcpy(out.data(), &pair, sizeof(pair));
      return out;
    }
    for (int d = 0; d < dim; ++d) out[d] = a[d + 1];
    return out;
  }

  /// f(std::integral_constant<Affine, ...>) for the kind of affine transfer the run uses.
  template <class F>
  void with_affine(F&& f) {
    switch (affine_of(setup_.numerics.transfer)) {
      case Affine::none: return f(std::integral_constant<Affine, Affine::none>{});
      case Affine::moment: return f(std::integral_constant<Affine, Affine::moment>{});
      case Affine::gradient: return f(std::integral_constant<Affine, Affine::gradient>{});
    }
  }
  /// D_p of one axis: sum_k w_k (X_k - x_p)^2, kept away from zero [m2].
  double inertia(const Weights<Shape::support>& n) const {
    double sum = 0.0;
    for (int k = 0; k < Shape::support; ++k) sum += n.w[k] * n.xi[k] * n.xi[k];
    return std::max(sum, 1e-12 * setup_.numerics.h * setup_.numerics.h);
  }
  /// f(strip) over all strips; those that run at the same time share no node and no cell.
  template <class F>
  void for_each_strip(F&& f) {
    const int count = static_cast<int>(strips_.size());
    for (int parity = 0; parity < 2; ++parity) {
#pragma omp parallel for schedule(dynamic, 1)
      for (int s = parity; s < count; s += 2) f(static_cast<std::size_t>(s));
    }
  }
  /// f(node index, {i, j, k}) over the nodes points can reach, a column of the first axis at a time.
  template <class F>
  void for_each_active_column(F&& f) {
#pragma omp parallel for schedule(static)
    for (int i = active_begin_[0]; i < active_end_[0]; ++i) f(i);
  }
  template <class F>
  void for_each_node_of_column(int i, F&& f) {
    std::array<int, dim> node;
    node[0] = i;
    for (int j = active_begin_[1]; j < active_end_[1]; ++j) {
      node[1] = j;
      const auto row = static_cast<std::size_t>(i * grid_.stride[0] + j * grid_.stride[1]);
      if constexpr (dim == 2) {
        f(grid_.nodes[row], node);
      } else {
        for (int k = active_begin_[2]; k < active_end_[2]; ++k) {
          node[2] = k;
          f(grid_.nodes[row + static_cast<std::size_t>(k)], node);
        }
      }
    }
  }
  /// f(node, w_ip) over the nodes that share a point.
  template <class F>
  void for_each_weight(const AxisWeights& n, F&& f) {
    for (int i = 0; i < Shape::support; ++i) {
      Node* const plane = &grid_.nodes[static_cast<std::size_t>((n[0].first + i) * grid_.stride[0])];
      for (int j = 0; j < Shape::support; ++j) {
        Node* const row = plane + (n[1].first + j) * grid_.stride[1];
        const double w = n[0].w[i] * n[1].w[j];
        if constexpr (dim == 2) {
          f(*row, w);
        } else {
          for (int k = 0; k < Shape::support; ++k) f(row[n[2].first + k], w * n[2].w[k]);
        }
      }
    }
  }
  std::size_t cell_of(const Vec& x) const {
    std::size_t cell = 0;
    for (int d = 0; d < dim; ++d)
      cell = cell * static_cast<std::size_t>(setup_.cells[d]) + static_cast<std::size_t>(x[d] * grid_.axes[d].inverse_h);
    return cell;
  }

  /// The same within the box of cells that points can reach until the next sorting.
  std::size_t active_cell_of(const Vec& x) const {
    std::size_t cell = 0;
    for (int d = 0; d < dim; ++d)
      cell = cell * static_cast<std::size_t>(active_end_[d] - active_begin_[d]) +
             static_cast<std::size_t>(static_cast<int>(x[d] * grid_.axes[d].inverse_h) - active_begin_[d]);
    return cell;
  }

  Setup setup_;
  Grid<dim, Shape> grid_;
  Points<dim> points_;
  std::unique_ptr<Body> body_;
  std::vector<Deformation> deformation_;
  std::vector<Vec> displacement_;
  std::vector<double> work_;
  std::vector<Energies> step_energies_;
  std::vector<double> scratch_;
  std::vector<double> mixing_;       // volumetric strain rate that mixing gives a point, compression positive [1/s]
  double loosest_mixed_ = 0.0;       // void ratio [-]
  std::vector<double> cell_weight_, cell_value_;
  std::vector<Strip> strips_;
  std::array<int, dim> active_begin_{}, active_end_{};
  double cell_volume_ = 0.0;  // of plane strain and 3-D, over the thickness simulated [m3]
  double drift_ = 0.0, max_speed_ = 0.0;  // since the points were binned [m]; of the last step [m/s]
  double time_ = 0.0;
  EnergyLedger ledger_;
};

}  // namespace grainpair

#include "mpm/solver_stages.hpp"
