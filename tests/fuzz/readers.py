"""Every reader of Python that takes a file of somebody else, with small good files of its kind.

A reader gives what is in a file or raises CaseError, in one line, within a second; anything else is
a fault: another exception, a warning of a library, memory without bounds.
"""

import bz2
import gzip
import lzma
import random
import resource
import time
import traceback
import warnings
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import zstandard

from cases import case
from cases.errors import CaseError
from compare.element.library import LibraryCard
from compare.importing import compressed, registry
from compare.importing.frame import Frame
from compare.mapping.clouds import open_grains
from compare.mapping.contacts import base_friction, largest_overlap
from compare.mapping.runs import open_run
from compare.study import reference
from compare.verdict import packings
from dem_reference.content import inputs
from tests.fuzz import seeds
from tests.fuzz.mutate import mutated
from tests.fuzz.spoil import spoil

SECOND = 1.0  # of work that an execution may take [s]
ROOM = 3 << 30  # of addresses beyond what the program has [bytes]


@dataclass(frozen=True)
class Target:
    """What is called with a file, and good files for it by name; `text`, or bytes, or HDF5."""

    read: Callable[[Path], object]
    files: dict[str, bytes]
    kind: str = "text"  # | "bytes" | "hdf5"


@dataclass
class Fault:
    what: str
    name: str
    data: bytes = field(repr=False)


def frames_of(name: str, **options) -> Callable[[Path], object]:
    """All frames of a reader of the importing, whose columns agree in their length."""
    reader = registry.readers()[name]

    def read(path: Path):
        reader.recognises(path, compressed.head(path, registry.HEAD))
        for one in reader.frames(path, dict(options)):
            check(one)

    return read


def check(frame: Frame):
    for table in (frame.columns, frame.contacts or {}):
        assert len({len(values) for values in table.values()}) <= 1, "columns of several lengths"
        assert all(values.dtype.kind in "iuf" for values in table.values()), "columns of no numbers"


def run(path: Path):
    found = open_run(path)
    list(found.clouds)
    largest_overlap(found), base_friction(found)


def grains(path: Path):
    list(open_grains(path).clouds)


def resolved(path: Path):
    case.parse(path.read_bytes().decode(errors="replace"), path)


def packed(data: bytes) -> dict[str, bytes]:
    return {
        "a.dump.gz": gzip.compress(data, mtime=0),
        "a.dump.bz2": bz2.compress(data),
        "a.dump.xz": lzma.compress(data),
        "a.dump.zst": zstandard.compress(data),
    }


@cache
def targets() -> dict[str, Target]:
    """All of them by name."""
    text = {name: Target(frames_of(name), files) for name, files in seeds.TEXTS.items()}
    skipping = Target(frames_of("text_dump", incomplete="drop"), seeds.TEXTS["text_dump"])
    dumps = seeds.TEXTS["text_dump"]
    return text | {
        "text_dump_skipping": skipping,
        "vtk_binary": Target(frames_of("vtk_grains"), seeds.vtk_bytes(), "bytes"),
        "points_npz": Target(frames_of("points_npz"), seeds.npz(), "bytes"),
        "cb_geo": Target(frames_of("cb_geo"), seeds.cb_geo(), "hdf5"),
        "compressed": Target(frames_of("text_dump"), packed(next(iter(dumps.values()))), "bytes"),
        "run": Target(run, seeds.runs(), "hdf5"),
        "grains": Target(grains, seeds.grains(), "hdf5"),
        "case_resolved": Target(resolved, {"case.toml": seeds.CASE}),
        "reference": Target(read_reference, {"grains.json": seeds.reference(inputs(scene()))}),
        "packings": Target(read_packings, {"ensemble_metrics.csv": seeds.PACKINGS}),
        "card": Target(LibraryCard.read, {"mine.toml": seeds.CARD}),
    }


@cache
def scene():
    return case.parse(seeds.CASE.decode(), "case.toml")


def read_reference(path: Path):
    reference.read(path, scene())


def read_packings(path: Path):
    if packings.stated(path):
        packings.read(path)


@contextmanager
def bounded():
    """Memory has an end here, and what a library warns of is an error."""
    had = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, had[1]))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", ResourceWarning)
            # what numbers as 1e300 make of an arithmetic that is right
            warnings.filterwarnings("ignore", "overflow encountered", RuntimeWarning)
            arithmetic = "invalid value encountered in (add|subtract|multiply|divide|scalar|reduce)"
            warnings.filterwarnings("ignore", arithmetic, RuntimeWarning)
            yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, had)


def drawn(target: Target, name: str, seed: int, number: int) -> tuple[str, bytes]:
    """The file of an execution: its name and its bytes."""
    rng = random.Random(f"{name} {seed} {number}")
    file = rng.choice(list(target.files))
    data = target.files[file]
    if target.kind == "hdf5":
        return file, spoil(data, rng)
    return file, mutated(data, rng, target.kind == "text")


def fault_of(target: Target, path: Path) -> str | None:
    """What an execution shows that it must not; None where the file is read, or refused."""
    begun = time.process_time()
    try:
        target.read(path)
    except CaseError as error:
        if "\n" in str(error) or not str(error).strip():
            return f"not one line: {error!r}"
    except Exception:  # whatever else comes is what is looked for
        return traceback.format_exc(limit=-4)
    taken = time.process_time() - begun
    return f"took {taken:.1f} s" if taken > SECOND else None


def hunt(name: str, runs: int, seed: int, folder: Path, most: int = 5) -> tuple[int, list[Fault]]:
    """Executions of a target, and the faults that they showed; ends after `most` of these."""
    target, faults = targets()[name], []
    with bounded():
        for number in range(runs):
            file, data = drawn(target, name, seed, number)
            path = folder / file
            path.write_bytes(data)
            if what := fault_of(target, path):
                faults.append(Fault(what, file, data))
                if len(faults) == most:
                    return number + 1, faults
    return runs, faults
