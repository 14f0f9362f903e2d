// What it costs to bring the nodes at a border of ranks together: by PETSc's DMDA, which knows the
// whole grid, and by a neighbourhood collective over the slices that two ranks share. No part of
// the build:
//     mpicxx -O2 mpm/bench/petsc_exchange.cpp $(pkg-config --cflags --libs petsc) -o exchange
//     mpirun -np 2 ./exchange
// The grid is that of 1.04 million points, eight in a cell. Prints milliseconds of processor time.
#include <petscdmda.h>

#include <cstdio>
#include <cstring>
#include <ctime>
#include <vector>

namespace {

constexpr int along = 104, high = 104, across = 16;  // nodes
constexpr int numbers = 7;                           // of a node: mass, momentum, force
constexpr int beside = 4, shared = 6;                // slices: of DMDA's stencil, at a border
constexpr int rounds = 200;

struct alignas(64) Node {
  double own[8];
};

double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <class F>
double milliseconds(F&& round) {
  MPI_Barrier(PETSC_COMM_WORLD);
  const double begin = processor_seconds();
  for (int r = 0; r < rounds; ++r) round();
  return 1e3 * (processor_seconds() - begin) / rounds;
}

}  // namespace

int main(int argc, char** argv) {
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  int rank = 0, size = 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  DM grid;
  DMDACreate3d(PETSC_COMM_WORLD, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE,
               DMDA_STENCIL_BOX, across, high, along, 1, 1, size, numbers, beside, nullptr, nullptr,
               nullptr, &grid);
  DMSetUp(grid);
  Vec whole, local;
  DMCreateGlobalVector(grid, &whole);
  DMCreateLocalVector(grid, &local);
  PetscInt length = 0;
  VecGetLocalSize(local, &length);
  std::vector<Node> nodes(static_cast<std::size_t>(length / numbers), Node{});

  const double petsc = milliseconds([&] {
    PetscScalar* to = nullptr;
    VecGetArray(local, &to);
    for (const Node& node : nodes)
      std::memcpy(to, node.own, numbers * sizeof(double)), to += numbers;
    VecRestoreArray(local, nullptr);
    VecSet(whole, 0.0);
    DMLocalToGlobal(grid, local, ADD_VALUES, whole);
    DMGlobalToLocal(grid, whole, INSERT_VALUES, local);
    const PetscScalar* from = nullptr;
    VecGetArrayRead(local, &from);
    for (Node& node : nodes) std::memcpy(node.own, from, numbers * sizeof(double)), from += numbers;
    VecRestoreArrayRead(local, nullptr);
  });

  MPI_Comm line;
  const int open = 0;
  MPI_Cart_create(PETSC_COMM_WORLD, 1, &size, &open, 0, &line);
  constexpr std::size_t count = std::size_t{shared} * high * across;
  const bool left = rank > 0, right = rank + 1 < size;
  Node* const border = &nodes[left ? 0 : nodes.size() - count];
  std::vector<double> to(count * numbers), from(count * numbers);
  const int all = static_cast<int>(to.size());
  const int sizes[] = {left ? all : 0, right && !left ? all : 0}, places[] = {0, 0};
  const double ours = milliseconds([&] {
    for (std::size_t k = 0; k < count; ++k)
      std::memcpy(&to[k * numbers], border[k].own, numbers * sizeof(double));
    MPI_Neighbor_alltoallv(to.data(), sizes, places, MPI_DOUBLE, from.data(), sizes, places,
                           MPI_DOUBLE, line);
    for (std::size_t k = 0; k < count; ++k)
      for (std::size_t n = 0; n < numbers; ++n) border[k].own[n] += from[k * numbers + n];
  });
  std::printf("rank %d of %d: DMDA %.3f ms, neighbourhood collective %.3f ms\n", rank, size, petsc,
              ours);
  PetscFinalize();
}
