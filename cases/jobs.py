"""A job: what is run beside others of its kind (cases/workflow.py).

    python3 -m cases.jobs FILE NAME

does the one of that name of a file that `write` has made; so it is called on a cluster.
"""

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from cases.programs import PYTHON, ROOT, module, short


@dataclass(frozen=True)
class Job:
    """Makes `file`, whole or not at all: a module of ours and its words, started in the project's
    folder, and the cores that it takes.
    """

    file: Path
    words: tuple[str, ...]
    cores: int = 1


@dataclass(frozen=True)
class Unmade:
    """A job that did not make its file: what is known where its log has no words, and the log."""

    what: str
    log: Path

    def __str__(self):
        said = self.log.read_text(errors="replace").strip().splitlines()
        line = said[-1] if said else self.what
        return f"{line} (see {short(self.log)}; what came through is kept: run it again)"


def text_of(jobs: Mapping[str, Job]) -> str:
    """Jobs as JSON, by their names."""
    return json.dumps({name: asdict(job) for name, job in jobs.items()}, default=str, indent=1)


def main(file: str, name: str):
    words = json.loads(Path(file).read_text())[name]["words"]
    os.chdir(ROOT)
    os.execv(PYTHON, module(*words))


if __name__ == "__main__":
    main(*sys.argv[1:])
