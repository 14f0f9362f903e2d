"""Jobs that a test hands to a Slurm, and what is known of them."""

import json
import shutil
import threading
import time
from contextlib import suppress
from pathlib import Path

from cases import cluster
from cases.cluster import PROFILE
from cases.jobs import Job

# What made-up jobs do; each notes first that it has begun.
JOBS = {
    "fine": "",
    # beyond its minute at first
    "slow": "time.sleep(300 if begun == 1 else 0)",
    # more than it is given at first: nothing holds it but Slurm
    "greedy": "kept = bytearray(600_000_000); time.sleep(12)",
    # until somebody cancels it
    "cancelled": "time.sleep(300)",
    "wrong": "sys.exit('engine: lost its grains (a made-up reason)')",
    # its node fails while it runs the first time
    "stranded": "time.sleep(300 if begun == 1 else 0)",
}
CODE = """
import sys, time
from pathlib import Path
file = Path({file!r})
with open(file.with_suffix('.begun'), 'a') as notes:
    notes.write('x')
begun = len(file.with_suffix('.begun').read_text())
{what}
file.write_text('made')
"""


def profile(folder: Path, **keys) -> Path:
    """Ours, which looks more often, and with other keys in cluster.toml."""
    made = folder / "profile"
    shutil.copytree(PROFILE, made)
    config = (made / "config.yaml").read_text()
    (made / "config.yaml").write_text(config.replace("latency-wait: 60", "latency-wait: 5"))
    text = (made / "cluster.toml").read_text()
    for key, value in keys.items():
        assert f"\n{key} = " in text
        lines = [
            f"{key} = {value!r}" if line.startswith(f"{key} = ") else line
            for line in text.splitlines()
        ]
        text = "\n".join(lines) + "\n"
    (made / "cluster.toml").write_text(text)
    return made


def made_up(folder: Path, names) -> dict[str, Job]:
    """Jobs that do as JOBS says: statements that a module of Python's own runs."""
    jobs = {}
    for name in names:
        file = folder / f"{name}.txt"
        code = CODE.format(file=str(file), what=JOBS[name])
        jobs[name] = Job(file, ("timeit", "-n1", "-r1", code), seconds=901.0, bytes=1.0)
    return jobs


def records(folder: Path, of: str) -> list[tuple[int, dict]]:
    """What is known of the attempts at a job, with Slurm's numbers, in their order."""
    files = (folder / "logs" / "slurm").glob("[0-9]*.json")
    found = sorted((int(file.stem), json.loads(file.read_text())) for file in files)
    return [(number, one) for number, one in found if of in one["names"]]


def begun(folder: Path, name: str) -> int:
    notes = folder / f"{name}.begun"
    return len(notes.read_text()) if notes.exists() else 0


def at_work(words: str) -> bool:
    """Whether a process on this machine has them in its command line."""
    for one in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile
            if words.encode() in (one / "cmdline").read_bytes():
                return True
    return False


def wait_for(what, seconds=60.0):
    until = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < until
        time.sleep(0.2)


class Call(threading.Thread):
    """Jobs handed to the cluster, while the test does something to them."""

    def __init__(self, jobs: dict[str, Job], folder: Path, profile: Path):
        super().__init__(daemon=True)  # a test that fails does not wait for it
        self.told, self.failed = (jobs, folder, profile), [""]
        (folder / "logs").mkdir(parents=True, exist_ok=True)
        self.start()

    def run(self):
        self.failed = [str(one) for one in cluster.run(*self.told)]

    def end(self) -> list[str]:
        """What is told of the jobs that failed."""
        self.join(timeout=300.0)
        assert not self.is_alive()
        return self.failed
