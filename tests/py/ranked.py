"""Work on ranks that goes wrong, each in its way; ranks import it by its full name."""

import os
import signal
import time
from itertools import cycle

from cases.errors import CaseError
from dem_reference import border, shared
from dem_reference.grains import Grains
from dem_reference.moment import VECTORS


def put(whose, name: str, other) -> None:
    """Puts something else in the place of what a class or module has, of this process."""
    setattr(whose, name, other)


def wandering(world, *about):
    """A collapse in which the cut along x goes to and fro all the time: a tenth of the column."""
    places = cycle([0.0095, 0.0115])
    put(shared.SharedColumn, "is_uneven", lambda column: True)
    put(shared.SharedColumn, "rebalance", lambda column: column.cut(next(places)))
    shared.collapse(world, *about)


def lopsided(world, *about):
    """A collapse in which nobody moves the cut to where the grains are."""
    put(shared.SharedColumn, "rebalance", lambda column: None)
    shared.collapse(world, *about)


def unhanded(world, *about):
    """The first one, but what is carried of contacts stays behind when their grains move on."""

    def stays(accounts) -> None:
        accounts.leave(accounts.border.owners, world.rank)

    put(shared.SharedAccounts, "hand_over", stays)
    wandering(world, *about)


def forceless(world, *about):
    """A collapse in which grains are handed over a border without what acts on them."""
    told = border.states

    def states(atoms, places):
        rows = told(atoms, places)
        for k in (VECTORS.index("f"), VECTORS.index("torque")):
            rows[:, 2 + 3 * k : 5 + 3 * k] = 0.0
        return rows

    put(border, "states", states)
    shared.collapse(world, *about)


def refusing(world, _voice):
    if world.rank == 1:
        raise CaseError("x: one rank of all has found this")
    time.sleep(60.0)


def dying(world, _voice):
    if world.rank == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(60.0)


def counting(world, add, _voice):
    """Sum of the ranks' numbers, and `add`."""
    return float(world.sum([world.rank])[0]) + add


def misspelling(world, folder, _voice):
    """A command that the engine does not know."""
    grains = Grains(2e-3, 2500.0, 5e6, 0.3, 0.88, 0.5)
    border.SharedLiggghts(folder / "log", grains, world).command("no_such_word")
