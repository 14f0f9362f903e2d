"""Runs programs that report their progress, side by side, and shows it.

A program says `progress <fraction> <text>` on standard output and, when it fails, one line on
standard error.
"""

import signal
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from subprocess import PIPE
from typing import IO

from tqdm import tqdm

from cases import children
from cases.errors import CaseError, EngineError, code_of
from cases.programs import unstarted
from cases.room import NoRoom


@dataclass(frozen=True)
class Stage:
    """A program of a run: what the user sees it called, and its command line; `dispensable` where
    the run goes on without it.
    """

    name: str
    command: list
    dispensable: bool = False
    result: Path | None = None  # a stage whose result is there has been done

    def is_done(self) -> bool:
        return self.result is not None and self.result.exists()


class Bars:
    """One progress bar per stage, with the time left; for terminals."""

    def __init__(self, stages: list[Stage]):
        width = max((len(stage.name) for stage in stages), default=0)
        form = "{desc} {percentage:3.0f} % |{bar:24}| {elapsed} (left {remaining}){postfix}"
        self.bars = {
            stage.name: tqdm(
                desc=stage.name.ljust(width),
                total=1.0,
                smoothing=0.1,
                bar_format=form,
                position=row,
                dynamic_ncols=True,
            )
            for row, stage in enumerate(stages)
        }

    def update(self, name: str, fraction: float, text: str):
        bar = self.bars[name]
        if not bar.n:
            bar.start_t = time.time()  # stages may wait for others
        bar.set_postfix_str(text, refresh=False)
        bar.update(fraction - bar.n)

    def close(self):
        for bar in self.bars.values():
            bar.close()


class Lines:
    """One line per stage and tenth of its way; for logs."""

    def __init__(self, stages: list[Stage]):
        self.said = {stage.name: -1 for stage in stages}
        self.start: dict[str, float] = {}  # of each stage

    def update(self, name: str, fraction: float, text: str):
        tenth, now = int(10 * fraction + 1e-9), time.monotonic()
        elapsed = now - self.start.setdefault(name, now)
        if tenth <= self.said[name]:
            return
        self.said[name] = tenth
        left = f", {elapsed * (1 / fraction - 1):.0f} s left" if 0.01 < fraction < 1 else ""
        print(
            f"{name}: {100 * fraction:.0f} % after {elapsed:.0f} s{left}: {text}",
            file=sys.stderr,
            flush=True,
        )

    def close(self):
        pass


class Silence(Lines):
    """Nothing; for --quiet."""

    def update(self, name: str, fraction: float, text: str):
        pass


class Told:
    """`progress <fraction> <text>`, as programs of a run say it; for whoever watches this one."""

    def update(self, name: str, fraction: float, text: str):
        print(f"progress {fraction:.4f} {text}", flush=True)

    def close(self):
        pass


def display(stages: list[Stage], quiet: bool) -> Bars | Lines:
    if quiet:
        return Silence(stages)
    return Bars(stages) if sys.stderr.isatty() else Lines(stages)


class Running:
    """A started stage. Two threads read its output: neither pipe can fill up and block it."""

    def __init__(self, stage: Stage, shown: Bars | Lines):
        self.stage, self.shown = stage, shown
        self.errors: list[str] = []
        try:
            self.process = children.start(
                stage.command,
                text=True,
                errors="replace",
                stdout=PIPE,
                stderr=PIPE,
                start_new_session=True,
            )
        except OSError as error:
            raise unstarted(stage.command[0], error) from error
        assert self.process.stdout and self.process.stderr  # both are pipes
        self.readers = [
            threading.Thread(target=self.read_progress, args=[self.process.stdout], daemon=True),
            threading.Thread(target=self.read_errors, args=[self.process.stderr], daemon=True),
        ]
        for reader in self.readers:
            reader.start()

    def read_progress(self, pipe: IO[str]):
        for line in pipe:
            match line.split(maxsplit=2):
                case ["progress", fraction, *text]:
                    self.shown.update(
                        self.stage.name, min(max(float(fraction), 0.0), 1.0), " ".join(text).strip()
                    )

    def read_errors(self, pipe: IO[str]):
        self.errors += [line.rstrip() for line in pipe if line.strip()]

    def kill(self):
        """Ends the program and whatever it started."""
        if self.process.poll() is None:
            children.end(self.process, group=True)

    def check(self):
        """Raises CaseError or EngineError, with the program's own line, if it ended badly."""
        code = self.process.returncode
        for reader in self.readers:
            reader.join(timeout=5)
        if code == 0:
            return
        program = Path(self.stage.command[0]).name
        told = self.errors[-1] if self.errors else ""
        if code < 0 and not code_of(told):
            raise EngineError(
                f"{self.stage.name}: {program} was killed by {signal.Signals(-code).name}"
            )
        line = told or f"{self.stage.name}: {program} ended with code {code} and no word"
        failure = NoRoom if NoRoom.says(line) else EngineError
        raise CaseError(line) if code == 2 else failure(line)


def run_stages(stages: list[Stage], *, together: bool = False, quiet: bool = False):
    """Runs the stages, one after the other or all at once. The first that fails ends the others.

    Raises CaseError (exit code 2 of a program) or EngineError (any other).
    """
    run_chains([[stage] for stage in stages] if together else [stages], quiet=quiet)


def run_chains(chains: list[list[Stage]], *, quiet: bool = False) -> dict[str, str]:
    """Runs chains of stages side by side, the stages of a chain one after the other. The first that
    fails ends them all, but a dispensable one only what follows it in its chain.

    Returns what dispensable stages said that failed, by their names. Raises CaseError (exit code 2
    of a program) or EngineError (any other).
    """
    chains = [[stage for stage in chain if not stage.is_done()] for chain in chains]
    shown = display([stage for chain in chains for stage in chain], quiet)
    waiting = [chain for chain in chains if chain]
    running: list[Running] = []
    failed: dict[str, str] = {}
    try:
        for chain in waiting:
            running.append(Running(chain.pop(0), shown))
        while running:
            time.sleep(0.05)
            for row, one in reversed(list(enumerate(running))):
                if one.process.poll() is None:
                    continue
                try:
                    one.check()
                except (CaseError, EngineError) as error:
                    if not one.stage.dispensable:
                        raise
                    failed[one.stage.name] = str(error)
                    waiting[row].clear()
                if waiting[row]:
                    running[row] = Running(waiting[row].pop(0), shown)
                else:
                    del running[row], waiting[row]
    finally:
        for one in running:
            one.kill()
        shown.close()
    return failed
