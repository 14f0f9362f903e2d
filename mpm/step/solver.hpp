// The material point method: one explicit step, read from top to bottom in Solver::step().
//
// Points are kept in cell order and cut into strips of columns of cells; strips of one colour never
// touch the same node, so that they scatter side by side without atomics, and sums are taken strip
// by strip: results do not depend on the number of threads, to the last bit.
#pragma once

#include <fmt/format.h>
#include <omp.h>

#include <numeric>
#include <stdexcept>

#include "cases/failure.hpp"
#include "mpm/points/body.hpp"
#include "mpm/grid/grid.hpp"
#include "mpm/grid/interpolation_plane.hpp"
#include "mpm/grid/interpolation_space.hpp"
#include "mpm/step/ledger.hpp"
#include "mpm/grid/walls.hpp"

namespace grainpair {

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
  /// What averaging adds to the pressure of point p in the stress that the grid feels [Pa].
  virtual double pressure_correction(std::size_t p) const = 0;
  virtual const Points<2>* plane() const { return nullptr; }
  virtual const Points<3>* space() const { return nullptr; }

  /// Calls f with the points, of either dimension.
  template <class F>
  void visit_points(F&& f) const {
    if (plane()) return f(*plane());
    f(*space());
  }
};

/// Exchanged holds several points' numbers on their way to the nodes and back: Wide, or WideFloat
/// in single precision.
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

  /// Takes the points as they are (x, v, mass, void_ratio, id set) and lets the law initialise its
  /// state.
  Solver(const Setup& setup, Points<dim> points, std::unique_ptr<Body> body,
         const std::vector<InitialState>& initial)
      : setup_(setup),
        grid_(setup.cells, setup.numerics.h, setup.point_size),
        stage_(setup.numerics, std::move(points), setup.point_size, setup.solid_density,
               setup.gravity, halves == 2),
        body_(std::move(body)),
        velocities_(halves == 1 ? 0 : grid_.nodes.size()) {
    stage_.box.inverse_h = 1.0 / setup.numerics.h;
    for (int d = 0; d < dim; ++d) stage_.box.length[d] = grid_.axes[d].cells * grid_.axes[d].h;
    if constexpr (halves == 2) points_.affine.narrow();
    initialise(initial);
    bin_points();
    first_limit_ = stable_step().dt /
                   setup_.numerics.time_step_fraction;  // before there is a speed to bound it
    measure_held_energy();
    share_pressure();
  }

  /// The algorithm. Each stage books the energy it moves.
  void step(double dt) override {
    if (drift_ + max_speed_ * dt > drift_limit * setup_.numerics.h) bin_points();
    clear_grid();
    if (setup_.numerics.stress_update == StressUpdate::first) {
      scatter(Forces::without);  // mass and momentum
      constrain(0.0);            // nodal velocity at the walls
      gather(Gathered::gradient, dt);
      update_points(dt, Moves::no);  // strain, law
      share_pressure();
      clear_grid();
    }
    scatter(Forces::with);  // mass, momentum, internal force
    accelerate(dt);         // momentum balance [Ceccato2019, Eq. 2]
    if (setup_.numerics.transfer == TransferScheme::xpic) sharpen_velocity();
    if (setup_.numerics.stress_update == StressUpdate::last) {
      gather(Gathered::both, dt);  // velocity of points and grid, B or C; grad v
    } else {
      gather(Gathered::velocity, dt);
    }
    if (setup_.numerics.stress_update == StressUpdate::musl) {
      clear_grid();
      scatter(Forces::without);  // the points' new momenta, where they were
      constrain(dt);
      gather(Gathered::gradient, dt);
    }
    time_ += dt;
    if (setup_.numerics.stress_update != StressUpdate::first)
      update_points(dt, Moves::yes);  // strain, law, new places
    else
      move_points();
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
  double pressure_correction(std::size_t p) const override {
    return stage_.pressure_correction(Consecutive<false>{p, 1},
                                      trace(SymTensor(points_.sigma[p])) / 3.0)[0];
  }
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
  static constexpr double drift_limit = 0.4;  // of points between sortings, in cells: the more they
                                              // drift, the fewer share their nodes
  /// Strips of one colour go side by side: from the first to the last node that points of a strip
  /// reach, which may have drifted by a cell to either side, there are strip_width + reach + 1,
  /// less than `colours` strips. Three colours allow thinner ones, of which a cube has more to
  /// share out.
  static constexpr int colours = dim == 2 ? 2 : 3;
  static constexpr int strip_width =
      dim == 2 ? 5 : (Shape::reach + colours - 1) / (colours - 1);  // cells
  static_assert((colours - 1) * strip_width >= Shape::reach + 1);
  template <class Real>
  using VecOf = VectorOf<dim, Real>;
  template <class Real>
  using MatOf = MatrixOf<dim, Real>;
  template <class Real>
  using GivenOf = Given<dim, Real>;
  template <class Real>
  using CollectedOf = Collected<dim, Real>;
  enum class Forces { without, with };
  enum class Gathered { velocity, gradient, both };

  /// Fraction of the way to the grid's velocity, and to its gradient, that a point goes in one
  /// step.
  struct Filter {
    double velocity, gradient;
  };
  /// Sums a sweep makes, kept by strip so that their order never changes.
  struct Sums {
    double kinetic_before = 0.0, kinetic_after = 0.0, speed = 0.0, gained = 0.0, conducted = 0.0;
  };
  /// Of the nodes of a column, in accelerate().
  struct Work {
    double gain = 0.0, wall = 0.0;  // of kinetic energy; taken by the walls [J]
  };
  enum class Moves { no, yes };

  void initialise(const std::vector<InitialState>& initial);
  void bin_points();
  void put_fours_first(std::vector<std::uint32_t>& order,
                       const std::vector<std::size_t>& cell) const;
  void clear_grid();
  void scatter(Forces forces);
  template <Affine Carried>
  void scatter_strip(const Strip& strip, Forces forces);
  void accelerate(double dt);
  void constrain(double time_offset);
  void sharpen_velocity();
  /// Once for every node, not for every point that takes it.
  void narrow_velocity(const Node<dim>& node) {
    if constexpr (halves == 2)
      velocities_[static_cast<std::size_t>(&node - grid_.nodes.data())] = FloatNode<dim>(node);
  }
  void gather(Gathered what, double dt);
  template <Affine Carried>
  Sums gather_strip(const Strip& strip, Gathered what, const Filter& filter, double dt);
  void update_points(double dt, Moves moves);
  void move_points();
  void book_places();
  void conduct(double dt);
  void share_pressure();
  void average_over_nodes(std::vector<double>& field);
  void measure_held_energy();

  Vec constrained(const Vec& v, const std::array<int, dim>& node, double time) const {
    bool free = !setup_.gate.present;
    for (int d = 0; d < dim; ++d) free = free && node[d] > 0 && node[d] < grid_.axes[d].nodes - 1;
    return free ? v : constrained_here(v, node, time);
  }
  Vec constrained_here(Vec v, const std::array<int, dim>& node, double time) const;
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
      case Affine::none:
        return f(std::integral_constant<Affine, Affine::none>{});
      case Affine::moment:
        return f(std::integral_constant<Affine, Affine::moment>{});
      case Affine::gradient:
        return f(std::integral_constant<Affine, Affine::gradient>{});
    }
  }
  /// f(strip) over all strips; those that run at the same time share no node and no cell.
  template <class F>
  void for_each_strip(F&& f) {
    for (int colour = 0; colour < colours; ++colour)
      side_by_side(colour, static_cast<int>(strips_.size()), colours,
                   [&](int s) { f(static_cast<std::size_t>(s)); });
  }
  /// f(begin), f(begin + stride) ... below end, in any order; what one thread had, it gets again in
  /// the next sweep. OpenMP's team of one would enter the kernel in every sweep.
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
  template <class F>
  void for_each_point(F&& f) {
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) f(p);
    });
  }
  /// f(i) over the columns of nodes that points can reach.
  template <class F>
  void for_each_active_column(F&& f) {
    side_by_side(stage_.box.begin[0], stage_.box.end[0], 1, f);
  }
  void clear_cells(CellMeans& means, int column) {
    means.clear_column(static_cast<std::size_t>(column - stage_.box.begin[0]),
                       static_cast<std::size_t>(stage_.box.end[0] - stage_.box.begin[0]));
  }
  template <class F>
  void for_each_node_of_column(int i, F&& f) {
    std::array<int, dim> node;
    node[0] = i;
    for (int j = stage_.box.begin[1]; j < stage_.box.end[1]; ++j) {
      node[1] = j;
      const auto row = static_cast<std::size_t>(i * grid_.stride[0] + j * grid_.stride[1]);
      if constexpr (dim == 2) {
        f(grid_.nodes[row], node);
      } else {
        for (int k = stage_.box.begin[2]; k < stage_.box.end[2]; ++k) {
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
        Node<dim>* const row = &grid_.nodes[static_cast<std::size_t>(first)] + i * grid_.stride[0] +
                               j * grid_.stride[1];
        const auto give = [&](Node<dim>& node, double w, auto... gradient) {
          if constexpr (std::is_invocable_v<F, Node<dim>&, double, Vec>)
            f(node, w, Vec(gradient...));
          else
            f(node, w);
        };
        const double w = n[0].w[i] * n[1].w[j], dx = n[0].dw[i] * n[1].w[j],
                     dy = n[0].w[i] * n[1].dw[j];
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
      cell = cell * static_cast<std::size_t>(setup_.cells[d]) +
             static_cast<std::size_t>(x[d] * grid_.axes[d].inverse_h);
    return cell;
  }

  Setup setup_;
  Grid<dim, Shape> grid_;
  PointStage<Kinematics> stage_;
  Points<dim>& points_ = stage_.points;
  std::unique_ptr<Body> body_;
  std::vector<FloatNode<dim>>
      velocities_;               // of the nodes, where points take them in single precision [m/s]
  std::vector<double> scratch_;  // of conduction: conductivity times volume [J s]
  std::vector<Strip> strips_;
  std::vector<Sums> sums_;  // of the last sweep, by strip
  std::vector<PointSums> point_sums_;
  std::vector<Work> work_;  // by column of nodes
  Fastest fastest_;
  double first_limit_ = std::numeric_limits<double>::infinity();  // of the step, at the start [s]
  double drift_ = 0.0,
         max_speed_ = 0.0;  // since the points were binned [m]; of the last step [m/s]
  double time_ = 0.0;
  EnergyLedger ledger_;
};

}  // namespace grainpair

#include "mpm/step/solver_stages.hpp"
