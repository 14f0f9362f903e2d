// Ranks over MPI. Neighbours exchange what they share by MPI's neighbourhood collectives on a ring
// of processes; sums are gathered whole, and added up by each in the same order.
#pragma once

#include <mpi.h>

#include "mpm/step/ranks.hpp"

namespace grainpair {

class MpiRanks final : public Ranks {
 public:
  /// All processes of this program; MPI has begun. `balance` as in Ranks.
  explicit MpiRanks(bool balance);
  ~MpiRanks() override;
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;

  int here() const override { return here_; }
  int count() const override { return count_; }
  int on_this_machine() const override { return on_this_machine_; }
  bool balance() const override { return balance_; }
  double sent() const override { return sent_; }
  void abandon() const override { MPI_Abort(MPI_COMM_WORLD, 3); }
  void swap(std::span<const std::byte> to_left, std::span<const std::byte> to_right,
            std::span<std::byte> from_left, std::span<std::byte> from_right) const override;
  using Ranks::swap;

 protected:
  void gather_all(const void* mine, void* all, std::size_t size) const override;
  Bytes gather(std::span<const std::byte> mine) const override;

 private:
  MPI_Comm ring_ = MPI_COMM_NULL;
  int here_ = 0, count_ = 1, on_this_machine_ = 1;
  bool balance_;
  mutable double sent_ = 0.0;  // [bytes]
};

}  // namespace grainpair
