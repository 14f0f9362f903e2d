"""A program of ours run on a cluster instead of here.

    python3 -m cases.handed PROFILE RESULT [--cores N] [--seconds S] [--bytes B] -- PROGRAM WORD...

PROGRAM is a module or a built program; it makes RESULT. Says `progress` lines as the program would,
by the estimate, and its words where it fails.
"""

import argparse
import sys
from pathlib import Path

from cases import content, workflow
from cases.errors import exit_code
from cases.jobs import Job
from cases.members import Members
from cases.programs import kept, module
from cases.stages import Stage


def stage(one: Stage, profile: Path, job: Job) -> Stage:
    """The same stage, done on a cluster: what `job` is, which makes the stage's result."""
    words = [profile.resolve(), job.file, "--cores", job.cores, "--seconds", job.seconds]
    words += ["--bytes", job.bytes, "--", *job.words]
    return Stage(one.name, module("cases.handed", *words), one.dispensable, one.result)


def main() -> int:
    parser = argparse.ArgumentParser(prog="cases.handed", description=__doc__.splitlines()[0])
    parser.add_argument("profile", type=Path)
    parser.add_argument("result", type=Path)
    parser.add_argument("--cores", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--bytes", type=float, default=0.0)
    parser.add_argument("words", nargs="+")
    told = parser.parse_args()
    file = told.result.resolve()
    job = Job(file, tuple(told.words), told.cores, told.seconds, told.bytes)

    def work() -> int:
        folder, name = kept("handed", content.digest([str(file)])), file.stem
        seconds = {name: told.seconds / told.cores} if told.seconds else {}
        members = Members(name, {name: file}, seconds=seconds, progress=True)
        workflow.run({name: job}, folder, workflow.Where(profile=told.profile), members)
        return 0

    return exit_code(work)


if __name__ == "__main__":
    sys.exit(main())
