// The material point method: one explicit step, read from top to bottom in Solver::step().
//
// Points are kept in cell order and cut into strips of cells along x; strips of one colour never
// touch the same node, so that they scatter side by side without atomics, and sums are taken strip
// by strip: results do not depend on the number of threads, to the last bit.
//
// What a stage leaves on the grid and in the cells is a type, handed from stage to stage: a stage
// that is called out of order does not compile.
#pragma once

#include <omp.h>

#include <limits>
#include <memory>
#include <vector>

#include "mpm/grid/walls.hpp"
#include "mpm/points/body.hpp"
#include "mpm/step/node_room.hpp"
#include "mpm/step/period.hpp"
#include "mpm/step/points_by_cell.hpp"
#include "mpm/step/ranks.hpp"
#include "mpm/step/simulation.hpp"
#include "mpm/step/team.hpp"
#include "mpm/step/transfer_kernel.hpp"

namespace grainpair {

/// What a solver is made of, besides points and their law.
template <int Dim>
struct SolverSetup {
  std::array<int, Dim> cells;
  double point_size;                      // [m]
  double solid_density;                   // rho_s [kg/m3]
  Eigen::Matrix<double, Dim, 1> gravity;  // [m/s2]
  Walls<Dim> walls;
  Gate gate;
  bool axisymmetric = false;  // x is the radius
  Numerics numerics;
  Period period = {};  // along x; cells[0] are then all its cells
  Shelf shelf = {};    // bottom of a silo
  const Ranks* ranks = &alone();
  double thickness = 1.0;  // of plane strain [m]
};

/// The stages are in solver_*.cpp, the two sweeps between points and nodes in the kernel.
template <int Dim>
class Solver final : public Simulation {
 public:
  static constexpr int dim = Dim;
  using Vec = Eigen::Matrix<double, dim, 1>;

  /// Takes the points as they are (x, v, mass, void_ratio, id set) and lets the law initialise its
  /// state.
  Solver(const SolverSetup<dim>& setup, std::unique_ptr<TransferKernel<dim>> kernel,
         Points<dim> points, std::unique_ptr<Body> body, const std::vector<InitialState>& initial);

  /// The algorithm. Each stage books the energy it moves.
  void step(double dt) override {
    if (drift_ + max_speed_ * dt > drift_limit * setup_.numerics.h) sort_points();
    const StressUpdate when = setup_.numerics.stress_update;
    if (when == StressUpdate::first) {  // strain and law, from the velocity the step begins with
      MovingGrid before = constrain(scatter_momenta(clear_grid()));
      update_points(gather_gradient(std::move(before)), dt, Moves::no);
    }
    MovingGrid grid = accelerate(scatter(clear_grid()), dt);  // balance [Ceccato2019, Eq. 2]
    if (setup_.numerics.transfer == TransferScheme::xpic) sharpen_velocity(grid);
    time_ += dt;
    if (when == StressUpdate::last) {
      StrainedPoints strained = gather(std::move(grid), dt);  // velocity, B or C; grad v
      update_points(std::move(strained), dt, Moves::yes);     // strain, law, new places
    } else if (when == StressUpdate::first) {
      gather_velocity(grid, dt);
      move_points(std::move(grid), dt);
    } else {
      gather_velocity(grid, dt);
      MovingGrid after = constrain(scatter_momenta(clear_grid(std::move(grid))));
      update_points(gather_gradient(std::move(after)), dt, Moves::yes);
    }
    if (setup_.numerics.conduction) conduct(dt);
    agree();
  }
  void step(double dt, StageTimes& times) override {
    times_ = &times;
    step(dt);
    times_ = nullptr;
  }

  TimeStep stable_step() const override;
  void archive(Archive& to) override;

