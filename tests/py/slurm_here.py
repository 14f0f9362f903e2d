"""A Slurm of one node on this machine: its controller and its node on loopback, in a temporary
folder, without privileges of the system's own Slurm. Debian's slurm-wlm and munge.
"""

import fcntl
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "scontrol")
# [s] with a message. Slurm puts back what ran on a node that was started anew where the controller
# has been up for PATIENCE + BatchStartTimeout, so nodes come up later, and where it had begun
# PATIENCE + 5 before: OLD is how long before power is lost.
PATIENCE, LATER = 5, 8.0
OLD = PATIENCE + 5 - LATER + 2.0
# As many processors as a test has jobs, whatever this machine has: most of them sleep.
CONFIG = """
ClusterName=here
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=1
JobAcctGatherParams=OverMemoryKill
AccountingStorageType=accounting_storage/none
SchedulerParameters=batch_sched_delay=1,sched_interval=2
ReturnToService=2
KillWait=2
BatchStartTimeout=1
MessageTimeout={patience}
SlurmdTimeout=30
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Slurm:
    """Of a test. `host`: the name of its node."""

    def __init__(self, folder: Path, cpus: int, memory: int):
        self.folder, self.host = folder, socket.gethostname().split(".")[0]
        for name in ("state", "spool"):
            (folder / name).mkdir()
        (folder / "key").write_bytes(os.urandom(1024))
        (folder / "key").chmod(0o600)
        told = {"controller": free_port(), "node": free_port(), "folder": folder}
        told |= {"patience": PATIENCE}
        told |= {"host": self.host, "cpus": cpus, "memory": memory, "user": "root"}
        (folder / "slurm.conf").write_text(CONFIG.format(**told))
        self.environment = os.environ | {"SLURM_CONF": str(folder / "slurm.conf")}
        self.daemons: list[subprocess.Popen] = []

    def is_told_to(self, monkeypatch):
        """Whatever the test starts finds it."""
        monkeypatch.setenv("SLURM_CONF", self.environment["SLURM_CONF"])
        monkeypatch.setenv("CI", "true")  # then Snakemake does not wait ten seconds between looks

    def hurry(self, number: int, when: str = "now") -> None:
        """Has a job begin that Slurm lets wait for two minutes, unless it has begun meanwhile."""
        try:
            self.ask("scontrol", "update", f"jobid={number}", f"starttime={when}")
        except AssertionError:
            if self.states()[number] == "PENDING":
                raise

    def ask(self, *words: str) -> str:
        """What Slurm answers; a controller that is busy is asked again."""
        for _ in range(5):
            done = subprocess.run(words, env=self.environment, capture_output=True, text=True)
            if "timed out" not in done.stderr:
                break
        assert done.returncode == 0, (words, done.stderr)
        return done.stdout

    def start(self, again: bool = False):
        munge = [f"--{name}-file={self.folder}/{name}" for name in ("key", "pid", "log", "seed")]
        socket_there = f"--socket={self.folder}/munge.socket"
        self.begin("munged", "--foreground", "--force", *munge, socket_there)
        self.begin("slurmctld", "-D")  # which has its state again where there is one
        time.sleep(LATER * again)
        # by -b a node says that it was started anew, as else the machine's clock tells
        self.begin("slurmd", "-D", *["-b"] * again)
        until = time.monotonic() + 60.0
        while time.monotonic() < until:
            done = subprocess.run(
                ["sinfo", "--noheader", "--format=%T"],
                env=self.environment,
                capture_output=True,
                text=True,
            )
            if done.stdout.strip() in ("idle", "mixed", "allocated"):
                return
            time.sleep(0.2)
        raise RuntimeError(f"no node is idle: {done.stdout}{done.stderr}")

    def lose_node(self):
        """Its node is down, and back: by itself, once it has told of itself, or because it is told
        to be.
        """
        of_node = ("scontrol", "update", f"nodename={self.host}")
        self.ask(*of_node, "state=down", "reason=test")
        words = (*of_node, "state=resume")
        done = subprocess.run(words, env=self.environment, capture_output=True, text=True)
        assert done.returncode == 0 or "Invalid node state" in done.stderr, done.stderr

    def begin(self, *words: str):
        with open(self.folder / f"{words[0]}.out", "ab") as out:
            self.daemons.append(
                subprocess.Popen(words, env=self.environment, stdout=out, stderr=out)
            )

    def stop(self):
        subprocess.run(
            ["scancel", "--state=RUNNING,PENDING", "--user=root"],
            env=self.environment,
            capture_output=True,
        )
        for one in reversed(self.daemons):
            one.terminate()
        for one in reversed(self.daemons):
            try:
                one.wait(timeout=10.0)
            except subprocess.TimeoutExpired:
                one.kill()
        for left in descendants(self.keepers()):
            tell(left, signal.SIGKILL)

    def lose_power(self, *more: int):
        """Ends the daemons, all that they run, and the processes `more` with all of theirs at one
        moment: none sees another's end.
        """
        roots = {one.pid for one in self.daemons} | set(more) | self.keepers()
        gone: set[int] = set()
        while new := descendants(roots | self.keepers()) - gone:
            for one in new:
                tell(one, signal.SIGSTOP)
            gone |= new
        for one in gone:
            tell(one, signal.SIGKILL)
        for daemon in self.daemons:
            daemon.wait()
        self.daemons.clear()

    def keepers(self) -> set[int]:
        """The processes by which Slurm keeps jobs; they do not descend from its daemons."""
        mark, found = f"SLURM_CONF={self.folder}/slurm.conf".encode(), set()
        for one in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):  # it has ended meanwhile
                if (one / "comm").read_text() == "slurmstepd\n":
                    if mark in (one / "environ").read_bytes().split(b"\0"):
                        found.add(int(one.name))
        return found

    def states(self) -> dict[int, str]:
        """Of all its jobs, by their numbers."""
        return self.told_of_jobs("%T")

    def names(self) -> dict[int, str]:
        return self.told_of_jobs("%j")

    def told_of_jobs(self, what: str) -> dict[int, str]:
        lines = self.ask("squeue", "--noheader", "--states=all", f"--format=%i {what}").splitlines()
        return {int(number): word for number, word in (line.split() for line in lines)}


def tell(process: int, number: signal.Signals):
    with suppress(ProcessLookupError):
        os.kill(process, number)


def descendants(of: set[int]) -> set[int]:
    """Those processes, and all that descend from them."""
    parents = {}
    for one in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            about = (one / "stat").read_text()
            parents[int(one.name)] = int(about.rpartition(")")[2].split()[1])
    found = of & parents.keys()
    while new := {one for one, parent in parents.items() if parent in found} - found:
        found |= new
    return found


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Tests beside each other wait: two nodes would share this machine's processors, and each
    Slurm's clocks are set for one that keeps up.
    """
    with open(Path(tempfile.gettempdir()) / "grainpair-slurm.lock", "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@contextmanager
def running(cpus: int = 8, memory: int = 16000) -> Iterator[Slurm]:
    """Skips the test where it cannot be."""
    for name in PROGRAMS:
        if not shutil.which(name):
            pytest.skip(f"{name} is not installed (slurm-wlm, munge)")
    if os.geteuid():
        pytest.skip("slurmd here wants root")
    with one_at_a_time():
        folder = Path(tempfile.mkdtemp(prefix="slurm-"))  # short: a socket's path has a bound
        here = Slurm(folder, cpus, memory)
        try:
            here.start()
            yield here
        finally:
            here.stop()
            shutil.rmtree(folder, ignore_errors=True)
