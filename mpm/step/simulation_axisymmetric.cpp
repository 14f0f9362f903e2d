#include "mpm/step/simulation_setup.hpp"

namespace grainpair {

template std::unique_ptr<Simulation> make_column<Axisymmetric>(const Case&, const Numerics&,
                                                               const Start&);

}  // namespace grainpair
