// Averages over the frames of a steady flow: what is conserved, and stresses, are summed over the
// frames, and all else follows from the means.
//
//   velocity               <rho V> / <rho>, so it carries the mean momentum
//   velocity gradient      of one affine fit to all frames, each about its own mean
//   granular temperature   sum over frames of the squared residuals about each frame's own affine
//                          fit over the sum of what they hold of independent fluctuations: pooled
//                          over frames, each about its own mean. A mean motion that changes from
//                          frame to frame so counts as no heat; what it carries is
//   mean fluctuation       <rho (V_f - V) (V_f - V)>, a stress of its own. It also holds what the
//                          thermal motion of few grains leaves in a frame's mean, rho T over the
//                          effective number of one frame. contact + kinetic + mean fluctuation is
//                          the momentum flux of the averaged flow: its divergence balances weight
//                          and walls.
#pragma once

#include <vector>

#include "compare/mapping/coarse_grain.hpp"

namespace grainpair {

/// Sums over frames in one cell.
template <int D>
struct CellSums {
  double solid = 0.0, w = 0.0, w2 = 0.0;  // sum V phi, sum m phi, sum (m phi)^2
  Vec3 v = Vec3::Zero();                  // sum m v phi
  // Of place and velocity with place, each frame about its own mean.
  Eigen::Matrix<double, D, D> xx = Eigen::Matrix<double, D, D>::Zero();
  Eigen::Matrix<double, 3, D> vx = Eigen::Matrix<double, 3, D>::Zero();
  Mat3 kinetic = Mat3::Zero(), flux = Mat3::Zero();  // of the frames; rho V V of their means
  // Quotients: residual over freedom of the fits, by mass and by number; two-step; rotation;
  // grains.
  std::array<double, 2> by_mass{}, by_number{}, two_step{}, rotation{}, contacts{};
};

/// What the material points know, summed in one cell.
struct StateSums {
  double solid = 0.0, mass = 0.0, void_ratio = 0.0, temperature = 0.0;
  Mat3 stress = Mat3::Zero();
};

template <int D>
struct FrameSums {
  explicit FrameSums(const SampleGrid<D>& part) : grid(part), cells(part.size()) {}

  SampleGrid<D> grid;  // the part that the sums are of
  double frames = 0.0;
  bool several = false, spins = false, dissipates = false;
  std::vector<CellSums<D>> cells;
  // Of what has contacts; of material points. Empty otherwise.
  std::vector<Eigen::Matrix<double, 19, 1>> along;
  std::vector<Eigen::Vector4d> at;
  std::vector<StateSums> state;
  double frames_with_contacts = 0.0;
  std::vector<std::string> untold;  // of any frame
};

/// Adds a frame. `fluctuation`: of `fluctuations`.
template <int D>
void average_frame(FrameSums<D>& sums, const Cloud& cloud, const Kernel<D>& kernel,
                   const std::vector<double>& fluctuation);
/// The fields of the averaged flow, by the names of a frame's, and `mean_fluctuation_stress`.
template <int D>
Fields average_fields(const FrameSums<D>& sums, const Grain& grain);

#define GRAINPAIR_AVERAGES(D)                                                                    \
  template <>                                                                                    \
  void average_frame(FrameSums<D>&, const Cloud&, const Kernel<D>&, const std::vector<double>&); \
  template <>                                                                                    \
  Fields average_fields(const FrameSums<D>&, const Grain&);
GRAINPAIR_AVERAGES(1)
GRAINPAIR_AVERAGES(2)
GRAINPAIR_AVERAGES(3)
#undef GRAINPAIR_AVERAGES

}  // namespace grainpair
