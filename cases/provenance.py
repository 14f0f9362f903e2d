"""Where data come from: commit, date and machine, for the head of every table and result that is
kept.
"""

import datetime
import platform
import shlex
import subprocess
from collections.abc import Iterable
from pathlib import Path

from cases.errors import printable
from cases.programs import ROOT

NO_SOURCES = (":(exclude)cases/*/reference/*", ":(exclude)tests/data/fuzz/counts.csv")


def commit() -> str:
    """Commit of the sources, `unknown` outside a clone; "-dirty" when one is changed.

    Results that are kept are no sources.
    """

    def git(*words):
        return subprocess.run(
            # also of a clone that is somebody else's
            ["git", "-c", "safe.directory=*", "-C", ROOT, *words],
            capture_output=True,
            text=True,
            check=False,
        )

    head = git("describe", "--always", "--abbrev=12")
    if head.returncode:
        return "unknown"
    changed = git("diff", "--quiet", "HEAD", "--", ":/", *NO_SOURCES).returncode
    return head.stdout.strip() + ("-dirty" if changed else "")


def processor() -> str:
    """Name of the processor, as Linux tells it."""
    told = Path("/proc/cpuinfo")
    lines = told.read_text().splitlines() if told.exists() else []
    return next(
        (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")),
        platform.machine(),
    )


def machine() -> str:
    return f"{platform.machine()}, {processor()}"


def about(command: str, **more: str) -> dict[str, str]:
    """What a result says of itself: the command that makes it, the commit, the date and the
    machine.
    """
    today = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")
    return {"command": command, "commit": commit(), "date": today, "machine": machine()} | more


def typed(program: str, words: Iterable) -> str:
    """A command line that a shell takes as it was given, in one line."""
    return printable(f"{program} {shlex.join(map(str, words))}".rstrip())


def head(origin: dict[str, str], *notes: str) -> list[str]:
    """The lines above a stored table: where it comes from, then what its columns mean."""
    return [*(f"{name}: {value}" for name, value in origin.items()), *notes]