  double time() const override { return time_; }
  const EnergyLedger& ledger() const override { return ranks().many() ? all_ : ledger_; }
  const Ranks& ranks() const override { return *setup_.ranks; }
  double imbalance() const override { return ranks().many() ? unequal_ / agreed_ : 1.0; }
  double solid_density() const override { return setup_.solid_density; }
  double depth(double x) const override;
  bool tells_energies() const override { return body_->tells_energies(); }
  Vec3 position(std::size_t p) const override {
    Vec3 x = padded(Vec(points_.x[p]));
    if (setup_.period) {
      const double length = setup_.period.cells * setup_.numerics.h;
      x[0] -= origin();
      x[0] -= length * std::floor(x[0] / length);
    }
    return x;
  }
  Vec3 velocity(std::size_t p) const override { return padded(Vec(points_.v[p])); }
  double pressure_correction(std::size_t p) const override {
    return material_.pressure_correction(Scattered::one(p),
                                         trace(SymTensor(points_.sigma[p])) / 3.0, pressures_)[0];
  }
  double collisional_pressure(std::size_t p) const override {
    return body_->fluctuates() ? material_.collisional_pressure[p] : 0.0;
  }
  const Points<2>* plane() const override {
    if constexpr (dim == 2) return &points_;
    return nullptr;
  }
  const Points<3>* space() const override {
    if constexpr (dim == 3) return &points_;
    return nullptr;
  }
  const Grid<dim>& grid() const { return grid_; }
  Points<dim>& points() { return points_; }

 private:
  friend struct Xpic;          // sweeps over nodes and points
  friend struct SolverStages;  // a test that adds a body force between two stages
  /// Of points between sortings, in cells: the more they drift, the fewer share their nodes.
  static constexpr double drift_limit = 0.4;
  /// Cells, to either side of the points, that they are given room to drift into.
  static constexpr int box_drift = 2;
  /// Strips of one colour go side by side: from the first to the last node that points of a strip
  /// reach, which may have drifted by a cell to either side, there are strip_width + reach + 1,
  /// less than `colours` strips. Three colours allow thinner ones, of which a cube has more to
  /// share out.
  static constexpr int colours = dim == 2 ? 2 : 3;
  /// Of the nodes of a slice, in accelerate().
  struct Work {
    double gain = 0.0, wall = 0.0;  // of kinetic energy; taken by the walls [J]
  };
  enum class Moves { no, yes };
  enum class Folded { momenta, changes, both };

  /// Cells that wait for what points give of this step.
  struct CellsToGive {
    GivingCells rates, pressures;
  };
  // What is on the grid, and who may ask for it.
  struct ClearedGrid {
    CellsToGive cells;
  };
  struct LoadedGrid {  // mass, momentum, and force if it was asked for
    CellsToGive cells;
  };
  struct MovingGrid {  // velocities, and their increments
    CellsToGive cells;
  };
  struct StrainedPoints {  // points that know their velocity gradients, cells that know their rates
    GivenCells rates;
    GivingCells pressures;
  };

  // solver_sort.cpp
  void initialise(const std::vector<InitialState>& initial);
  void sort_points();
  void reorder(const Order& order, Tasks tasks);
  ActiveBox<Dim> whole_grid() const;
  PointsByCell by_cell();
  Order in_cell_order(const PointsByCell& cells);
  void find_active_box(const PointsByCell& cells);
  void resize_cells();
  void give_pressures_anew();
  void measure_held_energy();

  // solver_grid.cpp
  ClearedGrid clear_grid();
  ClearedGrid clear_grid(MovingGrid old);
  void clear_nodes(int slice);
  LoadedGrid scatter(ClearedGrid grid) { return scatter(std::move(grid), Forces::with); }
  LoadedGrid scatter_momenta(ClearedGrid grid) { return scatter(std::move(grid), Forces::without); }
  LoadedGrid scatter(ClearedGrid grid, Forces forces);
  MovingGrid accelerate(LoadedGrid grid, double dt);
  MovingGrid constrain(LoadedGrid grid);
  void sharpen_velocity(MovingGrid& grid);
  StrainedPoints gather(MovingGrid grid, double dt) {
    return gathered(std::move(grid), Gathered::both, dt);
  }
  StrainedPoints gather_gradient(MovingGrid grid) {
    return gathered(std::move(grid), Gathered::gradient, 0.0);
  }
  void gather_velocity(MovingGrid& grid, double dt) {
    sweep_nodes(grid.cells.rates, Gathered::velocity, dt);
  }
  StrainedPoints gathered(MovingGrid grid, Gathered what, double dt);
  void sweep_nodes(GivingCells& rates, Gathered what, double dt);

  // solver_points.cpp
  void update_points(StrainedPoints strained, double dt, Moves moves);
  void move_points(MovingGrid grid, double dt);
  void hold_pressures(GivingCells given);
  void book_places();

  // solver_period.cpp
  void fold(Folded what);
  void fold(GivingCells& cells) const;
  void put_back();
  double energy_along() const;

