"""MercuryDPM: `.data`, the particles, and `.fstat`, their contacts.

The layout is that of MercuryDPM's pages "The data file" and "The fstat file" and of its functions
DPMBase::outputXBallsData (three dimensions: format 14, two: format 8, whose rotation about z is
written with its sign turned) and BaseInteraction::writeToFStat. Particles are counted in the order
of their rows; their ids here are that count from 1.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import lines as text
from compare.importing import rows
from compare.importing.compressed import opened
from compare.importing.frame import Box, Frame, note
from compare.importing.lines import Incomplete, Lines, drop
from compare.importing.registry import Reader, register

# Columns of a row by the number of words in the frame's head
COLUMNS = {
    8: "x y z vx vy vz radius alpha beta gamma omegax omegay omegaz type".split(),
    6: "x y vx vy radius alpha omegaz type".split(),
}
CONTACT = 16  # time, i, j, c (3), overlap, tangential, fn, ft, n (3), t (3)
LARGEST = 2.0**53  # whole numbers up to it are exact
HASHES = 3  # lines of the head of a frame of contacts
TWIN = 1e-6  # relative: two images of one contact differ by rounding, other contacts by more


def head_of(line: bytes) -> list[float] | None:
    """The numbers of a frame's head: count, time, lower and upper corner; None if it is none."""
    try:
        values = [float(word) for word in line.split()]
    except ValueError:
        return None
    if len(values) not in COLUMNS or not all(map(math.isfinite, values)):
        return None
    whole = values[0] >= 0 and values[0] == int(values[0])
    size = len(values) // 2 - 1
    ordered = whole and all(a <= b for a, b in zip(values[2 : 2 + size], values[2 + size :]))
    return values if ordered else None


def recognises_data(path: Path, head: bytes) -> bool:
    lines = head.splitlines()
    found = head_of(lines[0]) if lines else None
    if found is None:
        return False
    named = ".data" in path.name or found[0] == 0 or len(lines) < 2
    return named or len(lines[1].split()) == len(COLUMNS[len(found)])


def frames_data(path: Path, options: dict) -> Iterator[Frame]:
    """Particles, frame by frame. What is periodic stands in the `.restart` beside the file, if it
    is there.
    """
    periodic = periodic_axes(path, options)
    with text.opened(path) as lines:
        try:
            while lines.peek():
                if not lines.peek().strip():
                    lines.next()
                    continue
                yield data_frame(lines, periodic)
            lines.refuse_cut()
        except Incomplete as error:
            drop(error, options)


def data_frame(lines: Lines, periodic: np.ndarray) -> Frame:
    """The next frame; raises Incomplete where the file ends within it."""
    line = lines.next()
    head = head_of(line)
    if head is None or not lines.ended:
        told = f"{lines.where()}: not the head of a frame (count, time, lower and upper corner)"
        raise CaseError(told) if lines.ended else Incomplete(f"{told} (cut short?)")
    at, first = lines.where(), lines.number + 1
    names, count = COLUMNS[len(head)], int(head[0])
    block = lines.rows(count)
    found = lines.number - first + 1
    if found < count or is_torn(block, len(names)):
        raise Incomplete(
            f"{at}: {count} particles announced, {found} rows follow (killed while writing?)"
        )
    table = rows.numbers(block, len(names), lines.path, first)
    if len(table) != count:
        raise CaseError(f"{at}: blank lines among the {count} particles")
    columns = dict(zip(names, table.T)) | {"id": np.arange(1, count + 1)}
    size = len(head) // 2 - 1
    lower, upper = np.array(head[2 : 2 + size]), np.array(head[2 + size :])
    if size == 2:
        columns |= {name: np.zeros(count) for name in ("z", "vz", "omegax", "omegay")}
        columns["omegaz"] = -columns["omegaz"]
        lower, upper = np.append(lower, 0.0), np.append(upper, 0.0)
    box = Box(lower, upper, periodic, np.zeros((3, 2), dtype=bool))
    return Frame(at, columns, time=head[1], box=box)


