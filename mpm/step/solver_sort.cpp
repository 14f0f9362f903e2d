// The start of a run, and the order that points are kept in.
#include <fmt/format.h>

#include <numeric>

#include "mpm/step/solver.hpp"

namespace grainpair {

/// The kernel's axes carry the grid, and its points exchange numbers in its precision.
template <int D>
Solver<D>::Solver(const SolverSetup<dim>& setup, std::unique_ptr<TransferKernel<dim>> kernel,
                  Points<dim> points, std::unique_ptr<Body> body,
                  const std::vector<InitialState>& initial)
    : setup_(setup),
      kernel_(std::move(kernel)),
      exchange_{MaterialPoints<dim>(setup.numerics, std::move(points), setup.point_size,
                                    setup.solid_density, setup.gravity, kernel_->single,
                                    setup.axisymmetric),
                Grid<dim>(kernel_->axes(), !ranks().many()),
                {},
                setup.numerics.transfer},
      strip_width_(dim == 2 ? 5 : (kernel_->reach + colours - 1) / (colours - 1)),
      body_(std::move(body)) {
  if ((colours - 1) * strip_width_ < kernel_->reach + 1)
    throw std::logic_error("strips of one colour would share nodes");
  material_.box.inverse_h = 1.0 / setup.numerics.h;
  for (int d = 0; d < dim; ++d) material_.box.length[d] = grid_.axes[d].cells * grid_.axes[d].h;
  if (kernel_->single) {
    points_.affine.keep_single();
    velocities_.show(0, grid_.nodes.size());
  }
  for (int d = 0; d < dim; ++d)
    if (setup.numerics.volume_relaxation > 0.0)
      rooms_[d] = rooms_along(d, setup.axisymmetric && d == 0, *kernel_, grid_);
  material_.agree([&](double own) { return ranks().largest(own); });
  initialise(initial);
  sort_points();
  agree();
  first_limit_ =
      stable_step().dt / setup_.numerics.time_step_fraction;  // before there is a speed to bound it
  measure_held_energy();
  agree();
}

/// The law's state at the start, and what it says of it.
template <int D>
void Solver<D>::initialise(const std::vector<InitialState>& initial) {
  for (std::size_t p = 0; p < points_.size(); ++p) points_.x[p][0] += origin();
  Order order;  // as they are, in whole blocks
  order.from.resize(initial.size());
  std::iota(order.from.begin(), order.from.end(), 0u);
  order.fill_up();
  body_->resize(initial.size());
  reorder(order, {});
  if (body_->fluctuates()) material_.collisional_pressure.resize(points_.size());
  constexpr std::size_t most = 64;
  Batch batch(most, false);
  for (std::size_t first = 0; first < initial.size(); first += most) {
    batch.size = std::min(most, initial.size() - first);
    body_->initialise(first, std::span(initial).subspan(first, batch.size), batch);
    std::copy_n(batch.regime.begin(), batch.size, &points_.regime[first]);
    for_each_block(first, first + whole(batch.size), [&](const Block& block) {
      const Block row = block.from(first);
      const auto sigma = batch.sigma.load(row);
      const auto energies = batch.energies.load(row);
      points_.sigma.store(sigma, block);
      block.store(trace(sigma) * (1.0 / 3.0), material_.pressure);
      if (body_->fluctuates())
        block.store(row.load(batch.collisional_pressure), material_.collisional_pressure);
      block.store(row.load(batch.granular_temperature), points_.granular_temperature);
      block.store(energies.fluctuation, points_.fluctuation);
      block.store(energies.plastic, points_.plastic);
      block.store(energies.regime_4, points_.regime_4);
      block.store(energies.contact, points_.contact);
      ledger_.stored += reduce(block.load(points_.mass) * energies.stored);
      material_.template limit_step<true>(block, material_.specific_volume(block),
                                          batch.stability.load(row), fastest_);
    });
  }
  if (ranks().many()) body_->reorder(order.from);  // fillers there, too: points may leave at once
}

/// Every field of the points by itself, with other tasks of that kind.
template <int D>
void Solver<D>::reorder(const Order& order, Tasks tasks) {
  material_.reorder(order, tasks);
  side_by_side(0, static_cast<int>(tasks.size()),
               [&](int k) { tasks[static_cast<std::size_t>(k)](); });
  material_.resize_of_step();
}

template <int D>
ActiveBox<D> Solver<D>::whole_grid() const {
  ActiveBox<dim> out = material_.box;
  out.begin = {}, out.end = setup_.cells;
  return out;
}

template <int D>
PointsByCell Solver<D>::by_cell() {
  const ActiveBox<dim> grid = whole_grid();
  std::vector<std::int32_t> cell(points_.size());
  const std::size_t blocks = cell.size() / Wide::size();
  side_by_side(0, static_cast<int>(blocks), [&](int k) {
    const Block block{static_cast<std::size_t>(k) * Wide::size()};
    store_whole(grid.cell(points_.x.load(block)), block, cell);
  });
  for (std::size_t p = blocks * Wide::size(); p < cell.size(); ++p)  // come from another rank
    cell[p] = static_cast<std::int32_t>(grid.cell(points_.x[p]));
  return {points_.occupied(), cell};
}

/// Volume is counted against room once in so many sortings, when points have drifted by a cell: it
/// goes astray over strains of one.
constexpr int sortings_a_count = 3;

/// Sorts points by cell, cuts them into strips, and finds the nodes they can reach until the next
/// sorting.
template <int D>
void Solver<D>::sort_points() {
  put_back();
  if (ranks().many()) cut(), hand_over();
  const PointsByCell cells = by_cell();
  find_active_box(cells);
  here_ = cells.size();
  const Order order = in_cell_order(cells);
  reorder(order, {[&] { body_->reorder(order.from); }});
  material_.find_cells();
  give_pressures_anew();
  if (setup_.numerics.volume_relaxation > 0.0 && sorted_++ % sortings_a_count == 0) find_crowding();
  drift_ = 0.0;
}

/// Strips of cells. Within each, as many points of a cell as fill a Wide stay together, what cells
/// have left over follows at the end, and fillers make it whole blocks. In a flowing column, whose
/// cells hold three points or five, all blocks but the last would else straddle cells and share no
/// nodes.
template <int D>
Order Solver<D>::in_cell_order(const PointsByCell& cells) {
  auto strip_cells = static_cast<std::size_t>(strip_width_);
  for (int d = 1; d < dim; ++d) strip_cells *= static_cast<std::size_t>(setup_.cells[d]);
  Order order;
  order.from.reserve(cells.size() + cells.size() / 64);
  std::vector<std::uint32_t> left_over;
  std::size_t strip = 0, begin = 0;
  strips_.clear();
  const auto finish = [&] {
    order.from.insert(order.from.end(), left_over.begin(), left_over.end());
    left_over.clear();
    if (!order.from.empty()) order.fill_up();
    strips_.push_back({begin, order.from.size()});
    begin = order.from.size();
  };
  cells.for_each([&](std::size_t cell, std::span<const std::uint32_t> points) {
    // a strip without points keeps its place, and so its colour
    for (; strip < cell / strip_cells; ++strip) finish();
    const auto together = points.first(points.size() / Wide::size() * Wide::size());
    order.from.insert(order.from.end(), together.begin(), together.end());
    left_over.insert(left_over.end(), points.begin() + together.size(), points.end());
  });
  if (cells.size() > 0) finish();
  if (order.from.empty()) order.keep_one(), order.fill_up();
  done_ = std::vector<Milestone>(strips_.size());
  return order;
}

/// Cells to either side of the points that they can drift into, and the nodes those reach. Above a
/// slope there are as many nodes again in the box of all points; each slice of nodes has a top of
/// its own.
template <int D>
void Solver<D>::find_active_box(const PointsByCell& cells) {
  constexpr int drift = box_drift;
  std::array<int, dim> low = setup_.cells, high{};
  std::vector<int> highest(static_cast<std::size_t>(setup_.cells[0]), -1);  // by column of cells
  cells.for_each([&](std::size_t cell, const auto&) {
    std::array<int, dim> at;
    for (std::size_t d = dim; d-- > 0; cell /= static_cast<std::size_t>(setup_.cells[d]))
      at[d] = static_cast<int>(cell % static_cast<std::size_t>(setup_.cells[d]));
    for (int d = 0; d < dim; ++d)
      low[d] = std::min(low[d], at[d]), high[d] = std::max(high[d], at[d]);
    int& of_column = highest[static_cast<std::size_t>(at[0])];
    of_column = std::max(of_column, at[1]);
  });
  for (int d = 0; d < dim; ++d) {
    material_.box.begin[d] = std::max(low[d] - drift, 0);
    material_.box.end[d] = std::min(high[d] + drift + kernel_->support, grid_.axes[d].nodes);
  }
  if (setup_.period) {  // images alike
    material_.box.begin[0] = 0, material_.box.end[0] = grid_.axes[0].nodes;
    tops_.assign(static_cast<std::size_t>(grid_.axes[0].nodes), material_.box.end[1]);
    if (ranks().many()) widen_box();
    return;
  }
  tops_.assign(static_cast<std::size_t>(grid_.axes[0].nodes), material_.box.begin[1]);
  for (int column = 0; column < setup_.cells[0]; ++column) {
    const int of_column = highest[static_cast<std::size_t>(column)];
    if (of_column < 0) continue;
    const int top = std::min(of_column + drift + kernel_->support, grid_.axes[1].nodes);
    const int end = std::min(column + drift + kernel_->support, grid_.axes[0].nodes);
    for (int i = std::max(column - drift, 0); i < end; ++i)
      tops_[static_cast<std::size_t>(i)] = std::max(tops_[static_cast<std::size_t>(i)], top);
  }
  if (ranks().many()) widen_box();
}

/// What the cells of a new box hold in turns.
template <int D>
void Solver<D>::resize_cells() {
  const std::size_t cells = material_.box.cells();
  spent_rates_.resize(setup_.numerics.averages_rates() ? cells : 0);
  spent_pressures_.resize(setup_.numerics.averages_pressures() ? cells : 0);
}

/// To the cells of a new box.
template <int D>
void Solver<D>::give_pressures_anew() {
  resize_cells();
  ClearingCells clearing(std::move(pressures_));
  clearing.resize(setup_.numerics.averages_pressures() ? material_.box.cells() : 0);
  clearing.clear();
  GivingCells pressures(std::move(clearing));
  for_each_strip([&](std::size_t s) {
    for_each_block(strips_[s].begin, strips_[s].end,
                   [&](const Block& block) { material_.give_pressure(block, pressures); });
  });
  pressures_ = GivenCells(std::move(pressures));
}

/// Energies held at the start.
template <int D>
void Solver<D>::measure_held_energy() {
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const double m = points_.mass[p];
    ledger_.kinetic += 0.5 * m * points_.v[p].squaredNorm();
    ledger_.potential -= m * setup_.gravity.dot(points_.x[p]);
    ledger_.fluctuation += m * points_.fluctuation[p];
    max_speed_ = std::max(max_speed_, points_.v[p].cwiseAbs().maxCoeff());
  }
  if (!setup_.period) return;
  ledger_.slope = energy_along();
  ledger_.potential -= ledger_.slope;
}