  // solver_ranks.cpp
  void fold_ranks(Folded what);
  void fold_ranks(GivingCells& cells) const;
  void cut();
  void hand_over();
  void put_in(Order& order, const Bytes& count, const Bytes& come);
  void widen_box();
  void show_box();
  void agree();
  /// Whether there is a neighbour that shares nodes.
  bool has_left() const { return setup_.period || ranks().here() > 0; }
  bool has_right() const { return setup_.period || ranks().here() + 1 < ranks().count(); }
  bool lies_left(int column) const;
  /// Slices of nodes, or of cells, that two ranks give to.
  struct Shared {
    int begin, end;
  };
  Shared shared_nodes(int cut) const;
  static Shared shared_cells(int cut);
  /// Columns of cells of this rank. It counts as many of nodes; the last all that follow, too.
  int first_column() const { return cuts_[static_cast<std::size_t>(ranks().here())]; }
  int end_column() const { return cuts_[static_cast<std::size_t>(ranks().here()) + 1]; }
  /// Of what slices of nodes have, that of those which are no images, and no other rank's.
  std::span<const Work> counted(const std::vector<Work>& all) const;
  /// Throws it, or keeps it until all ranks know.
  void fail(const SolverError& error);
  /// Where the period begins on the grid [m].
  double origin() const { return setup_.period ? Period::beside * setup_.numerics.h : 0.0; }

  // solver_fields.cpp
  void conduct(double dt);
  // solver_room.cpp
  void find_crowding();

  /// A node's velocity and its increment: once for every node, not for every point that takes them,
  /// and from registers. What has just been stored by twos cannot be loaded by fours at once.
  void hand_out(Node<dim>& node, const Vec& v, const Vec& increment) {
    node.motion = v, node.change = increment;
    if (kernel_->single)
      velocities_[static_cast<std::size_t>(&node - grid_.nodes.data())] = {v, increment};
  }
  std::pair<std::size_t, std::size_t> unbound(const std::array<int, dim>& first,
                                              std::size_t count) const;
  Vec constrained(Vec v, const std::array<int, dim>& node, double time) const;
  /// f(strip) over all strips, colour by colour; those that run at the same time share no node and
  /// no cell. A strip waits for those of its neighbours that come before it, not for a whole
  /// colour: a cube has four or five strips of one, which two threads cannot halve.
  template <class F>
  void for_each_strip(F&& f) {
    const int strips = static_cast<int>(strips_.size()), threads = omp_get_max_threads();
    if (threads == 1) {
      for (int k = 0; k < strips; ++k) f(strip_at(k));
      return;
    }
    const unsigned sweep = ++sweeps_;
    std::array<int, colours> ends;
    for (int colour = 0, end = 0; colour < colours; ++colour)
      ends[static_cast<std::size_t>(colour)] = end += strips_of(colour);
    const auto points = [&](int k) { return static_cast<double>(strips_[strip_at(k)].size()); };
    share_out({ends, threads, points}, [&](int k) {
      const std::size_t s = strip_at(k);
      const std::size_t first = s < colours ? 0 : s - colours + 1;
      for (std::size_t other = first; other < std::min(s + colours, strips_.size()); ++other)
        if (other % colours < s % colours) done_[other].await(sweep);
      f(s);
      done_[s].set(sweep);
    });
  }
  int strips_of(int colour) const {
    return (static_cast<int>(strips_.size()) - colour + colours - 1) / colours;
  }
  /// Of all strips, colour by colour.
  std::size_t strip_at(int k) const {
    int colour = 0;
    for (; k >= strips_of(colour); ++colour) k -= strips_of(colour);
    return static_cast<std::size_t>(colour + k * colours);
  }
  template <class F>
  void for_each_point(F&& f) {
    for_each_strip([&](std::size_t s) { for_each_point_of(strips_[s], f); });
  }
  /// The same, fillers included.
  template <class F>
  void for_each_place(F&& f) {
    for_each_strip([&](std::size_t s) {
      for (std::size_t p = strips_[s].begin; p < strips_[s].end; ++p) f(p);
    });
  }
  template <class F>
  void for_each_point_of(const Strip& strip, F&& f) {
    for (std::size_t p = strip.begin; p < strip.end; ++p)
      if (!points_.filler(p)) f(p);
  }
  /// f(i) over the slices of nodes, across x, that points can reach.
  template <class F>
  void for_each_slice(F&& f) {
    side_by_side(material_.box.begin[0], material_.box.end[0], f);
  }
  template <class F>
  void for_each_node(F&& f) {
    for_each_slice([&](int i) { for_each_node_of_slice(i, f); });
  }
  template <class F>
  void for_each_node_of_slice(int i, F&& f) {
    for_each_row_of_slice(i, [&](std::span<Node<dim>> row, std::array<int, dim> node) {
      for (Node<dim>& one : row) f(one, node), ++node[dim - 1];
    });
  }
  /// f(nodes along the last axis, place of the first)
  template <class F>
  void for_each_row_of_slice(int i, F&& f) {
    const auto& box = material_.box;
    const auto row = [&](const std::array<int, dim>& first, int end) {
      std::ptrdiff_t at = 0;
      for (int d = 0; d < dim; ++d) at += first[d] * grid_.stride[d];
      const int count = std::max(end - first[dim - 1], 0);
      f(std::span(grid_.nodes.data() + at, static_cast<std::size_t>(count)), first);
    };
    const int top = tops_[static_cast<std::size_t>(i)];
    if constexpr (dim == 2)
      row({i, box.begin[1]}, top);
    else
      for (int j = box.begin[1]; j < top; ++j) row({i, j, box.begin[2]}, box.end[2]);
  }
  /// f(node, w_ip) or f(node, w_ip, grad w_ip) over the nodes that share point p, or a place x.
  template <class F>
  void for_each_weight(std::size_t p, F&& f) {
    for_each_weight_at(points_.x[p], f);
  }
  template <class F>
  void for_each_weight_at(const Vec& x, F&& f) {
    NodeWeights<dim> near;
    kernel_->weigh(x, grid_, near);
    for (std::size_t i = 0; i < static_cast<std::size_t>(near.count); ++i) {
      if constexpr (std::is_invocable_v<F, Node<dim>&, double, const Vec&>)
        f(grid_.nodes[near.node[i]], near.w[i], near.slope[i]);
      else
        f(grid_.nodes[near.node[i]], near.w[i]);
    }
  }