def is_torn(block: bytes, width: int) -> bool:
    """Whether the last row lacks its end and some of its words."""
    if not block or block.endswith(b"\n"):
        return False
    return len(block[block.rfind(b"\n") + 1 :].split()) < width


def beside(path: Path, ending: str) -> Path | None:
    """The file of the same run with another ending, `name.ending` or that of the same number."""
    stem = path.name
    for ours in (".data", ".fstat"):
        stem, found, number = stem.partition(ours)
        if found:
            break
    for name in (f"{stem}.{ending}{number}", f"{stem}.{ending}"):
        if (path.parent / name).is_file():
            return path.parent / name
    return None


def periodic_axes(path: Path, options: dict) -> np.ndarray:
    """Whether x, y and z repeat, (3,), from the boundaries in the run's restart file."""
    axes = np.zeros(3, dtype=bool)
    restart = beside(path, "restart")
    if restart is None:
        note(
            options,
            "assumed: nothing repeats (.data and .fstat do not tell it, and no restart file lies "
            "beside them)",
        )
        return axes
    with opened(restart) as file:
        for line in file:
            words = line.split()
            if words[:1] == [b"PeriodicBoundary"] and b"normal" in words:
                at = words.index(b"normal") + 1
                normal = [abs(rows.number(w, str(restart))) for w in words[at : at + 3]]
                axes[int(np.argmax(normal))] = True
    return axes


def recognises_fstat(path: Path, head: bytes) -> bool:
    lines = [line.split() for line in head.splitlines()[:HASHES]]
    return len(lines) == HASHES and [words[:1] == [b"#"] and len(words) - 1 for words in lines] == [
        2,
        6,
        6,
    ]


def frames_fstat(path: Path, options: dict) -> Iterator[Frame]:
    """Contacts, frame by frame, each once. Those across a periodic boundary are written with the
    number of an image in some versions: its grain is known by the contact's other row, or, of a
    fixed grain, which has none, by its place in the `.data` beside the file.
    """
    data = beside(path, "data")
    grains = frames_data(data, options | {"notes": None}) if data else iter(())
    particles = next(grains, None)
    with text.opened(path, b"#") as lines:
        for at, time, table in fstat_frames(lines, options):
            while particles is not None and (particles.time or 0.0) < time:
                particles = next(grains, None)
            known = particles if particles is not None and particles.time == time else None
            yield Frame(at, time=time, contacts=contacts(table, known))


def fstat_frames(lines: Lines, options: dict) -> Iterator[tuple[str, float, np.ndarray]]:
    """Where each frame begins, its time, and its rows as they stand (C, CONTACT)."""
    try:
        while lines.peek():
            at, time = fstat_head(lines)
            first, block = lines.number + 1, lines.rows()
            if is_torn(block, CONTACT):
                raise Incomplete(
                    f"{lines.where()}: the last row lacks words (killed while writing?)"
                )
            table = rows.numbers(block, CONTACT, lines.path, first)
            ids = table[:, 1:3]
            wrong = np.flatnonzero(((ids != np.trunc(ids)) | (np.abs(ids) > LARGEST)).any(axis=1))
            if wrong.size:
                raise CaseError(f"{lines.path}:{first + wrong[0]}: numbers of particles are whole")
            yield at, time, table
        lines.refuse_cut()
    except Incomplete as error:
        drop(error, options)


def fstat_head(lines: Lines) -> tuple[str, float]:
    """Where the frame begins, and its time; the two lines after the first are for old programs."""
    head = [lines.next() for _ in range(HASHES)]
    at = f"{lines.path}:{max(1, lines.number - HASHES + 1)}"
    words = head[0].split()
    if not lines.ended or not head[-1]:
        raise Incomplete(f"{at}: a frame begins here and does not go on (killed while writing?)")
    if any(not line.startswith(b"#") for line in head) or len(words) != 3:
        raise CaseError(f"{at}: three lines that begin with # and a time should stand here")
    return at, rows.number(words[1], at)


