// Constants of a law that the grains determine: derived where nobody gives them, and warned of
// where what is given contradicts the grains of the case.
#pragma once

#include <string>
#include <vector>

#include "cases/check.hpp"
#include "cases/values.hpp"

namespace grainpair {

/// A material card as its file has it: what it gives of [material], and in [grains], where it has
/// that, the grains that it was fitted to.
struct Card {
  std::string name;
  GivenValues constants, grains;
};

/// Effective restitution of frictional grains [Jenkins2002], for kinetic theory to dissipate by:
/// normal restitution, friction, and the tangential restitution beta_0 of sticking collisions [-].
/// An expansion for nearly elastic grains: below a restitution of 0.4 it may be negative.
double effective_restitution(double en, double mu, double beta_0);

/// material.effective_restitution = 0 becomes the derived value, at least 0.
void derive_constants(Values& scene);

/// One line for each constant that contradicts the grains of the scene: `where: problem (why)
/// hint`. Only constants that the law reads count.
std::vector<std::string> contradictions(const Values& scene, const Card& card);

}  // namespace grainpair
