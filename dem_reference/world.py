"""The ranks of a run, and what they tell each other: MPI by arrays of rows."""

from collections.abc import Sequence
from math import prod
from typing import Any

import numpy as np

Mpi = Any  # the module mpi4py.MPI, which only ranks import


class World:
    """All ranks, as this one sees them. Every call is one that all ranks make alike.

    A row is what lies at one place of the first axis of an array; all ranks hand in rows of one
    type and shape.
    """

    def __init__(self, mpi: Mpi):
        self.mpi, self.all = mpi, mpi.COMM_WORLD
        self.rank: int = self.all.Get_rank()
        self.size: int = self.all.Get_size()
        self._rows: dict[int, Any] = {}  # MPI's types of rows, by their bytes

    @property
    def first(self) -> bool:
        """Whether this is the rank that writes results."""
        return self.rank == 0

    def sum(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        """Sums over all ranks (n,), everywhere the same bits."""
        return self._reduced(values, self.mpi.SUM)

    def most(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        """Largest of all ranks (n,)."""
        return self._reduced(values, self.mpi.MAX)

    def _reduced(self, values: Sequence[float] | np.ndarray, by: Any) -> np.ndarray:
        own = np.ascontiguousarray(values, float)
        out = np.empty_like(own)
        self.all.Allreduce(own, out, by)
        return out

    def first_sum(self, values: np.ndarray) -> np.ndarray:
        """Sums over all ranks for the first; zeros elsewhere."""
        out = np.zeros_like(values)
        self.all.Reduce(values, out if self.first else None, self.mpi.SUM)
        return out

    def gather(self, rows: np.ndarray) -> np.ndarray:
        """Rows of all ranks, in the order of ranks, for the first; none elsewhere."""
        rows = np.ascontiguousarray(rows)
        counts = self.all.gather(len(rows))
        out = np.empty((sum(counts or [0]), *rows.shape[1:]), rows.dtype)
        kind = self._row(rows)
        self.all.Gatherv([rows, len(rows), kind], [out, counts, kind] if self.first else None)
        return out

    def everywhere(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of all ranks, in the order of ranks, and how many each has (size,)."""
        rows = np.ascontiguousarray(rows)
        counts = np.array(self.all.allgather(len(rows)))
        out = np.empty((counts.sum(), *rows.shape[1:]), rows.dtype)
        kind = self._row(rows)
        self.all.Allgatherv([rows, len(rows), kind], [out, counts.tolist(), kind])
        return out, counts

    def counts(self, to: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of rows for the ranks `to` (n,): how many go to each rank, and come from each."""
        going = np.bincount(to, minlength=self.size).astype(np.int32)
        coming = np.empty_like(going)
        self.all.Alltoall(going, coming)
        return going, coming

    def swap(self, rows: np.ndarray, going: np.ndarray, coming: np.ndarray) -> np.ndarray:
        """Hands rows, sorted by the ranks that they are for, to these; what has come, sorted by the
        ranks that it came from.
        """
        rows = np.ascontiguousarray(rows)
        out = np.empty((int(coming.sum()), *rows.shape[1:]), rows.dtype)
        kind = self._row(rows)
        self.all.Alltoallv(
            [rows, (going, starts(going)), kind], [out, (coming, starts(coming)), kind]
        )
        return out

    def _row(self, rows: np.ndarray) -> Any:
        size = rows.dtype.itemsize * prod(rows.shape[1:])
        if size not in self._rows:
            self._rows[size] = self.mpi.BYTE.Create_contiguous(size).Commit()
        return self._rows[size]


def starts(counts: np.ndarray) -> np.ndarray:
    """Where each rank's rows begin."""
    return np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int32)
