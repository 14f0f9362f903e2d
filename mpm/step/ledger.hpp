// Where every joule is. Held: kinetic, potential, stored, fluctuation. Gone for a physical reason:
// plastic, regime_4, contact, wall. Gone, or come, for a numerical one, each on its own account:
// transfer, time_integration, mixing of void ratios, detached, conduction (what it creates where a
// point has less to give than it is asked for).
//
// The sum is constant by construction (each stage books the difference it makes), so closing proves
// only the bookkeeping; what each account holds is checked against an independent figure in
// tests/cpp/ledger_test.cpp.
#pragma once

namespace grainpair {

struct EnergyLedger {  // [J]
  double kinetic = 0.0, potential = 0.0, stored = 0.0, fluctuation = 0.0;
  double plastic = 0.0, regime_4 = 0.0, contact = 0.0, wall = 0.0;
  double transfer = 0.0, time_integration = 0.0, mixing = 0.0, detached = 0.0, conduction = 0.0;

  // Of a chute: potential energy along the slope, which falls for ever; what it has lost is the
  // work of gravity along the slope.
  double slope = 0.0;

  double conducted = 0.0;  // passed from point to point; part of no sum

  EnergyLedger& operator+=(const EnergyLedger& more) {
    kinetic += more.kinetic, potential += more.potential, stored += more.stored;
    fluctuation += more.fluctuation, plastic += more.plastic, regime_4 += more.regime_4;
    contact += more.contact, wall += more.wall, transfer += more.transfer;
    time_integration += more.time_integration, mixing += more.mixing, detached += more.detached;
    conduction += more.conduction, slope += more.slope, conducted += more.conducted;
    return *this;
  }

  double held() const { return kinetic + potential + stored + fluctuation; }
  double dissipated() const { return plastic + regime_4 + contact + wall; }
  double numerical() const { return transfer + time_integration + mixing + detached + conduction; }
  double total() const { return held() + dissipated() + numerical() + slope; }
};

}  // namespace grainpair
