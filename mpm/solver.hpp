// The material point method: one explicit step, read from top to bottom in Solver::step().
//
// Points are kept in cell order and cut into strips of columns of cells; strips of one parity never touch the same
// node, so two sweeps scatter without atomics, and sums are taken strip by strip: results do not depend on the
// number of threads, to the last bit.
#pragma once

#include <fmt/format.h>
#include <omp.h>

#include <cstring>
#include <numeric>
#include <stdexcept>

#include "mpm/body.hpp"
#include "mpm/cell_means.hpp"
#include "mpm/grid.hpp"
#include "mpm/interpolation_plane.hpp"
#include "mpm/interpolation_space.hpp"
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
  bool conduction = false;                       // of granular temperature
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

/// Exchanged holds several points' numbers on their way to the nodes and back: Wide, or WideFloat in single precision.
template <class Kinematics, class Shape, class Exchanged = Wide>
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
        body_(std::move(body)), velocities_(halves == 1 ? 0 : grid_.nodes.size()), velocity_gradient_(points_.size()), hoop_(Kinematics::axisymmetric ? points_.size() : 0),
        displacement_(points_.size()), volumetric_rate_(points_.size()), pressure_(points_.size()),
        scratch_(points_.size()), cell_(points_.size()), specific_volume_(1.0 / setup.solid_density) {
    for (const double e : points_.void_ratio) loosest_mixed_ = std::max(loosest_mixed_, 2.0 * e);
    room_ = std::pow(std::max(1.0, 2.0 * setup.point_size / setup.numerics.h), dim);
    for (std::size_t p = 0; p < points_.size(); ++p)
      cell_volume_ = std::max(cell_volume_, volume(p) * std::pow(setup.numerics.h / setup.point_size, dim));
    body_->resize(points_.size());
    for_each_chunk({0, points_.size()}, [&](const Strip& chunk, Update& update) {
      body_->initialise(chunk.begin, std::span(initial).subspan(chunk.begin, update.batch.size), update.batch);
      Sums sum;
      book(chunk, 0.0, update, sum);
      if (sum.fastest.rate > fastest_.rate) fastest_ = sum.fastest;
    });
    bin_points();
    first_limit_ = stable_step().dt / setup_.numerics.time_step_fraction;  // before there is a speed to bound it
    measure_held_energy();
    for_each_strip([&](std::size_t s) { for_each_block(strips_[s], [&](const auto& block) { give_pressure(block, block.load(cell_)); }); });
    share_pressure();
  }

  /// The algorithm. Each stage books the energy it moves.
  void step(double dt) override {
    if (drift_ + max_speed_ * dt > 0.9 * setup_.numerics.h) bin_points();
    clear_grid();
    if (setup_.numerics.stress_update == StressUpdate::first) {
      scatter(Forces::without);                              // mass and momentum
      constrain(0.0);                                        // nodal velocity at the walls
      gather(Gathered::gradient, dt);
      update_stress(dt);
      clear_grid();
    }
    scatter(Forces::with);                                   // mass, momentum, internal force
    accelerate(dt);                                          // momentum balance [Ceccato2019, Eq. 2]
    if (setup_.numerics.transfer == TransferScheme::xpic) sharpen_velocity();
    if (setup_.numerics.stress_update == StressUpdate::last) {
      gather(Gathered::both, dt);                            // v, B or C, and displacement of the points; grad v
    } else {
      gather(Gathered::velocity, dt);
    }
    if (setup_.numerics.stress_update == StressUpdate::musl) {
      clear_grid();
      scatter(Forces::without);                              // the points' new momenta, where they were
      constrain(dt);
      gather(Gathered::gradient, dt);
    }
    if (setup_.numerics.stress_update != StressUpdate::first) update_stress(dt);
    time_ += dt;
    move();
    if (setup_.numerics.conduction) conduct(dt);
    share_pressure();
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
  static constexpr std::size_t halves = Halves<Exchanged>().size();
  static constexpr int strip_width = 5;  // cells; supports reach at most 3 cells beyond, drift one more
  template <class Real>
  using VecOf = VectorOf<dim, Real>;
  template <class Real>
  using MatOf = MatrixOf<dim, Real>;
  template <class Real>
  using GivenOf = Given<dim, Real>;
  template <class Real>
  using CollectedOf = Collected<dim, Real>;
  using Where = std::conditional_t<dim == 2, InPlane, InSpace>;
  enum class Forces { without, with };
  enum class Gathered { velocity, gradient, both };

  struct Strip {
    std::size_t begin, end;  // points
  };
  /// Fraction of the way to the grid's velocity, and to its gradient, that a point goes in one step.
  struct Filter {
    double velocity, gradient;
  };
  /// The point that allows the smallest step.
  struct Fastest {
    double rate = 0.0;  // 2/dt [1/s]
    Limit limit = Limit::none;
    std::uint32_t point = 0;  // its id
  };
  /// Sums a sweep makes, kept by strip so that their order never changes.
  struct Sums {
    double kinetic_before = 0.0, kinetic_after = 0.0, potential = 0.0, speed = 0.0;
    double stored = 0.0, fluctuation = 0.0, plastic = 0.0, collisional = 0.0, detached = 0.0, mixing = 0.0, gained = 0.0, conducted = 0.0;
    std::ptrdiff_t escaped = -1;
    Fastest fastest;
  };

  /// Points on their way through the law: few enough to stay in the cache meanwhile.
  struct Update {
    static constexpr std::size_t most = 64;
    Batch batch{most, false};
    std::vector<double> mixing = std::vector<double>(most);  // what mixing adds to the volumetric rate [1/s]
    std::vector<std::size_t> detached;  // points of the batch
  };

  void bin_points();
  void clear_grid();
  void scatter(Forces forces);
  template <Affine Carried>
  void scatter_strip(const Strip& strip, Forces forces);
  void accelerate(double dt);
  void constrain(double time_offset);
  void sharpen_velocity();
  void narrow_velocities();
  void gather(Gathered what, double dt);
  template <Affine Carried>
  Sums gather_strip(const Strip& strip, Gathered what, const Filter& filter, double dt);
  void move();
  void update_stress(double dt);
  void conduct(double dt);
  void share_pressure();
  void average_over_nodes(std::vector<double>& field);
  void measure_held_energy();
  void deform(const Strip& chunk, double dt, double mixing_rate, Update& update, Sums& sum);
  void book(const Strip& chunk, double dt, Update& update, Sums& sum);
  template <class B>
  void limit_step(const B& block, const StabilityOf<Wide>& of, Fastest& fastest) const;

  /// Fraction of the way that a step takes a relaxation of time tau; without one, none.
  static double relaxed(double dt, double tau) { return tau > 0.0 ? -std::expm1(-dt / tau) : 0.0; }
  /// Whether points take the mean volumetric rate or the mean void ratio of their cells.
  bool averages_rates() const {
    return setup_.numerics.averaging == VolumetricAveraging::cell || setup_.numerics.void_ratio_relaxation_time > 0.0;
  }
  /// Whether the internal force takes the mean pressure of a point's cell.
  bool averages_pressures() const { return setup_.numerics.averaging == VolumetricAveraging::cell; }
  template <class B>
  void give_pressure(const B& block, const Wide& cell) {
    if (!averages_pressures()) return;
    const Wide v = volume(block);
    pressures_.give(cell, {v, v * block.load(pressure_)});
  }

  Vec constrained(const Vec& v, const std::array<int, dim>& node, double time) const {
    bool free = !setup_.gate.present;
    for (int d = 0; d < dim; ++d) free = free && node[d] > 0 && node[d] < grid_.axes[d].nodes - 1;
    return free ? v : constrained_here(v, node, time);
  }
  Vec constrained_here(Vec v, const std::array<int, dim>& node, double time) const;
  template <class B>
  Wide volume(const B& block) const {
    return block.load_once(points_.mass) * (1.0 + block.load(points_.void_ratio)) * specific_volume_;
  }
  double volume(std::size_t p) const { return points_.mass[p] * (1.0 + points_.void_ratio[p]) * specific_volume_; }
  /// Void ratio at which a point fills its cell. A detached point sees no neighbours to keep det F from growing, and its
  /// volume multiplies whatever stress it is left with; yet it cannot stand for more than the cell it lies in. Points so
  /// few that they fill their cells from the start are still in contact until they have grown to twice their size.
  Wide loosest_void_ratio(const VecOf<Wide>& x, const Wide& mass) const {
    const double h = setup_.numerics.h;
    const Wide cell = Kinematics::axisymmetric ? Wide(2.0 * std::numbers::pi * h * h * x[0]) : Wide(cell_volume_);
    return room_ * cell * setup_.solid_density / mass - 1.0;
  }
  template <class Blocks>
  Neighbours<dim, Shape::support, Exchanged> neighbours(const Blocks& blocks) {
    Neighbours<dim, Shape::support, Exchanged> out;
    out.nodes = grid_.nodes.data();
    out.velocities = velocities();
    std::array<VecOf<Wide>, halves> x;
    for (std::size_t h = 0; h < halves; ++h) x[h] = points_.x.load(blocks[h]);
#pragma GCC unroll 3
    for (int d = 0; d < dim; ++d) {
      out.stride[d] = grid_.stride[d];
      if constexpr (halves == 1)
        Shape::evaluate(grid_.axes[d], x[0][d], out.n[d]);
      else
        Shape::evaluate(grid_.axes[d], {x[0][d], x[1][d]}, out.n[d]);
    }
    return out;
  }
  /// What points take of the nodes, in the precision they take it in.
  auto velocities() const {
    if constexpr (halves == 1)
      return grid_.nodes.data();
    else
      return velocities_.data();
  }
  static Vec3 padded(const Vec& a) {
    Vec3 out = Vec3::Zero();
    out.template head<dim>() = a;
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
  /// f(strip) over all strips; those that run at the same time share no node and no cell.
  template <class F>
  void for_each_strip(F&& f) {
    const int count = static_cast<int>(strips_.size());
    for (int parity = 0; parity < 2; ++parity)
      side_by_side(parity, count, 2, [&](int s) { f(static_cast<std::size_t>(s)); });
  }
  /// The same where f gives nothing to nodes or cells.
  template <class F>
  void for_each_strip_at_once(F&& f) {
    side_by_side(0, static_cast<int>(strips_.size()), 1, [&](int s) { f(static_cast<std::size_t>(s)); });
  }
  /// f(begin), f(begin + stride) ... below end, in any order; what one thread had, it gets again in the next sweep.
  /// OpenMP's team of one would enter the kernel in every sweep.
  template <class F>
  static void side_by_side(int begin, int end, int stride, F&& f) {
    if (omp_get_max_threads() == 1) {
      for (int i = begin; i < end; i += stride) f(i);
      return;
    }
#pragma omp parallel for schedule(static, 1)
    for (int i = begin; i < end; i += stride) f(i);
  }
  /// f(block) over the points of a strip.
  template <class F>
  static void for_each_block(const Strip& strip, F&& f) {
    grainpair::for_each_block(strip.begin, strip.end, f);
  }
  /// f(chunk, update) over the points of a strip.
  template <class F>
  static void for_each_chunk(const Strip& strip, F&& f) {
    thread_local Update update;
    for (std::size_t p = strip.begin; p < strip.end; p += Update::most) {
      const Strip chunk{p, std::min(p + Update::most, strip.end)};
      update.batch.size = chunk.end - chunk.begin;
      update.batch.in_plane = dim == 2;
      update.detached.clear();
      f(chunk, update);
    }
  }
  template <class F>
  void for_each_block_at_once(F&& f) {
    for_each_strip_at_once([&](std::size_t s) { for_each_block(strips_[s], f); });
  }
  template <class F>
  void for_each_point(F&& f) {
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) f(p);
    });
  }
  /// f(i) over the columns of nodes that points can reach.
  template <class F>
  void for_each_active_column(F&& f) {
    side_by_side(active_begin_[0], active_end_[0], 1, f);
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
  /// f(node, w_ip) or f(node, w_ip, grad w_ip) over the nodes that share point p.
  template <class F>
  void for_each_weight(std::size_t p, F&& f) {
    std::array<Weights<double, Shape::support>, dim> n;
    std::ptrdiff_t first = 0;
    for (int d = 0; d < dim; ++d) {
      Shape::evaluate(grid_.axes[d], points_.x[p][d], n[d]);
      first += static_cast<int>(n[d].first) * grid_.stride[d];
    }
    for (int i = 0; i < Shape::support; ++i) {
      for (int j = 0; j < Shape::support; ++j) {
        Node<dim>* const row = &grid_.nodes[static_cast<std::size_t>(first)] + i * grid_.stride[0] + j * grid_.stride[1];
        const auto give = [&](Node<dim>& node, double w, auto... gradient) {
          if constexpr (std::is_invocable_v<F, Node<dim>&, double, Vec>)
            f(node, w, Vec(gradient...));
          else
            f(node, w);
        };
        const double w = n[0].w[i] * n[1].w[j], dx = n[0].dw[i] * n[1].w[j], dy = n[0].w[i] * n[1].dw[j];
        if constexpr (dim == 2) {
          give(*row, w, dx, dy);
        } else {
          const auto& last = n[2];
          for (int k = 0; k < Shape::support; ++k)
            give(row[k], w * last.w[k], dx * last.w[k], dy * last.w[k], w * last.dw[k]);
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
  std::vector<FloatNode<dim>> velocities_;        // of the nodes, where points take them in single precision [m/s]
  Columns<MatOf> velocity_gradient_;             // [1/s]
  std::vector<double> hoop_;                      // v_r/r, where the run is axisymmetric [1/s]
  Columns<VecOf> displacement_;                   // [m]
  std::vector<double> volumetric_rate_;           // averaged over nodes, or not at all; compression positive [1/s]
  std::vector<double> pressure_;                  // of sigma alone [Pa]
  std::vector<double> scratch_;
  double loosest_mixed_ = 0.0;                    // void ratio [-]
  std::vector<double> cell_;                      // number of the one each point lies in, of the active box
  CellMeans rates_, pressures_;                   // volumetric rates and void ratios [1/s], [-]; pressures of sigma [Pa]
  std::vector<Strip> strips_;
  std::array<int, dim> active_begin_{}, active_end_{};
  double specific_volume_;    // of solid [m3/kg]
  double room_ = 1.0;         // of a point, in cells
  double cell_volume_ = 0.0;  // of plane strain and 3-D, over the thickness simulated [m3]
  double largest_wave_number_ = 2.0 * std::sqrt(static_cast<double>(dim)) / setup_.numerics.h;  // times 2/2 [1/m]
  Fastest fastest_;
  double first_limit_ = std::numeric_limits<double>::infinity();  // of the step, at the start [s]
  double drift_ = 0.0, max_speed_ = 0.0;  // since the points were binned [m]; of the last step [m/s]
  double time_ = 0.0;
  EnergyLedger ledger_;
};

}  // namespace grainpair

#include "mpm/solver_stages.hpp"
