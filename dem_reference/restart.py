"""The engine's state, and an engine that goes on from it bit for bit as the undisturbed one.

A restart of LIGGGHTS holds where its grains are and how fast, their order, and the springs of all
contacts. What a step sums up in which order also depends on its list of neighbours, which is made
every few dozen steps from where the grains are then, and on the order of the grains, which it sorts
when it makes the first list after every SORTED steps. So a state is taken at the end of such a step
and at no other: there the grains are where the list was made, in sorted order, and a list made anew
is the same. Taking it changes nothing in the run. Beside the restart a state holds

- force and torque, which a restart has not, and a set-up evaluates with other velocities than the
  step did (the springs it leaves alone);
- the bounds of the packing's box: the box grows with the grains and never falls below the bounds it
  was read with.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from .engine import Liggghts

State = dict[str, np.ndarray]  # what a checkpoint holds, by name
SORTED = 1000  # steps; LIGGGHTS' own default of atom_modify sort


def next_sort(step: int) -> int:
    """First step behind `step` from which on grains are sorted, when neighbours are listed."""
    return (step // SORTED + 1) * SORTED


@contextmanager
def in_memory(content: bytes = b"") -> Iterator[str]:
    """Name of a file of this process that needs no disk, on which an engine could fail unheard."""
    with open(os.memfd_create("restart"), "wb") as file:
        file.write(content)
        file.flush()
        yield f"/proc/self/fd/{file.fileno()}"


def state(engine: Liggghts) -> State:
    """What `resume` takes, of an engine that has just sorted its grains and listed neighbours:
    restart (bytes,), force and torque (n, 3) [N, N m], in the engine's order.
    """
    kept = {"force": engine.vectors("f").copy(), "torque": engine.vectors("torque").copy()}
    with in_memory() as path:
        engine.command(f"write_restart {path}")
        kept["restart"] = np.fromfile(path, np.uint8)
    return kept


def resume(engine: Liggghts, bounds: np.ndarray, kept: State) -> None:
    """Has an engine go on that has read a restart, and knows all that acts on its grains.

    bounds: of the packing's box, lower and upper of x, y, z [m].
    """
    walls = [
        f"{axis} final {lower:.17g} {upper:.17g}"
        for axis, (lower, upper) in zip("xyz", bounds.reshape(3, 2))
    ]
    engine.commands("atom_modify sort 0 0.0\nrun 0")  # takes up the springs; a box too large
    engine.command(f"change_box all {' '.join(walls)} units box")
    engine.commands(f"atom_modify sort {SORTED} 0.0\nrun 0")
    engine.vectors("f")[:] = kept["force"]
    engine.vectors("torque")[:] = kept["torque"]
