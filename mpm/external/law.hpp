// A law of a shared library, whatever the interface it is called through.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "cases/case.hpp"
#include "mpm/external_law.h"

namespace grainpair {

/// What a law is called with: external_law.h's block, and what the older interfaces ask beside it.
struct ExternalPoints {
  grainpair_block block{};
  const double* id;                      // numbers that points keep
  const double* time;                    // at the start of the step [s]
  const double* steps;                   // done so far
  std::array<const double*, 6> total{};  // strain at the start of the step, turned [-]
  double* bulk = nullptr;                // leave the bulk modulus [Pa], or the NaN that is there
  std::array<double*, 2> counted{};      // elastic energy, and what was dissipated since the
                                         // start, as the law counts them [J/m3]
};

/// Places of xx yy zz xy yz zx among Abaqus' 11 22 33 12 13 23.
inline constexpr std::array<std::size_t, 6> abaqus_place{0, 1, 2, 3, 5, 4};

/// Numbers handed to a library, with others before and behind that it must not touch.
class Guarded {
 public:
  double* of(std::size_t size) {
    numbers_.resize(size + 2 * margin);
    for (std::size_t i = 0; i < margin; ++i) numbers_[i] = numbers_[size + margin + i] = mark;
    return numbers_.data() + margin;
  }
  bool intact() const {
    const std::size_t size = numbers_.size() - margin;
    for (std::size_t i = 0; i < margin; ++i)
      if (numbers_[i] != mark || numbers_[size + i] != mark) return false;
    return true;
  }

 private:
  static constexpr std::size_t margin = 4;
  static constexpr double mark = -1.2345678901234567e-123;
  std::vector<double> numbers_;
};

/// An external law's library, open, and the function in it.
class Library {
 public:
  Library(const Case& scene, std::initializer_list<const char*> usual_names);
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library();

  template <class Function>
  Function* function() const {
    return reinterpret_cast<Function*>(symbol_);
  }
  /// Another one of the library; null where there is none.
  void* other(const char* name) const;

 private:
  void* handle_ = nullptr;
  void* symbol_ = nullptr;
};

/// What a case says of its external law, checked.
struct ExternalConstants {
  std::vector<double> numbers;  // material.constants
  int state_count = 0;
  double cell_size;  // [m]
  std::vector<double> initial_state;
  std::size_t void_ratio_state = 0;  // from 1; 0: none of them
  bool kirchhoff, separates, serial, umat;

  explicit ExternalConstants(const Case& scene);
};

class ExternalLaw {
 public:
  virtual ~ExternalLaw() = default;
  /// Updates the points of a block as external_law.h says. 0, or 1 + the place of a point that it
  /// cannot update, with the reason in `why`.
  virtual int update(ExternalPoints& points, std::string& why) const = 0;
  /// Tangent of the point this thread updated last, in the law's own order, sign and shear strains
  /// [Pa]; null of an interface that has none.
  virtual const double* tangent() const { return nullptr; }
};

/// Of the interface that the case names.
std::unique_ptr<ExternalLaw> make_external_law(const Case& scene);
std::unique_ptr<ExternalLaw> make_umat(const Case& scene);
std::unique_ptr<ExternalLaw> make_esm(const Case& scene);
std::unique_ptr<ExternalLaw> make_block_law(const Case& scene);

}  // namespace grainpair
