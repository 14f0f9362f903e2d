"""What a run that was killed goes on from: checkpoints, and the frames between them.

While a result X.h5 is made, `X.h5.unfinished` beside it holds the frames up to the last checkpoint
in segments, `frames-1.h5`, `frames-2.h5`, ..., and the two newest checkpoints,
`checkpoint-<step>.h5`. Each of them is on the disk before it gets its name, so none is ever half
there. A checkpoint tells by its attribute `key` what decides its run (content.run_key), and how
many segments belong to it; whatever is in the folder beside is of no use.
"""

import datetime
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from cases import room
from cases.errors import printable
from cases.h5_output import H5Output
from cases.scratch import reason

from .process import Voice, fails_again

NEWEST = 2  # checkpoints that are kept
PART = "part"  # of a checkpoint that has no name yet


@dataclass(frozen=True)
class Unfinished:
    """The folder of a result that is not complete, for the process that owns the result."""

    result: Path  # as the user named it
    folder: Path  # wherever a process works
    key: str
    interval: float  # of the clock, between checkpoints [s]; 0: none

    @classmethod
    def of(cls, result: Path, key: str = "", interval: float = 0.0) -> "Unfinished":
        """Of a result as it is called where this process works now."""
        place = result.absolute().with_name(f"{result.name}.unfinished")
        return cls(result, place, key, interval)

    def segment(self, number: int) -> Path:
        return self.folder / f"frames-{number}.h5"

    def checkpoint(self, step: int) -> Path:
        return self.folder / f"checkpoint-{step}.h5"

    def checkpoints(self) -> list[Path]:
        """From the newest to the oldest."""
        found = [path for path in self.folder.glob("checkpoint-*.h5") if path.stem[11:].isdigit()]
        return sorted(found, key=lambda path: -int(path.stem[11:]))

    def newest(self) -> dict[str, np.ndarray] | None:
        """The newest checkpoint of this run that can be read, if there is one. Whatever else is in
        the folder goes.
        """
        for path in self.checkpoints():
            state = self.read(path)
            if state is not None:
                self.remove(but=int(state["step"]), segments=int(state["segments"]))
                return state
        self.remove()
        return None

    def read(self, path: Path) -> dict[str, np.ndarray] | None:
        """A checkpoint with all its segments; None where it is another run's, or cannot be read."""
        try:
            with h5py.File(path) as file:
                if file.attrs["key"] != self.key:
                    return None
                state = {name: values[()] for name, values in file.items()}
            for number in range(1, int(state["segments"]) + 1):
                h5py.File(self.segment(number)).close()
        except (OSError, KeyError, RuntimeError):
            return None
        return state

    def remove(self, but: int | None = None, segments: int = 0) -> None:
        """Removes the folder, or all in it but a checkpoint and its segments; never what is not
        ours.
        """
        kept = [self.segment(number + 1) for number in range(segments)]
        if but is not None:
            kept += [path for path in self.checkpoints() if int(path.stem[11:]) <= but]
        for pattern in ("frames-*.h5", "checkpoint-*.h5", PART):
            for path in self.folder.glob(pattern):
                if path not in kept:
                    path.unlink()
        if not kept:
            try:
                self.folder.rmdir()
            except OSError:  # not there, or something else in it
                pass

    def goes_on(self, state: dict[str, np.ndarray]) -> str:
        """A line that says where a run goes on."""
        kept = datetime.datetime.fromtimestamp(float(state["date"])).strftime("%Y-%m-%d %H:%M:%S")
        return f"{self.result}: goes on from t = {state['time']:.4g} s, which was kept at {kept}"

    @contextmanager
    def until_done(self) -> Iterator[dict[str, np.ndarray] | None]:
        """The checkpoint that the run is to go on from, if there is one. Where the block fails by
        an error of its own the folder goes; where it is interrupted, or the disk is full, a folder
        with a checkpoint stays.
        """
        state = self.newest()
        if state is not None:
            print(printable(self.goes_on(state)), file=sys.stderr, flush=True)
        try:
            yield state
        except BaseException as error:
            if fails_again(error) or not self.checkpoints():
                self.remove()
            raise


class Keeper:
    """Keeps checkpoints of a run, in the process that runs it."""

    def __init__(self, unfinished: Unfinished, segments: int, voice: Voice):
        """segments: those that are there already."""
        self.unfinished, self.segments, self.voice = unfinished, segments, voice
        self.last, self.warned = time.monotonic(), False

    def due(self) -> bool:
        interval = self.unfinished.interval
        return interval > 0 and time.monotonic() - self.last >= interval

    def take_frames(self, part: Path) -> None:
        """A complete file of frames becomes the next segment. Raises OSError."""
        self.unfinished.folder.mkdir(exist_ok=True)
        room.settle(part)
        os.replace(part, self.unfinished.segment(self.segments + 1))
        self.segments += 1

    def keep(self, step: int, state: dict[str, np.ndarray]) -> None:
        """A checkpoint after `step`; where there is no room for it the run goes on without."""
        self.last = time.monotonic()
        try:
            self.write(step, state)
        except OSError as error:
            (self.unfinished.folder / PART).unlink(missing_ok=True)
            if not room.is_full(error):
                raise
            if not self.warned:
                self.voice.warn(
                    f"{self.unfinished.result}: no checkpoint ({reason(error)}) the run goes on"
                )
            self.warned = True

    def write(self, step: int, state: dict[str, np.ndarray]) -> None:
        ours, folder = self.unfinished, self.unfinished.folder
        folder.mkdir(exist_ok=True)
        with H5Output(folder / PART) as file:
            file.attrs["key"] = ours.key
            told = {"step": step, "segments": self.segments, "date": time.time()}
            for name, values in (state | told).items():
                # a checksum tells bytes that have changed; HDF5 has none of single values
                checked = {"fletcher32": True} if np.ndim(values) and np.size(values) else {}
                file.create_dataset(name, data=values, **checked)
        room.settle(folder / PART)
        os.replace(folder / PART, ours.checkpoint(step))
        room.settle(folder)  # the names in it
        for old in ours.checkpoints()[NEWEST:]:
            old.unlink()

    def merge(self, file: h5py.File) -> None:
        """Puts the frames of all segments into the result, as they are. Raises OSError."""
        frames = file.require_group("data")
        for number in range(1, self.segments + 1):
            with h5py.File(self.unfinished.segment(number)) as part:
                for step in part["data"]:
                    part.copy(part["data"][step], frames, name=step)
