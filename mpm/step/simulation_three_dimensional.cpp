#include "mpm/step/simulation_setup.hpp"

namespace grainpair {

template std::unique_ptr<Simulation> make_column<ThreeDimensional>(const Case&, const Numerics&,
                                                                   const Start&);

}  // namespace grainpair
