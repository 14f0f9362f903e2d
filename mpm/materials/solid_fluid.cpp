// The seed's model [Ceccato2019], as it is.
#include "mpm/materials/solid_fluid.hpp"

namespace grainpair {
namespace {

using SolidFluid = SolidFluidWith<NoContacts>;
GRAINPAIR_REGISTER_MATERIAL(SolidFluid, "solid_fluid")

}  // namespace
}  // namespace grainpair
