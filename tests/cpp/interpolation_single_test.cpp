// Between points and nodes in single precision, eight points at once.
#include "tests/cpp/interpolation_scene.hpp"

namespace grainpair {
namespace {

using namespace test;

template <class Shape>
class SinglePrecision : public testing::Test {};
using Splines = testing::Types<BSpline<1>, BSpline<2>, BSpline<3>>;
TYPED_TEST_SUITE(SinglePrecision, Splines);

// all in one cell, each half in one, none with another
TYPED_TEST(SinglePrecision, GivesWhatEachPointAloneWould) {
  for (const std::size_t together : {8, 4, 1})
    gives_as_alone<TypeParam, 2, WideFloat>(together),
        gives_as_alone<TypeParam, 3, WideFloat>(together);
}
TYPED_TEST(SinglePrecision, CollectsWhatEachPointAloneWould) {
  for (const std::size_t together : {8, 4, 1})
    collects_as_alone<TypeParam, 2, WideFloat>(together),
        collects_as_alone<TypeParam, 3, WideFloat>(together);
}

}  // namespace
}  // namespace grainpair
