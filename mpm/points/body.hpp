// A body: every point's constitutive state, and what updates it. One virtual call per batch or
// strip of points, never one per point; BodyOf<Law> (materials/body_of.hpp) is the loop for one
// law.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "mpm/points/material_points.hpp"

namespace grainpair {

/// What the first `size` points bring to an update and take away.
struct Batch {
  explicit Batch(std::size_t most, bool with_work = true)
      : size(most),
        steps(most),
        sigma(most),
        energies(most),
        work(with_work ? most : 0),
        granular_temperature(most),
        collisional_pressure(most),
        stability(most),
        regime(most) {}

  std::size_t size;
  bool in_plane = false;  // no motion, no stress across it: of tensors, yz and zx are zero, and of
                          // spins all but z
  Arrays<DeformationOf> steps;
  Arrays<Tensor> sigma;         // [Pa]
  Arrays<EnergiesOf> energies;  // [J/kg]; what is dissipated is of this step alone
  std::vector<double> work;     // [J/kg] stress work of this step, if it has room for it
  std::vector<double> granular_temperature;  // [m2/s2]
  std::vector<double> collisional_pressure;  // [Pa]
  Arrays<StabilityOf> stability;
  std::vector<std::int32_t> regime;  // before the update that of the last step
};

class Body {
 public:
  virtual ~Body() = default;
  virtual void resize(std::size_t points) = 0;
  virtual void initialise(std::size_t first, std::span<const InitialState> initial,
                          Batch& batch) = 0;
  /// Updates points first .. first + batch.size - 1.
  virtual void update(std::size_t first, Batch& batch) = 0;
  /// The points of a strip from their velocity gradient to their new place, with what that does to
  /// the sums.
  virtual void advance(MaterialPoints<2>& points, const CellsOfStep& cells, const Strip& strip,
                       PointSums& sums) = 0;
  virtual void advance(MaterialPoints<3>& points, const CellsOfStep& cells, const Strip& strip,
                       PointSums& sums) = 0;
  /// Throws SolverError where a law could not answer since the last call; a sweep of threads that
  /// wait for each other cannot.
  virtual void check() {}
  /// state[i] <- state[order[i]]; called whenever the solver reorders its points.
  virtual void reorder(std::span<const std::uint32_t> order) = 0;
  /// Every point's state.
  virtual void archive(Archive& to) = 0;
  /// Whether grains may have a granular temperature, dissipate in regime 4, or be viscous.
  virtual bool fluctuates() const = 0;
  /// Whether elastic and plastic energy are figures of the law's own.
  virtual bool tells_energies() const { return true; }
  /// Of granular temperature [Pa s]; 0 for a law without.
  virtual double conductivity(std::size_t point, double void_ratio) const = 0;
  /// Adds to a point's fluctuations, as far as they do not become negative [J/kg]; gives its
  /// granular temperature [m2/s2].
  virtual double heat(std::size_t point, double energy) = 0;
  /// The quasi-static part of a point's stress sigma at void ratio e; all of it for a law without
  /// collisions [Pa].
  virtual SymTensor quasi_static_stress(std::size_t point, const SymTensor& sigma,
                                        double e) const = 0;
};

using BodyFactory = std::function<std::unique_ptr<Body>(const Case&)>;

/// Laws by name. Filled by GRAINPAIR_REGISTER_MATERIAL at start-up.
std::map<std::string, BodyFactory>& material_registry();

}  // namespace grainpair
