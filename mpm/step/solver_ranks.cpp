// What a scene that ranks share asks for (ranks.hpp). All have the same axes and the same walls;
// each has its points, and in memory the nodes that these can reach. Where two meet, both hold the
// nodes and cells that points of either reach: the sums of the two are added, alike on both. On a
// grid that repeats the last and the first meet, too: what is the one's right border is the other's
// left one, a period further on.
#include <numeric>

#include "mpm/step/solver.hpp"

namespace grainpair {

namespace {

Bytes as_bytes(std::size_t number) {
  Bytes out(sizeof number);
  std::memcpy(out.data(), &number, sizeof number);
  return out;
}

/// Takes some points out, as bytes, field by field; or fills the last ones from such bytes.
class Moving final : public Archive {
 public:
  /// Of `points` points, those at `places`.
  Moving(std::size_t points, std::span<const std::uint32_t> places)
      : points_(points), places_(places) {}
  /// The last `count` of `points`, from what was taken out.
  Moving(std::size_t points, std::size_t count, const Bytes& from)
      : points_(points), last_(count), bytes_(from), fills_(true) {}

  Bytes& bytes() { return bytes_; }

 private:
  std::size_t length(const std::string&, std::size_t now) override { return now; }
  void pass(const std::string& name, Type type, void* values, std::size_t count) override {
    const bool of_points = !name.starts_with("box_") && !name.ends_with("/points");
    if (count != points_ || !of_points) return;
    const bool half = type == Type::f32 || type == Type::i32 || type == Type::u32;
    const std::size_t size = half ? 4 : 8;
    auto* const own = static_cast<std::byte*>(values);
    if (fills_) {
      std::copy_n(bytes_.data() + at_, last_ * size, own + (points_ - last_) * size);
      at_ += last_ * size;
      return;
    }
    for (const std::uint32_t p : places_)
      bytes_.insert(bytes_.end(), own + p * size, own + (p + 1) * size);
  }

