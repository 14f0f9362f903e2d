"""From the frames of other programs' files to a file of grains.

Two passes: readers give frames, which are kept aside; what must be known of all of them (units,
order, walls, axes) is told then; and each is turned and written, one at a time.
"""

from dataclasses import replace
from pathlib import Path

from cases.case import Case
from cases.errors import CaseError
from cases.files import owned
from cases.scratch import scratch
from compare.importing import inputs, registry
from compare.importing.lines import Incomplete, drop
from compare.importing.options import Options
from compare.importing.progress import Progress
from compare.importing.spool import Spool
from compare.importing.survey import survey
from compare.importing.writing import write


def convert(options: Options, scene: Case | None, output: Path, quiet: bool = True) -> list[str]:
    """Writes the grains of `options.files` as `output`, which appears complete or not at all;
    returns the notes: one line each on what was assumed, merged, dropped, disagrees. Raises
    CaseError for what cannot be read, or is not plausible.
    """
    files, notes = inputs.files(options.files, ("grains", "contacts"), options.format)
    apart, more = inputs.files(options.contact_files, ("contacts",))
    options = replace(options, files=tuple(files), contact_files=tuple(apart))
    notes += more
    everything = [*options.files, *options.contact_files]
    with owned(output) as part, scratch(part.parent, "frames") as folder:
        shown = Progress(everything, quiet)
        try:
            spool = Spool(folder)
            made_by = gather(spool, options, notes, shown)
            found = survey(spool, options, scene, made_by, notes)
            write(found, scene, everything, part, notes, shown)
        finally:
            shown.close()
    return notes


def gather(spool: Spool, options: Options, notes: list[str], shown: Progress) -> str:
    """Reads all files into the spool; returns what made them."""
    words: list[str] = []
    jobs: list[tuple[Path, tuple[str, ...], str | None]]
    jobs = [(path, ("grains", "contacts"), options.format) for path in options.files]
    jobs += [(path, ("contacts",), None) for path in options.contact_files]
    for path, holds, name in jobs:
        try:
            reader = registry.named(name) if name else registry.reader_of(path, holds)
        except Incomplete as error:
            drop(error, options.reading(notes))
            continue
        if reader.holds not in holds:
            raise CaseError(f"{path}: format {reader.name} holds {reader.holds} (not {holds[0]})")
        for frame in reader.frames(path, options.reading(notes)):
            spool.add(frame)
            shown.reading(path)
        shown.read(path)
        if reader.holds == "grains" and reader.doc not in words:
            words.append(reader.doc)
    if not any(piece.columns for piece in spool.pieces):
        raise CaseError(f"{options.files[0]}: no grains (in none of the files)")
    return "; ".join(words).rstrip(".")
