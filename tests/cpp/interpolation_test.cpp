// Between points and nodes, several points at once: against sums over one point and one node at a
// time, for points that share their nodes and for points that do not.
#include "tests/cpp/interpolation_scene.hpp"

namespace grainpair {
namespace {

using namespace test;

template <class Shape>
class Interpolation : public testing::Test {};
using Shapes = testing::Types<BSpline<1>, BSpline<2>, BSpline<3>, Gimp>;
TYPED_TEST_SUITE(Interpolation, Shapes);

TYPED_TEST(Interpolation, GivesWhatEachPointAloneWould) {
  for (const std::size_t together : {4, 1})
    gives_as_alone<TypeParam, 2, Wide>(together), gives_as_alone<TypeParam, 3, Wide>(together);
}
TYPED_TEST(Interpolation, CollectsWhatEachPointAloneWould) {
  for (const std::size_t together : {4, 1})
    collects_as_alone<TypeParam, 2, Wide>(together),
        collects_as_alone<TypeParam, 3, Wide>(together);
}

}  // namespace
}  // namespace grainpair