  std::size_t points_;
  std::span<const std::uint32_t> places_;
  std::size_t last_ = 0, at_ = 0;
  Bytes bytes_;
  bool fills_ = false;
};

}  // namespace

template <int D>
auto Solver<D>::shared_nodes(int cut) const -> Shared {
  return {cut - box_drift, std::min(cut + 1 + kernel_->support, grid_.axes[0].nodes)};
}

template <int D>
auto Solver<D>::shared_cells(int cut) -> Shared {
  return {cut - box_drift, cut + box_drift};
}

template <int D>
auto Solver<D>::counted(const std::vector<Work>& all) const -> std::span<const Work> {
  const Period& period = setup_.period;
  if (!ranks().many())
    return period ? std::span(all).subspan(Period::beside, static_cast<std::size_t>(period.cells))
                  : std::span(all);
  const auto begin = std::min(all.size(), static_cast<std::size_t>(first_column()));
  const auto end = std::min(all.size(), static_cast<std::size_t>(end_column()));
  return std::span(all).subspan(begin, (has_right() ? end : all.size()) - begin);
}

/// Adds up what points of two ranks gave to the nodes of both.
template <int D>
void Solver<D>::fold_ranks(Folded what) {
  const bool motion = what != Folded::changes, change = what != Folded::momenta;
  const auto each = [&](const Shared& zone, auto&& f) {
    for (int i = zone.begin; i < zone.end; ++i)
      for_each_node_of_slice(i, [&](Node<dim>& node, const auto&) { f(node); });
  };
  const std::array<bool, 2> there{has_left(), has_right()};
  const std::array<Shared, 2> zones{shared_nodes(first_column()), shared_nodes(end_column())};
  for (std::size_t side = 0; side < 2; ++side) {
    auto& to = to_[side];
    to.clear();
    if (!there[side]) continue;
    each(zones[side], [&](const Node<dim>& node) {
      if (motion)
        to.push_back(node.mass), to.insert(to.end(), node.motion.begin(), node.motion.end());
      if (change) to.insert(to.end(), node.change.begin(), node.change.end());
    });
    from_[side].resize(to.size());
  }
  ranks().swap(bytes_of(to_[0]), bytes_of(to_[1]), std::as_writable_bytes(std::span(from_[0])),
               std::as_writable_bytes(std::span(from_[1])));
  for (std::size_t side = 0; side < 2; ++side) {
    if (!there[side]) continue;
    const double* from = from_[side].data();
    each(zones[side], [&](Node<dim>& node) {
      if (motion) {
        node.mass += *from++;
        for (int d = 0; d < dim; ++d) node.motion[d] += *from++;
      }
      if (change)
        for (int d = 0; d < dim; ++d) node.change[d] += *from++;
    });
  }
}

/// The same of the sums of cells.
template <int D>
void Solver<D>::fold_ranks(GivingCells& cells) const {
  const auto& box = material_.box;
  const auto slices = static_cast<std::size_t>(box.end[0] - box.begin[0]);
  const auto of = [&](int cut) {
    const Shared zone = shared_cells(cut);
    return cells.cells_of(static_cast<std::size_t>(zone.begin - box.begin[0]),
                          static_cast<std::size_t>(zone.end - box.begin[0]), slices);
  };
  std::span<CellSums<double>> left, right;
  if (has_left()) left = of(first_column());
  if (has_right()) right = of(end_column());
  std::vector<CellSums<double>> from_left(left.size()), from_right(right.size());
  ranks().swap(std::as_bytes(left), std::as_bytes(right),
               std::as_writable_bytes(std::span(from_left)),
               std::as_writable_bytes(std::span(from_right)));
  for (std::size_t c = 0; c < left.size(); ++c) left[c] += from_left[c];
  for (std::size_t c = 0; c < right.size(); ++c) right[c] += from_right[c];
}

/// Which columns of cells are whose: first, and where shares have become unequal, each rank is
/// given as many points as the others, as far as whole columns of cells allow. Each needs so many
/// that no node is shared by three.
template <int D>
void Solver<D>::cut() {
  constexpr double unequal = 1.05;  // the largest share over the mean
  const auto columns = static_cast<std::size_t>(setup_.cells[0]);
  const auto count = static_cast<std::size_t>(ranks().count());
  if (!cuts_.empty() && !ranks().balance()) return;
  std::vector<std::int64_t> held(columns, 0);  // points of a column
  for (const std::size_t p : points_.occupied())
    ++held[static_cast<std::size_t>(points_.x[p][0] * grid_.axes[0].inverse_h)];
  ranks().sum(std::span(held));
  std::vector<std::int64_t> up_to(columns + 1, 0);
  std::partial_sum(held.begin(), held.end(), up_to.begin() + 1);
  const auto mean = static_cast<double>(up_to.back()) / static_cast<double>(count);
  if (!cuts_.empty()) {
    std::int64_t most = 0;
    for (std::size_t r = 0; r < count; ++r)
      most = std::max(most, up_to[static_cast<std::size_t>(cuts_[r + 1])] -
                                up_to[static_cast<std::size_t>(cuts_[r])]);
    if (static_cast<double>(most) <= unequal * mean) return;
  }
  const int least = 2 * box_drift + kernel_->support;
  const int begin = setup_.period ? Period::beside : 0;
  const int end = begin + (setup_.period ? setup_.period.cells : setup_.cells[0]);
  cuts_.assign(count + 1, begin);
  cuts_[count] = end;
  for (std::size_t r = 1; r < count; ++r) {
    const auto wanted = static_cast<std::int64_t>(std::llround(mean * static_cast<double>(r)));
    const auto at = std::lower_bound(up_to.begin(), up_to.end(), wanted) - up_to.begin();
    const bool before = at > 0 && wanted - up_to[static_cast<std::size_t>(at - 1)] <
                                      up_to[static_cast<std::size_t>(at)] - wanted;
    const auto left = static_cast<int>(count - r);
    cuts_[r] = std::clamp(static_cast<int>(at) - before, cuts_[r - 1] + least, end - left * least);
  }
}

/// Of a column of cells that is another rank's, whether the way there is to the left; where the
/// grid repeats, the shorter one.
template <int D>
bool Solver<D>::lies_left(int column) const {
  const int to_left = first_column() - column, to_right = column - end_column();
  const int cells = setup_.period.cells;
  return cells == 0 ? to_left > 0 : (to_left + cells) % cells <= (to_right + cells) % cells;
}

/// Points to the ranks whose cells they have come to, from neighbour to neighbour until all are
/// there. Fillers go; sorting makes others.
template <int D>
void Solver<D>::hand_over() {
  for (;;) {
    std::vector<std::uint32_t> stay, left, right;
    for (const std::size_t at : points_.occupied()) {
      const auto p = static_cast<std::uint32_t>(at);
      const int column = static_cast<int>(points_.x[p][0] * grid_.axes[0].inverse_h);
      const bool ours = column >= first_column() && column < end_column();
      (ours ? stay : lies_left(column) ? left : right).push_back(p);
    }
    if (ranks().largest(left.size() + right.size()) == 0) return;
    const auto taken_out = [&](const std::vector<std::uint32_t>& places) {
      Moving moving(points_.size(), places);
      if (!places.empty()) material_.archive(moving), body_->archive(moving);
      return moving.bytes();
    };
    const Bytes to_left = taken_out(left), to_right = taken_out(right);
    const auto counts = ranks().swap(as_bytes(left.size()), as_bytes(right.size()));
    const auto come = ranks().swap(to_left, to_right);
    Order order{std::move(stay), {}};
    put_in(order, counts.first, come.first);
    put_in(order, counts.second, come.second);
  }
}

/// Keeps the points of `order`, and puts behind them those that have come.
template <int D>
void Solver<D>::put_in(Order& order, const Bytes& count, const Bytes& come) {
  std::size_t more = 0;
  if (!count.empty()) std::memcpy(&more, count.data(), sizeof more);
  order.from.resize(order.from.size() + more, 0);
  if (order.from.empty()) order.keep_one();
  reorder(order, {[&] { body_->reorder(order.from); }});
  if (more > 0) {
    Moving moving(points_.size(), more, come);
    material_.archive(moving), body_->archive(moving);
  }
  std::iota(order.from.begin(), order.from.end(), 0u);
}

/// The box of all ranks across x; along it to all that this one gives to or takes from, which alone
/// is in memory.
template <int D>
void Solver<D>::widen_box() {
  auto& box = material_.box;
  const int own_begin = box.begin[1];
  for (int d = 1; d < dim; ++d) {
    box.begin[d] = -ranks().largest(-box.begin[d]);
    box.end[d] = ranks().largest(box.end[d]);
  }
  for (int& top : tops_) top = top > own_begin ? top : 0;
  ranks().largest(std::span(tops_));
  for (int& top : tops_) top = std::max(top, box.begin[1]);
  if (has_left()) box.begin[0] = shared_nodes(first_column()).begin;
  if (has_right()) box.end[0] = shared_nodes(end_column()).end;
  // without points there is nothing but what neighbours give to
  if (!has_left()) box.begin[0] = std::min(box.begin[0], shared_nodes(end_column()).begin);
  if (!has_right()) box.end[0] = std::max(box.end[0], shared_nodes(first_column()).end);
  show_box();
}

/// Has the nodes of the box in memory, and no others.
template <int D>
void Solver<D>::show_box() {
  const auto& box = material_.box;
  const auto stride = static_cast<std::size_t>(grid_.stride[0]);
  first_node_ = static_cast<std::size_t>(box.begin[0]) * stride;
  const auto end = static_cast<std::size_t>(box.end[0]) * stride;
  grid_.nodes.show(first_node_, end);
  if (kernel_->single) velocities_.show(first_node_, end);
}

template <int D>
void Solver<D>::fail(const SolverError& error) {
  if (!ranks().many()) throw error;
  if (!failed_) failed_ = error;
}

/// On what a step and its accounts come to over all ranks.
template <int D>
void Solver<D>::agree() {
  if (!ranks().many()) return;
  struct Told {
    EnergyLedger ledger;
    double drift, speed, points;
    Fastest fastest;
  };
  const auto points = static_cast<double>(here_);
  const auto every = ranks().all(Told{ledger_, drift_, max_speed_, points, fastest_});
  double all = 0.0, most = 0.0;
  for (const Told& one : every) all += one.points, most = std::max(most, one.points);
  unequal_ += most * ranks().count() / all, agreed_ += 1.0;
  all_ = {};
  for (const Told& one : every) {
    all_ += one.ledger;
    drift_ = std::max(drift_, one.drift), max_speed_ = std::max(max_speed_, one.speed);
    if (one.fastest.rate > fastest_.rate) fastest_ = one.fastest;
  }
}

template auto Solver<2>::shared_nodes(int) const -> Shared;
template auto Solver<3>::shared_nodes(int) const -> Shared;
template auto Solver<2>::shared_cells(int) -> Shared;
template auto Solver<3>::shared_cells(int) -> Shared;
template auto Solver<2>::counted(const std::vector<Work>&) const -> std::span<const Work>;
template auto Solver<3>::counted(const std::vector<Work>&) const -> std::span<const Work>;
template void Solver<2>::fold_ranks(Folded);
template void Solver<3>::fold_ranks(Folded);
template void Solver<2>::fold_ranks(GivingCells&) const;
template void Solver<3>::fold_ranks(GivingCells&) const;
template void Solver<2>::cut();
template void Solver<3>::cut();
template bool Solver<2>::lies_left(int) const;
template bool Solver<3>::lies_left(int) const;
template void Solver<2>::hand_over();
template void Solver<3>::hand_over();
template void Solver<2>::put_in(Order&, const Bytes&, const Bytes&);
template void Solver<3>::put_in(Order&, const Bytes&, const Bytes&);
template void Solver<2>::widen_box();
template void Solver<3>::widen_box();
template void Solver<2>::show_box();
template void Solver<3>::show_box();
template void Solver<2>::fail(const SolverError&);
template void Solver<3>::fail(const SolverError&);
template void Solver<2>::agree();
template void Solver<3>::agree();

}  // namespace grainpair
