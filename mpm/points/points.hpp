// The material points: structure of arrays, plain data, kept in the order of the cells they lie in.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "mpm/numbers/columns.hpp"

namespace grainpair {

/// field[i] <- field[order[i]]
template <class Field>
void reorder_field(Field& field, const std::vector<std::uint32_t>& order) {
  Field sorted = field;
  for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = field[order[i]];
  field.swap(sorted);
}

template <int Dim>
struct Points {
  static constexpr int dimension = Dim;
  template <class Real>
  using Vec = VectorOf<Dim, Real>;
  template <class Real>
  using Mat = MatrixOf<Dim, Real>;

  Columns<Vec> x;  // position [m]
  Columns<Vec> v;  // velocity [m/s]
  ExchangedColumns<Mat>
      affine;  // what the transfer carries: a moment or a gradient, see transfer/affine.hpp
  std::vector<double> mass;        // [kg]
  std::vector<double> void_ratio;  // e, from det F [-]
  Columns<Tensor> sigma;           // total stress, compression positive [Pa]

  std::vector<double> fluctuation;           // energy held [J/kg]
  std::vector<double> plastic, collisional;  // dissipated since release [J/kg]
  std::vector<double> conducted;  // fluctuation that came by conduction since release [J/kg]
  std::vector<double> granular_temperature;  // [m2/s2]
  std::vector<double> deviatoric_strain;     // accumulated sqrt(2/3 dev D : dev D) dt [-]
  std::vector<std::int32_t> regime;
  std::vector<std::uint32_t> id;

  std::size_t size() const { return x.size(); }

  void resize(std::size_t n) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();  // whatever is not set shows
    x.resize(n, nan), v.resize(n), affine.resize(n), sigma.resize(n);
    for (auto* field : {&mass, &void_ratio}) field->resize(n, nan);
    for (auto* field : {&granular_temperature, &fluctuation, &plastic, &collisional, &conducted,
                        &deviatoric_strain})
      field->resize(n, 0.0);
    regime.resize(n, 0);
    id.resize(n);
  }

  /// point[i] <- point[order[i]] for every field.
  void reorder(const std::vector<std::uint32_t>& order) {
    const auto apply = [&](auto& field) { reorder_field(field, order); };
    x.reorder(order), v.reorder(order), affine.reorder(order), sigma.reorder(order);
    apply(mass), apply(void_ratio), apply(fluctuation), apply(plastic);
    apply(collisional), apply(conducted), apply(granular_temperature);
    apply(deviatoric_strain), apply(regime), apply(id);
  }
};

}  // namespace grainpair
