"""Dissipation split by how long a contact lasts.

A collision is a short contact of two grains, friction within the bed an enduring one. Sampled every
few steps, a contact seen in k successive samples has lasted k sampling intervals, give or take one;
its dissipation so far counts as short until its age passes the threshold.

A contact's account takes in either its sampled dissipation, or, sampled at every step, the work
done on it; what it holds as elastic energy then has to be taken off (`held`), all of which is back
when the contact ends.
"""

import numpy as np

# Lifetimes [binary contact times] at which the final split is kept, so that its dependence on the
# threshold is seen.
EDGES = np.array([0.5, 1, 1.5, 2, 3, 4, 6, 8, 10, 15, 20, 30, 50, 100])
# Thresholds, as multiples of the case's own, whose split is kept over time.
MULTIPLES = np.array([0.5, 1.0, 2.0, 4.0])


class Lifetimes:
    """Ages and dissipation of the contacts, carried from sample to sample by the pair of ids."""

    def __init__(self, interval: float, unit: float, threshold: float):
        """interval: time between samples [s]; unit: binary contact time [s]; threshold in units."""
        self.interval, self.unit = interval, unit
        self.thresholds = threshold * MULTIPLES
        self._key = np.empty(0, dtype=np.int64)
        self._age = np.empty(0)  # [units]
        self._account = np.empty((0, 2))  # taken in by each contact so far: normal, tangential [J]
        self._held = np.empty((0, 2))  # of it: elastic [J]
        self._ended_enduring = np.zeros(
            self.thresholds.size
        )  # by ended contacts older than each threshold [J]
        self.heat_by_lifetime = np.zeros(
            (EDGES.size + 1, 2)
        )  # of ended contacts, per lifetime class [J]
        self.count_by_lifetime = np.zeros(EDGES.size + 1, dtype=np.int64)

    @staticmethod
    def _keys(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.minimum(first, second) << 32 | np.maximum(first, second)

    def begin(self, first: np.ndarray, second: np.ndarray, held: np.ndarray) -> None:
        """Contacts that stand at the release are enduring, whatever follows; `held` as in add."""
        key = self._keys(first, second)
        order = np.argsort(key)
        self._key, self._age = key[order], np.full(key.size, np.inf)
        self._account, self._held = held[order].copy(), held[order]

    def add(
        self, first: np.ndarray, second: np.ndarray, intake: np.ndarray, held: np.ndarray
    ) -> None:
        """One sample: ids of the pairs in contact, (n,), and their energies, (n, 2) [J].

        intake: what each took in during the interval; held: what of its account it holds.
        """
        key = self._keys(first, second)
        order = np.argsort(key)
        key, account = key[order], intake[order]
        age = np.zeros(key.size)
        if self._key.size:
            at = np.minimum(np.searchsorted(self._key, key), self._key.size - 1)
            known = self._key[at] == key
            age[known] = self._age[at[known]]
            account[known] += self._account[at[known]]
            ended = np.ones(self._key.size, dtype=bool)
            ended[at[known]] = False
            self._book(self._age[ended], self._account[ended])
        self._key, self._age, self._account, self._held = (
            key,
            age + self.interval / self.unit,
            account,
            held[order],
        )

    def _book(self, age: np.ndarray, heat: np.ndarray) -> None:
        self._ended_enduring += self._enduring(age, heat)
        bins = np.searchsorted(EDGES, age)
        for k in (0, 1):
            self.heat_by_lifetime[:, k] += np.bincount(bins, heat[:, k], EDGES.size + 1)
        self.count_by_lifetime += np.bincount(bins, minlength=EDGES.size + 1)

    def _enduring(self, age: np.ndarray, heat: np.ndarray) -> np.ndarray:
        return np.where(age[:, None] > self.thresholds, heat.sum(axis=1)[:, None], 0.0).sum(axis=0)

    def enduring(self) -> np.ndarray:
        """Dissipated since the release by contacts older than each threshold (4,) [J]."""
        return self._ended_enduring + self._enduring(self._age, self._account - self._held)

    def finish(self) -> None:
        """The contacts still standing at the end go to the class of their age."""
        self._book(self._age, self._account - self._held)
        nobody = np.empty(0, dtype=np.int64)
        self.begin(nobody, nobody, np.empty((0, 2)))
