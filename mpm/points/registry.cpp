#include "mpm/points/body.hpp"

namespace grainpair {

std::map<std::string, BodyFactory>& material_registry() {
  static std::map<std::string, BodyFactory> registry;
  return registry;
}

}  // namespace grainpair
