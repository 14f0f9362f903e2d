// The names of the transfer schemes; what they do is in a file each.
#pragma once

namespace grainpair {

enum class TransferScheme { pic, flip, apic, affine_flip, xpic };

/// What a point carries of its surroundings' motion besides its own velocity.
enum class Affine {
  none,
  moment,   // B = sum_i w_ip v_i (X_i - x_p)^T, taken from the grid afresh [m2/s]
  gradient  // C = grad v, the point's own: the grid only changes it [1/s]
};

}  // namespace grainpair
