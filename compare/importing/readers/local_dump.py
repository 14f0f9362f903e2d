"""Contacts of LAMMPS' and LIGGGHTS' `dump local`; recipes for both in compare/README.md.

LAMMPS lists all pairs within the cutoff of neighbours: those without a force are no contacts.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import contact_columns
from compare.importing.contact_columns import NEEDED, OPTION, Layout
from compare.importing.dump import GRAINS, Instant, instants, label_of
from compare.importing.frame import Frame, note
from compare.importing.registry import Reader, register

FORCE = ("fx", "fy", "fz")
LARGEST = 2.0**53  # whole numbers up to it are exact


def recognises(path: Path, head: bytes) -> bool:
    return label_of(head) not in (None, "", GRAINS)


def frames(path: Path, options: dict) -> Iterator[Frame]:
    layout: Layout | None = None
    for instant in instants(path, options):
        if instant.label == GRAINS:
            raise CaseError(f"{path}:{instant.header}: rows of {GRAINS} (no contacts)")
        rows = instant.columns
        contacts = {name: np.empty(0, np.int64 if name in NEEDED[:2] else float) for name in NEEDED}
        if instant.count and (layout is None or not fits(layout, rows)):
            layout = find(path, options, instant)
        if instant.count and layout is not None:
            contacts = of(path, instant, layout)
        source = f"{path}:{instant.line}"
        yield Frame(source, {}, instant.step, instant.time, instant.box, instant.units, contacts)


def fits(layout: Layout, rows: dict) -> bool:
    return all(name in rows for names in layout.sums.values() for name in names)


def find(path: Path, options: dict, instant: Instant) -> Layout | None:
    """The layout of the file's columns: where this instant has too few contacts to tell, of the
    first one that does. None where no instant can have a force.
    """
    where = f"{path}:{instant.header}"
    if words := options.get("contacts"):
        return contact_columns.of_user(words, instant.names, instant.columns, where)
    fit: list[Layout] = []
    some = False
    for other in (instant, *instants(path, dict(options, notes=[]))):
        if other.names == instant.names and other.count:
            layout = contact_columns.of_names(other.columns)
            fit = [layout] if layout else contact_columns.of_content(other.columns)
            if len(fit) == 1:
                for text in fit[0].notes:
                    note(options, f"{path}: {text}")
                return fit[0]
            some = some or can_have_forces(other.columns)
    if not some:
        return None
    which = "several could be" if fit else "none seem to be"
    raise CaseError(
        f"{where}: which columns are the two ids and the force? ({which}, of "
        f"{' '.join(instant.names)}) {OPTION}"
    )


def can_have_forces(rows: dict) -> bool:
    """Whether there is more in a table than the ids of pairs and their distance."""
    told = sum(bool(values.any()) for values in rows.values())
    return told > (3 if len(rows) > len(NEEDED) else 2)


def of(path: Path, instant: Instant, layout: Layout) -> dict[str, np.ndarray]:
    """The contacts of an instant: rows with a force."""
    contacts = layout.contacts(instant.columns)
    for name in NEEDED[:2]:
        values = contacts[name]
        wrong = np.flatnonzero(~((values == np.trunc(values)) & (np.abs(values) <= LARGEST)))
        if wrong.size:
            line = instant.header + 1 + wrong[0]
            raise CaseError(f"{path}:{line}: {values[wrong[0]]:.17g} is no whole number ({name})")
        contacts[name] = values.astype(np.int64)
    kept = np.any([contacts[name] != 0.0 for name in FORCE], axis=0)
    return {name: values[kept] for name, values in contacts.items()}


READER = register(
    Reader(
        "local_dump",
        "contacts of LAMMPS or LIGGGHTS (dump local)",
        "contacts",
        recognises,
        frames,
    )
)
