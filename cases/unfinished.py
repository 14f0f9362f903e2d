"""What is made of a result before it is complete, kept where that was stopped: the same command
goes on from it.

While it is made it is a folder beside the result, .NAME.unfinished, which holds the key of what
decides the result, and the files. It stays where its maker was interrupted or killed, or found no
more room, as long as there is something in it to go on from; any other end removes it.
"""

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cases.errors import CaseError, Failed
from cases.files import write_atomically
from cases.room import NoRoom


@dataclass(frozen=True)
class Unfinished:
    """How a result is gone on with. `key`: of all that decides it; `must`: whether it is refused
    where there is nothing to go on from; `anew`: whether what is there is removed.
    """

    key: str
    must: bool = False
    anew: bool = False


@contextmanager
def unfinished(place: Path, out: Path, how: Unfinished) -> Iterator[Path]:
    """The folder to make the result `out` in, with what is there of it already; `place`: where it
    is kept. Raises CaseError where there is nothing and there must be.
    """
    key, work = place / "key", place / "files"
    known = key.is_file() and key.read_text() == how.key
    goes_on = known and not how.anew and has_results(work)
    if how.must and not goes_on:
        why = (
            "nothing of it is there" if not has_results(work) else "what is there is another run's"
        )
        raise CaseError(f"{out}: cannot be gone on with ({why}) leave --resume out")
    if goes_on:
        print(f"{out}: goes on from where it was stopped", file=sys.stderr)
        remove_litter(work)
    else:
        shutil.rmtree(place, ignore_errors=True)
        work.mkdir(parents=True)
        write_atomically(key, how.key)
    keeps = False
    try:
        yield work
    except Failed as error:
        keeps = isinstance(error, NoRoom)
        raise
    except BaseException:
        keeps = True
        raise
    finally:
        if keeps and has_results(work):
            print(f"{out}: the same command goes on from here", file=sys.stderr)
        else:
            shutil.rmtree(place, ignore_errors=True)


def has_results(work: Path) -> bool:
    """Whether there is anything to go on from: a complete result of an engine, or a checkpoint."""
    return any(work.rglob("*.h5"))


def remove_litter(work: Path):
    """Removes what killed programs have left of results that are complete."""
    for result in list(work.rglob("*.h5")):
        beside = [f"{result.name}.unfinished", f"{result.name}.part", f".{result.name}.lock"]
        found = [result.with_name(name) for name in beside]
        found += result.parent.glob(f".{result.name}.scratch-*")
        for path in found:
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
