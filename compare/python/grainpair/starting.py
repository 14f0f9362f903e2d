"""Runs, started as a user starts them: by the command `grainpair run`."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from cases import children
from cases.errors import CaseError, EngineError
from cases.lookup import find_case
from cases.programs import ROOT, name_of, unstarted
from compare.verdict.conclusion import INVALID
from grainpair.pair import Pair


def run(
    case: str | os.PathLike = "column_small",
    out: str | os.PathLike | None = None,
    sets: Mapping[str, object] | None = None,
    *,
    seed: int = 1,
    seeds: int = 1,
    threads: int | None = None,
    siblings: bool = True,
    anew: bool = False,
    progress: bool = False,
) -> Pair:
    """Runs a case with both engines and compares them; returns what came out.

    `case`: a file, a folder that holds case.toml, or the name of a folder of cases/. `out`: folder
    of the results (runs/<case>), whose earlier results are replaced. `sets`: keys of the case with
    their values, such as {"grains.friction": 0.4}, in the schema's units. `seeds`: how many
    packings. `siblings`: also the two cheap runs that tell the continuum's numerical error. `anew`:
    do not go on with a run that was stopped. `progress`: lines of it on standard error.

    An invalid result is returned too: see Pair.verdict and Pair.findings. Raises CaseError for bad
    input, EngineError where an engine failed.
    """
    scene = find_case(os.fspath(case))
    out = Path(out) if out is not None else Path("runs") / name_of(scene)
    words: list = [no_option(scene), "--out", no_option(out), "--seed", seed, "--seeds", seeds]
    words += ["--threads", threads] if threads is not None else []
    words += [] if siblings else ["--no-siblings"]
    words += ["--anew"] if anew else []
    words += [] if progress else ["--quiet"]
    for key, value in (sets or {}).items():
        words += ["--set", f"{key}={toml(value)}"]
    code, line = called([ROOT / "grainpair", "run", *words], progress)
    if code in (0, INVALID):
        return Pair(out)
    raise (CaseError if code == 2 else EngineError)(line)


def called(command: list, progress: bool) -> tuple[int, str]:
    """The exit code of a program, and its last word on standard error, which is shown as it comes
    where `progress` asks for it.
    """
    last = ""
    try:
        process = children.start(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
    except OSError as error:
        raise unstarted(command[0], error) from error
    with process:
        try:
            for said in process.stderr:
                last = said.strip() or last
                if progress:
                    print(said, end="", file=sys.stderr)
        except BaseException:
            children.end(process)
            raise
    return process.returncode, last or f"grainpair: ended with code {process.returncode}"


def no_option(path: Path) -> str:
    """A path that nobody takes for an option."""
    return f"./{path}" if str(path).startswith("-") else str(path)


def toml(value: object) -> str:
    """A value as --set takes it."""
    match value:
        case bool():
            return str(value).lower()
        case str() | os.PathLike():
            return json.dumps(os.fspath(value), ensure_ascii=False)
        case list() | tuple():
            return f"[{', '.join(map(toml, value))}]"
    return str(value)