/// That of the fastest point, and no point may cross more than a fifth of a cell per step. A law
/// may lose all its stress, and with it all that limits the step; what it meets when contact comes
/// back is not known before, but the step that was stable at the start, four times, still finds it
/// in time.
template <int D>
TimeStep Solver<D>::stable_step() const {
  TimeStep out{std::numeric_limits<double>::infinity(), Limit::none, 0};
  if (fastest_.rate > 0.0) out = {2.0 / fastest_.rate, fastest_.limit, fastest_.point};
  if (4.0 * first_limit_ < out.dt) out = {4.0 * first_limit_, Limit::none, 0};
  out.dt *= setup_.numerics.time_step_fraction;
  if (max_speed_ > 0.0) out.dt = std::min(out.dt, 0.2 * setup_.numerics.h / max_speed_);
  return out;
}

template <int D>
void Solver<D>::archive(Archive& to) {
  material_.archive(to);
  body_->archive(to);
  pressures_.archive("pressures", to);
  to.structs<std::size_t>("strips", strips_), to.list("tops", tops_);
  to.number("fastest_rate", fastest_.rate), to.number("fastest_point", fastest_.point);
  auto limit = static_cast<std::int32_t>(fastest_.limit);
  to.number("fastest_limit", limit);
  fastest_.limit = static_cast<Limit>(limit);
  to.number("drift", drift_), to.number("max_speed", max_speed_), to.number("time", time_);
  to.number("passed", passed_), to.number("sorted", sorted_);
  to.structure<double>("ledger", ledger_);
  done_ = std::vector<Milestone>(strips_.size()), sweeps_ = 0;
  resize_cells();
  material_.find_cells();
  if (!ranks().many()) return;
  to.list("cuts", cuts_), to.number("here", here_);
  to.number("unequal", unequal_), to.number("agreed", agreed_);
  to.structure<double>("all", all_);
  show_box();
}

template class Solver<2>;
template class Solver<3>;

}  // namespace grainpair
