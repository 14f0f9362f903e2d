// The material points: structure of arrays, plain data, kept in the order of the cells they lie in.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "mpm/numbers/arrays.hpp"

namespace grainpair {

/// Where points come from when they are put in a new order. Every run of them is filled up to whole
/// blocks (arrays.hpp) by repeats of its last: fillers, which weigh nothing and so give nothing.
struct Order {
  std::vector<std::uint32_t> from;
  std::vector<std::uint32_t> fillers;  // their places

  /// One place, of nothing, where there are no points.
  void keep_one() { from.assign(1, 0), fillers.assign(1, 0); }
  void fill_up() {
    for (const std::uint32_t last = from.back(); from.size() < whole(from.size());) {
      fillers.push_back(static_cast<std::uint32_t>(from.size()));
      from.push_back(last);
    }
  }
};

using Tasks = std::vector<std::function<void()>>;

/// field[i] <- field[order[i]]; zeros are so in any order.
template <class Field>
void reorder_field(Field& field, const Order& order) {
  if constexpr (requires { field.reorder(order.from); }) {
    field.reorder(order.from);
  } else if (std::ranges::all_of(field, [](auto x) { return x == 0; })) {
    field.resize(order.from.size());
  } else {
    Field sorted(order.from.size());
    for (std::size_t i = 0; i < order.from.size(); ++i) sorted[i] = field[order.from[i]];
    field.swap(sorted);
  }
}

/// The places of points that are no fillers: a range of numbers.
class Occupied {
 public:
  class Iterator {
   public:
    Iterator(const std::vector<double>& mass, std::size_t p) : mass_(&mass), p_(p) { skip(); }
    std::size_t operator*() const { return p_; }
    Iterator& operator++() {
      ++p_;
      skip();
      return *this;
    }
    bool operator==(const Iterator& other) const { return p_ == other.p_; }

   private:
    void skip() {
      while (p_ < mass_->size() && (*mass_)[p_] == 0.0) ++p_;
    }
    const std::vector<double>* mass_;
    std::size_t p_;
  };

  explicit Occupied(const std::vector<double>& mass) : mass_(mass) {}
  Iterator begin() const { return {mass_, 0}; }
  Iterator end() const { return {mass_, mass_.size()}; }
  std::size_t size() const {
    return mass_.size() - static_cast<std::size_t>(std::count(mass_.begin(), mass_.end(), 0.0));
  }

 private:
  const std::vector<double>& mass_;
};

/// A whole number of each point of a block.
inline void store_whole(const Wide& from, const Block& block, std::vector<std::int32_t>& to) {
  using Four [[gnu::vector_size(16), gnu::aligned(4)]] = std::int32_t;
  *reinterpret_cast<Four*>(&to[block.first]) =
      __builtin_convertvector(lanes(from), LanesOf<std::int32_t, 4>);
}

template <int Dim>
struct Points {
  static constexpr int dimension = Dim;
  template <class Real>
  using Vec = VectorOf<Dim, Real>;
  template <class Real>
  using Mat = MatrixOf<Dim, Real>;

  Arrays<Vec> x;  // position [m]
  Arrays<Vec> v;  // velocity [m/s]
  ExchangedArrays<Mat>
      affine;  // what the transfer carries: a moment or a gradient, see transfer/affine.hpp
  std::vector<double> mass;        // [kg]
  std::vector<double> void_ratio;  // e, from det F [-]
  Arrays<Tensor> sigma;            // total stress, compression positive [Pa]

  std::vector<double> fluctuation;                 // energy held [J/kg]
  std::vector<double> plastic, regime_4, contact;  // dissipated since release [J/kg]
  std::vector<double> conducted;  // fluctuation that came by conduction since release [J/kg]
  std::vector<double> granular_temperature;  // [m2/s2]
  std::vector<double> deviatoric_strain;     // accumulated sqrt(2/3 dev D : dev D) dt [-]
  std::vector<double> crowding;  // volume beyond the room there is, over that, when counted [-]
  std::vector<std::int32_t> regime;
  std::vector<std::uint32_t> id;

  std::size_t size() const { return x.size(); }  // fillers included
  bool filler(std::size_t p) const { return mass[p] == 0.0; }
  /// The places of points that are no fillers, in the order they are kept in.
  Occupied occupied() const { return Occupied(mass); }

  void resize(std::size_t n) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();  // whatever is not set shows
    x.resize(n, nan), v.resize(n), affine.resize(n), sigma.resize(n);
    for (auto* field : {&mass, &void_ratio}) field->resize(n, nan);
    for (auto* field : {&granular_temperature, &fluctuation, &plastic, &regime_4, &contact,
                        &conducted, &deviatoric_strain, &crowding})
      field->resize(n, 0.0);
    regime.resize(n, 0);
    id.resize(n);
  }

  /// point[i] <- point[order[i]]: a task for every field, which may go side by side.
  void reorder(const Order& order, Tasks& tasks) {
    const auto add = [&](auto&... fields) {
      (tasks.push_back([&] { reorder_field(fields, order); }), ...);
    };
    add(sigma, affine, x, v, void_ratio, fluctuation, plastic, regime_4, contact, conducted);
    add(granular_temperature, deviatoric_strain, crowding, regime, id);
    tasks.push_back([&] {
      reorder_field(mass, order);
      for (const auto p : order.fillers) mass[p] = 0.0;
    });
  }

  void archive(Archive& to) {
    x.archive("x", to), v.archive("v", to), affine.archive("affine", to);
    sigma.archive("sigma", to);
    to.list("mass", mass), to.list("void_ratio", void_ratio), to.list("fluctuation", fluctuation);
    to.list("plastic", plastic), to.list("regime_4", regime_4), to.list("contact", contact);
    to.list("conducted", conducted), to.list("granular_temperature", granular_temperature);
    to.list("deviatoric_strain", deviatoric_strain), to.list("crowding", crowding);
    to.list("regime", regime), to.list("id", id);
  }
};

}  // namespace grainpair
