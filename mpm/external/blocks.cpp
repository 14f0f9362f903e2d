// Laws that are called in blocks, as external_law.h says.
#include <fmt/format.h>

#include "cases/hints.hpp"
#include "mpm/external/guard.hpp"
#include "mpm/external/law.hpp"

namespace grainpair {
namespace {

class BlockLaw final : public ExternalLaw {
 public:
  explicit BlockLaw(const Case& scene)
      : constants_(scene), library_(scene, {"grainpair_law", "grainpair_law_"}) {
    const auto version = reinterpret_cast<int (*)()>(library_.other("grainpair_law_version"));
    if (version && version() != GRAINPAIR_LAW_VERSION)
      refuse(
          scene.where("material.library"),
          "{} was compiled for version {} of external_law.h (this is version {}). Compile it anew.",
          scene.word("material.library"), version(), GRAINPAIR_LAW_VERSION);
  }

  int update(ExternalPoints& points, std::string& why) const override {
    auto& block = points.block;
    block.constant_count = static_cast<int>(constants_.numbers.size());
    block.constants = constants_.numbers.data();
    const Inside here(points.id[0]);
    const int failed =
        guarded(why, [&] { return library_.function<int(grainpair_block*)>()(&block); });
    if (failed && why.empty()) why = "the law cannot update it";
    return std::min(failed, block.size);
  }

 private:
  ExternalConstants constants_;
  Library library_;
};

}  // namespace

std::unique_ptr<ExternalLaw> make_block_law(const Case& scene) {
  return std::make_unique<BlockLaw>(scene);
}

}  // namespace grainpair
