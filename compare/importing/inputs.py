"""Files that a command line names: one by one, as folders or as patterns."""

import glob
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from cases.errors import CaseError
from compare.importing import compressed, registry

LISTS = (".pvd", ".pvtp", ".pvtu")  # files of VTK that name others
SHOWN = 3  # names in a note


def natural(path: Path) -> list:
    """Orders names by the numbers in them."""
    return [
        (1, int(part), "") if part.isdecimal() else (0, 0, part)
        for part in re.split(r"([0-9]+)", str(path))
    ]


def files(
    named: Sequence[Path], holds: tuple[str, ...], name: str | None = None
) -> tuple[list[Path], list[str]]:
    """The files of `named`, and notes. Those of a folder are the ones of a format that `holds` what
    is wanted, or all if the format has a `name`; those of a folder or pattern are in the order of
    the numbers in their names. Raises CaseError where there is none.
    """
    out: list[Path] = []
    notes: list[str] = []
    for one in named:
        if one.is_dir():
            out += of_folder(one, holds, name, notes)
        elif glob.has_magic(str(one)) and not one.exists():
            out += of_pattern(str(one))
        else:
            out.append(one)
    return list({path.resolve(): path for path in reversed(out)}.values())[::-1], notes


def of_pattern(pattern: str) -> list[Path]:
    found = [path for path in map(Path, glob.glob(pattern, recursive=True)) if path.is_file()]
    if not found:
        raise CaseError(f"{pattern}: no file has such a name")
    return sorted(found, key=natural)


def of_folder(folder: Path, holds: tuple[str, ...], name: str | None, notes: list[str]):
    there = sorted(
        (path for path in folder.iterdir() if path.is_file() and path.name[0] != "."), key=natural
    )
    known = there if name else [path for path in there if is_known(path, holds)]
    if not known:
        raise CaseError(
            f"{folder}: no file with {' or '.join(holds)} of a known format (it has {len(there)}) "
            "name the files, and --format NAME"
        )
    if odd := [path.name for path in there if path not in known]:
        more = f" and {len(odd) - SHOWN} more" if len(odd) > SHOWN else ""
        notes.append(
            f"passed over: {', '.join(odd[:SHOWN])}{more} (in {folder}, of no known format)"
        )
    listed = {path for one in known if one.suffix in LISTS for path in listed_by(one)}
    return [path for path in known if path.resolve() not in listed]


def is_known(path: Path, holds: tuple[str, ...]) -> bool:
    head = compressed.head(path, registry.HEAD)
    known = (one for one in registry.readers().values() if one.holds in holds)
    return any(one.recognises(path, head) for one in known)


def listed_by(path: Path) -> Iterator[Path]:
    """The files that a list of VTK's names."""
    text = path.read_text(errors="replace")
    for name in re.findall(r'(?:file|Source)\s*=\s*["\']([^"\']+)["\']', text):
        yield (path.parent / name).resolve()
