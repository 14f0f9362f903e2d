"""How far a workflow of many jobs is: which are done, which run, how long the rest will take.

It is seen in the files alone. A job has begun when its log is new, and is done when the file that
it makes is there; so it is the same on this machine and on a cluster.
"""

import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean

from cases.stages import Stage, Told, display

INTERVAL = 0.5  # [s] between two looks
MOST = 0.95  # of a job that runs, however long it has: it is not done
NAMED = 3  # jobs that a line names


@dataclass(frozen=True)
class Members:
    """The jobs of a workflow, for whoever waits for them."""

    what: str  # they are, such as "seeds of the grains"
    files: Mapping[str, Path]  # that each makes, by the name of its log
    labels: Mapping[str, str] = field(default_factory=dict)  # what else a job is called
    seconds: Mapping[str, float] = field(default_factory=dict)  # each takes, as far as is known
    quiet: bool = False
    progress: bool = False  # say it as a program does that is watched itself


class Watch:
    """What of the members is missing, and how far that is."""

    def __init__(self, members: Members, logs: Path, began: float):
        """`logs` is the folder of <job>.log, `began` the time of the clock from which on they are
        of this call.
        """
        self.members, self.logs, self.began = members, logs, began
        self.missing = [name for name, file in members.files.items() if not file.exists()]
        self.started: dict[str, float] = {}
        self.took: dict[str, float] = {}  # [s], of those that are done

    def look(self, now: float) -> tuple[float, str]:
        """The share of what was missing that is done at the time `now`, and the state in words."""
        for name in self.missing:
            if name not in self.started and self.has_begun(name):
                self.started[name] = now
            if name not in self.took and self.members.files[name].exists():
                self.took[name] = now - self.started.get(name, now)
        running = [name for name in self.missing if name in self.started and name not in self.took]
        weights = {name: self.weight(name) for name in self.missing}
        pace = self.pace(weights)
        done = sum(weights[name] for name in self.took)
        for name in running if pace else ():
            done += weights[name] * min(MOST, (now - self.started[name]) / (pace * weights[name]))
        whole = sum(weights.values())
        return (done / whole if whole else 1.0), self.words(running)

    def has_begun(self, name: str) -> bool:
        try:
            return (self.logs / f"{name}.log").stat().st_mtime >= self.began
        except OSError:
            return False

    def weight(self, name: str) -> float:
        """Work of a job, in any unit: its estimate, or that of an average job."""
        known = self.members.seconds
        return known.get(name) or (mean(known.values()) if known else 1.0) or 1.0

    def pace(self, weights: Mapping[str, float]) -> float:
        """Seconds that a unit of work takes: as it took so far, else as estimated; 0 where nobody
        knows.
        """
        if any(self.took.values()):
            return sum(self.took.values()) / sum(weights[name] for name in self.took)
        return 1.0 if self.members.seconds else 0.0

    def words(self, running: list[str]) -> str:
        files, labels = self.members.files, self.members.labels
        there = len(files) - len(self.missing) + len(self.took)
        parts = [f"{there} of {len(files)} done"]
        if running:
            named = "; ".join(labels.get(name, name) for name in running[:NAMED])
            more = f" and {len(running) - NAMED} more" if len(running) > NAMED else ""
            parts.append(f"{'runs' if len(running) == 1 else 'run'}: {named}{more}")
        return ", ".join(parts)


@contextmanager
def shown(members: Members | None, logs: Path, began: float) -> Iterator[None]:
    """Shows how far the members are while the block makes them: a bar on a terminal, else a line
    for each tenth. Nothing where all are there.
    """
    watch = Watch(members or Members("", {}), logs, began)
    if not watch.missing:
        yield
        return
    what, quiet = watch.members.what, watch.members.quiet
    shows = Told() if watch.members.progress else display([Stage(what, [])], quiet)
    over, furthest = threading.Event(), 0.0

    def say():
        nonlocal furthest
        share, words = watch.look(time.time())
        furthest = max(furthest, share)
        shows.update(what, furthest, words)

    def go_on():
        while not over.wait(INTERVAL):
            say()
        say()  # how it ended

    follower = threading.Thread(target=go_on, daemon=True)
    say()
    follower.start()
    try:
        yield
    finally:
        over.set()
        follower.join()
        shows.close()
