#include "mpm/ranks/mpi_ranks.hpp"

#include <numeric>

namespace grainpair {

namespace {

/// Lengths and places are told to MPI as int: by this many bytes at a time.
constexpr std::size_t unit = 8;

int in_units(std::size_t bytes) {
  const std::size_t units = (bytes + unit - 1) / unit;
  if (units > std::size_t{INT_MAX}) throw std::length_error("MPI: more than 16 GB in one message");
  return static_cast<int>(units);
}

std::size_t bytes_in(int units) { return unit * static_cast<std::size_t>(units); }

/// A type of `unit` bytes.
MPI_Datatype words() { return MPI_INT64_T; }

/// Whole units, of which MPI takes the number as int.
Bytes padded(std::span<const std::byte> bytes) {
  Bytes out(bytes.begin(), bytes.end());
  out.resize((bytes.size() + unit - 1) / unit * unit);
  return out;
}

}  // namespace

MpiRanks::MpiRanks(bool balance) : balance_(balance) {
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
  MPI_Comm_rank(MPI_COMM_WORLD, &here_);
  // Of two ranks each is the other's left and right neighbour: what is sent to the right first is
  // received from the left first.
  const int from[] = {left(), right()}, to[] = {right(), left()};
  MPI_Dist_graph_create_adjacent(MPI_COMM_WORLD, 2, from, MPI_UNWEIGHTED, 2, to, MPI_UNWEIGHTED,
                                 MPI_INFO_NULL, 0, &ring_);
  MPI_Comm machine;
  MPI_Comm_split_type(ring_, MPI_COMM_TYPE_SHARED, here_, MPI_INFO_NULL, &machine);
  MPI_Comm_size(machine, &on_this_machine_);
  MPI_Comm_free(&machine);
}

MpiRanks::~MpiRanks() {
  if (ring_ != MPI_COMM_NULL) MPI_Comm_free(&ring_);
}

void MpiRanks::swap(std::span<const std::byte> to_left, std::span<const std::byte> to_right,
                    std::span<std::byte> from_left, std::span<std::byte> from_right) const {
  sent_ += static_cast<double>(to_left.size() + to_right.size());
  const int sizes[] = {in_units(to_right.size()), in_units(to_left.size())};
  const int rooms[] = {in_units(from_left.size()), in_units(from_right.size())};
  const int places[] = {0, sizes[0]}, begins[] = {0, rooms[0]};
  Bytes send(bytes_in(sizes[0]) + bytes_in(sizes[1]));
  Bytes found(bytes_in(rooms[0]) + bytes_in(rooms[1]));
  std::ranges::copy(to_right, send.begin());
  std::ranges::copy(to_left, send.data() + bytes_in(sizes[0]));
  MPI_Neighbor_alltoallv(send.data(), sizes, places, words(), found.data(), rooms, begins, words(),
                         ring_);
  std::copy_n(found.data(), from_left.size(), from_left.begin());
  std::copy_n(found.data() + bytes_in(rooms[0]), from_right.size(), from_right.begin());
}

void MpiRanks::gather_all(const void* mine, void* all, std::size_t size) const {
  const int count = static_cast<int>(size);
  MPI_Allgather(mine, count, MPI_BYTE, all, count, MPI_BYTE, ring_);
}

Bytes MpiRanks::gather(std::span<const std::byte> mine) const {
  const auto sizes = all(mine.size());
  std::vector<int> counts, places;
  int end = 0;
  for (const std::size_t size : sizes) {
    counts.push_back(in_units(size)), places.push_back(end);
    end += counts.back();
  }
  Bytes found(here_ == 0 ? unit * static_cast<std::size_t>(end) : 0);
  const Bytes own = padded(mine);
  MPI_Gatherv(own.data(), in_units(mine.size()), words(), found.data(), counts.data(),
              places.data(), words(), 0, ring_);
  if (here_ != 0) return {};
  Bytes out;
  out.reserve(std::accumulate(sizes.begin(), sizes.end(), std::size_t{0}));
  for (std::size_t r = 0; r < sizes.size(); ++r) {
    const auto begin = found.begin() + static_cast<std::ptrdiff_t>(unit) * places[r];
    out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(sizes[r]));
  }
  return out;
}

}  // namespace grainpair
