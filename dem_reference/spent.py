"""Processor time of a process by what it went to."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

PARTS = ("engine", "audit", "output", "setup")


def processor_seconds() -> float:
    """Of this process, all threads together. Where processor time is limited Linux tells it as of
    the last tick, but for a thread whose own clock has just been asked for.
    """
    time.thread_time()
    return time.process_time()


class Spent:
    """Seconds of processor time, all threads together: of the engine's own steps, of the audit
    (samples, lifetimes, energies), of output (frames, files), and of setup (start of the program,
    reading, first state).
    """

    def __init__(self):
        self.seconds = dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def on(self, part: str) -> Iterator[None]:
        """Counts what is done inside as a part's."""
        start = processor_seconds()
        yield
        self.seconds[part] += processor_seconds() - start

    def began(self) -> None:
        """All that the process has spent so far was setup."""
        self.seconds["setup"] = processor_seconds()

    def add(self, seconds: np.ndarray) -> None:
        """Counts what earlier parts of the run have spent, in the order of PARTS."""
        for part, more in zip(PARTS, seconds):
            self.seconds[part] += float(more)

    def attributes(self) -> dict[str, float]:
        """As a result file has them."""
        return {f"cpu_seconds_{part}": seconds for part, seconds in self.seconds.items()}