  SolverSetup<dim> setup_;
  std::unique_ptr<TransferKernel<dim>> kernel_;
  Exchange<dim> exchange_;
  MaterialPoints<dim>& material_ = exchange_.material;
  Points<dim>& points_ = material_.points;
  Grid<dim>& grid_ = exchange_.grid;
  Window<FloatNode<dim>>& velocities_ = exchange_.velocities;
  int strip_width_;  // cells
  std::unique_ptr<Body> body_;
  GivenCells pressures_;                          // of the points as they are
  ClearingCells spent_rates_, spent_pressures_;   // of the step before
  std::array<std::vector<NodeRoom>, dim> rooms_;  // of nodes, by axis
  std::vector<double> scratch_;                   // of conduction: conductivity times volume [J s]
  std::vector<int> tops_;  // by slice of nodes: the end of those along y that points can reach
  std::vector<Strip> strips_;
  std::vector<Milestone> done_;  // the last sweep that has done with a strip
  unsigned sweeps_ = 0;
  std::vector<GatherSums> sums_;  // of the last sweep, by strip
  std::vector<PointSums> point_sums_;
  std::vector<Work> work_;  // by slice of nodes
  Fastest fastest_;
  double first_limit_ = std::numeric_limits<double>::infinity();  // of the step, at the start [s]
  double drift_ = 0.0;      // since the points were sorted [m]
  double max_speed_ = 0.0;  // of the last step [m/s]
  double time_ = 0.0;
  double passed_ = 0.0;  // energy along the slope of the periods that points have passed [J]
  int sorted_ = 0;       // how often
  EnergyLedger ledger_;
  std::vector<int> cuts_;       // of ranks: the column of cells where each begins, and the end
  std::size_t first_node_ = 0;  // that is in memory
  std::size_t here_ = 0;        // points of this rank
  double unequal_ = 0.0, agreed_ = 0.0;  // sum of imbalances, of so many steps
  EnergyLedger all_;                     // sums over the ranks
  std::optional<SolverError> failed_;    // what this rank has to throw
  std::vector<double> to_[2], from_[2];  // sums of nodes on their way between neighbours
  StageTimes* times_ = nullptr;          // where somebody asks for them
};

extern template class Solver<2>;
extern template class Solver<3>;

}  // namespace grainpair
