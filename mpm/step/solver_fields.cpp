// What points share over the nodes beside their motion: granular temperature.
#include "mpm/step/solver.hpp"

namespace grainpair {

/// Granular temperature flows, q = -kappa grad T, between the points and through no wall:
///   T_i = sum_p w_ip m_p T_p / m_i,  m_i de_i = dt sum_p V_p grad w_ip . q_p,
///   de_p = sum_i w_ip de_i  [J/kg].
/// The functions' slopes cancel at every point, so that nothing is gained or lost; where a point is
/// asked for more than it holds, what that creates is booked. Explicit, in sub-steps of half the
/// largest stable, 3/2 rho h^2/(4 dim kappa).
template <int D>
void Solver<D>::conduct(double dt) {
  const double h = setup_.numerics.h;
  scratch_.resize(points_.size());
  std::vector<double> rates(strips_.size());  // kappa/rho [m2/s]
  for_each_strip([&](std::size_t s) {
    for_each_point_of(strips_[s], [&](std::size_t p) {
      scratch_[p] = body_->conductivity(p, points_.void_ratio[p]) * material_.volume(p);
      rates[s] = std::max(rates[s], scratch_[p] / points_.mass[p]);
    });
  });
  const double fastest =
      ranks().largest(rates.empty() ? 0.0 : *std::max_element(rates.begin(), rates.end()));
  const auto rounds = static_cast<long>(std::ceil(dt * fastest * 4.0 * dim / (0.5 * 1.5 * h * h)));
  for (long round = 0; round < rounds; ++round) {
    for_each_slice([&](int i) { clear_nodes(i); });
    for_each_point([&](std::size_t p) {
      const double m = points_.mass[p];
      for_each_weight(p, [&](Node<dim>& node, double w) {
        node.mass += w * m;
        node.motion[0] += w * m * points_.granular_temperature[p];
      });
    });
    fold(Folded::momenta);
    for_each_point([&](std::size_t p) {
      Vec flux = Vec::Zero();  // times volume and time [J m]
      for_each_weight(p, [&](const Node<dim>& node, double, const Vec& slope) {
        flux -= node.motion[0] / node.mass * slope;
      });
      flux *= scratch_[p] * dt / static_cast<double>(rounds);
      for_each_weight(
          p, [&](Node<dim>& node, double, const Vec& slope) { node.change[0] += slope.dot(flux); });
    });
    fold(Folded::changes);
    struct Moved {
      double gained = 0.0, conducted = 0.0;  // [J]
    };
    std::vector<Moved> sums(strips_.size());
    for_each_strip([&](std::size_t s) {
      for_each_point_of(strips_[s], [&](std::size_t p) {
        double energy = 0.0;
        for_each_weight(
            p, [&](const Node<dim>& node, double w) { energy += w * node.change[0] / node.mass; });
        points_.granular_temperature[p] = body_->heat(p, energy);
        const double held = 1.5 * points_.granular_temperature[p],
                     change = held - points_.fluctuation[p];
        points_.fluctuation[p] = held;
        points_.conducted[p] += change;
        sums[s].gained += points_.mass[p] * change;
        sums[s].conducted += points_.mass[p] * std::max(change, 0.0);
      });
    });
    double conducted = 0.0, gained = 0.0;
    for (const Moved& s : sums) gained += s.gained, conducted += s.conducted;
    ledger_.fluctuation += gained;
    ledger_.conduction -= gained;
    ledger_.conducted += conducted;
  }
}

template class Solver<2>;
template class Solver<3>;

}  // namespace grainpair
