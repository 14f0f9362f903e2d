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
  const int open = 0;  // no period
  MPI_Cart_create(MPI_COMM_WORLD, 1, &count_, &open, 0, &line_);
  MPI_Comm_rank(line_, &here_);
  MPI_Comm machine;
  MPI_Comm_split_type(line_, MPI_COMM_TYPE_SHARED, here_, MPI_INFO_NULL, &machine);
  MPI_Comm_size(machine, &on_this_machine_);
  MPI_Comm_free(&machine);
}

MpiRanks::~MpiRanks() {
  if (line_ != MPI_COMM_NULL) MPI_Comm_free(&line_);
}

void MpiRanks::swap(std::span<const std::byte> to_left, std::span<const std::byte> to_right,
                    std::span<std::byte> from_left, std::span<std::byte> from_right) const {
  Bytes send = padded(to_left);
  const int left = in_units(to_left.size()), right = in_units(to_right.size());
  const Bytes more = padded(to_right);
  send.insert(send.end(), more.begin(), more.end());
  sent_ += (has_left() ? static_cast<double>(to_left.size()) : 0.0) +
           (has_right() ? static_cast<double>(to_right.size()) : 0.0);
  const int sizes[] = {left, right}, places[] = {0, left};
  const int room_left = in_units(from_left.size()), room_right = in_units(from_right.size());
  const int rooms[] = {room_left, room_right}, begins[] = {0, room_left};
  Bytes received(unit *
                 (static_cast<std::size_t>(room_left) + static_cast<std::size_t>(room_right)));
  MPI_Neighbor_alltoallv(send.data(), sizes, places, words(), received.data(), rooms, begins,
                         words(), line_);
  std::copy_n(received.begin(), from_left.size(), from_left.begin());
  std::copy_n(received.begin() + static_cast<std::ptrdiff_t>(unit) * room_left, from_right.size(),
              from_right.begin());
}

void MpiRanks::gather_all(const void* mine, void* all, std::size_t size) const {
  const int count = static_cast<int>(size);
  MPI_Allgather(mine, count, MPI_BYTE, all, count, MPI_BYTE, line_);
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
              places.data(), words(), 0, line_);
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