def contacts(table: np.ndarray, particles: Frame | None) -> dict[str, np.ndarray]:
    """Each contact once, from rows of which there are two unless a partner is fixed or an image.

    The force on the first is fn n + ft t, n pointing at it; of a wall both point the other way ("an
    old bug", BaseInteraction::writeToFStat), so the sign is turned.
    """
    i, j = table[:, 1].astype(np.int64), table[:, 2].astype(np.int64)
    with np.errstate(invalid="ignore", over="ignore"):  # no number is refused later, with its grain
        force = table[:, 8:9] * table[:, 10:13] + table[:, 9:10] * table[:, 13:16]
    force[j < 0] *= -1.0
    span = int(max(i.max(initial=0), j.max(initial=0))) + 1
    mirrored = (j >= 0) & np.isin(i * span + j, j * span + i)
    once = ~mirrored | (i < j)
    alone = np.flatnonzero(~mirrored & (j >= 0))
    for a, b in twins(table, alone):
        j[a], once[b] = i[b], False
    if particles is not None:
        for row in np.flatnonzero(once & (j >= len(particles.columns["x"]))):
            j[row] = image_of(table[row], particles)
    second = np.where(j >= 0, j + 1, j)
    found = {"first": i + 1, "second": second}
    found |= {f"f{axis}": force[:, k] for k, axis in enumerate("xyz")}
    found |= {f"p{axis}": table[:, 3 + k] for k, axis in enumerate("xyz")}
    return {name: values[once] for name, values in found.items()}


def twins(table: np.ndarray, alone: np.ndarray) -> list[tuple[int, int]]:
    """Pairs of rows that are one contact seen from either side of a periodic boundary: overlap and
    forces are the same, the normals opposite.
    """
    order = alone[np.lexsort((alone, table[alone, 8]))]
    pairs: list[tuple[int, int]] = []
    taken: set[int] = set()
    for k, a in enumerate(order):
        if a in taken:
            continue
        for b in order[k + 1 :]:
            scale = abs(table[a, 8]) + 1e-300
            if table[b, 8] - table[a, 8] > TWIN * scale:
                break
            same = np.allclose(table[a, [6, 9]], table[b, [6, 9]], rtol=TWIN, atol=0.0)
            opposite = np.abs(table[a, 10:13] + table[b, 10:13]).max() < TWIN
            if b not in taken and same and opposite and table[a, 1] != table[b, 1]:
                pairs.append((int(a), int(b)))
                taken.update((a, b))
                break
    return pairs


def image_of(row: np.ndarray, particles: Frame) -> int:
    """The row of the particle whose image a contact is with: the one at the place that normal and
    overlap tell.
    """
    columns, box = particles.columns, particles.box
    place = np.stack([columns[axis] for axis in "xyz"], axis=1)
    one = int(row[1])
    branch = columns["radius"][one] + columns["radius"] - row[6]
    there = place[one] - branch[:, None] * row[10:13]
    apart = there - place
    assert box is not None
    length = box.upper - box.lower
    repeats = (length > 0.0) & (box.periodic if box.periodic.any() else True)
    apart[:, repeats] -= length[repeats] * np.round(apart[:, repeats] / length[repeats])
    distance = np.linalg.norm(apart, axis=1)
    distance[one] = np.inf
    return int(np.argmin(distance))


register(
    Reader(
        "mercury_data",
        "MercuryDPM particles (.data)",
        "grains",
        recognises_data,
        frames_data,
    )
)
register(
    Reader(
        "mercury_fstat",
        "MercuryDPM contacts (.fstat)",
        "contacts",
        recognises_fstat,
        frames_fstat,
    )
)
