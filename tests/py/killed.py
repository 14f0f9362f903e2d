"""Commands that are killed: where they work, who of them is alive, and what they leave."""

import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from cases.programs import ROOT, module, program
from watched import seen

PATIENCE = 10.0  # [s] after which nothing may be alive
MARK = "GRAINPAIR_TEST_MARK"  # a variable by which all descendants of a test are told
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
GENTLE = {signal.SIGTERM: (143, -15), signal.SIGINT: (130, -2), signal.SIGKILL: (-9,)}


class Place:
    """Where one command works, apart from all others, and what it is told."""

    def __init__(self, folder: Path, packings: Path, words: list, table: str):
        self.folder, self.table, self.said = folder, folder / table, folder / "said"
        self.runs, self.temporary = folder / "runs", folder / "tmp"
        for one in (self.runs, self.temporary):
            one.mkdir(parents=True)
        (self.runs / "packings").symlink_to(packings)
        self.command = module(*words, self.table if words[0] != "compare" else self.table.parent)
        self.environment = os.environ | {
            "GRAINPAIR_RUNS": str(self.runs),
            "GRAINPAIR_BUILD": str(program("").resolve()),
            "TMPDIR": str(self.temporary),
            MARK: str(folder),
        }

    def start(self) -> subprocess.Popen:
        with self.said.open("w") as said:
            return subprocess.Popen(
                self.command,
                cwd=ROOT,
                env=self.environment,
                start_new_session=True,  # so that nobody but the driver is told
                stdout=subprocess.DEVNULL,
                stderr=said,
            )

    def alive(self) -> list[str]:
        """Number and command line of all processes that descend from the command."""
        mark, found = f"{MARK}={self.folder}".encode(), []
        for one in Path("/proc").glob("[0-9]*"):
            try:
                if mark in (one / "environ").read_bytes().split(b"\0"):
                    words = (one / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                    found.append(f"{one.name} {words}")
            except OSError:  # it has ended meanwhile, or is somebody else's
                continue
        return found

    def left(self) -> list[str]:
        """Files of work that is not done: locks, scratch folders, configurations."""
        ours = seen(self.folder, "**/*")
        signs = ("scratch-", ".lock", "jobs-", ".work", ".part")
        named = [path for path in ours if path.name == "lock" or any(s in path.name for s in signs)]
        # Open MPI makes a folder of a socket there
        rest = [path for path in self.temporary.iterdir() if path.name.startswith("grainpair")]
        return [str(path.relative_to(self.folder)) for path in [*named, *rest]]


def run(place: Place):
    one = place.start()
    assert one.wait(timeout=120) == 0, place.said.read_text()
    assert not place.alive() and not place.left()


def kill(
    place: Place,
    number: signal.Signals,
    moment: float,
    begun: Callable[[], bool] = lambda: True,
) -> tuple[int, str]:
    """Starts the command, tells its driver alone `moment` [s] after it has `begun`, and waits
    until all of its processes have ended. Returns its code and what it said.
    """
    one = place.start()
    while not begun() and one.poll() is None:
        time.sleep(0.02)
    time.sleep(moment)
    began = time.monotonic()
    one.send_signal(number)
    code, said = one.wait(timeout=PATIENCE), place.said.read_text()
    while (alive := place.alive()) and time.monotonic() - began < PATIENCE:
        time.sleep(0.05)
    assert not alive, alive
    if number == signal.SIGINT and code == 1 and said.endswith("\nKeyboardInterrupt\n"):
        code = -number  # Python had not begun with us, and was loading its own
    assert code in (0, *GENTLE[number]), (code, said)  # 0: it was ready before
    return code, said
