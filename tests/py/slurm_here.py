"""A Slurm of one node on this machine: its controller and its node on loopback, in a temporary
folder, without privileges of the system's own Slurm. Debian's slurm-wlm and munge.
"""

import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "scontrol")
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
        told |= {"host": self.host, "cpus": cpus, "memory": memory, "user": "root"}
        (folder / "slurm.conf").write_text(CONFIG.format(**told))
        self.environment = os.environ | {"SLURM_CONF": str(folder / "slurm.conf")}
        self.daemons: list[subprocess.Popen] = []

    def ask(self, *words: str) -> str:
        done = subprocess.run(words, env=self.environment, capture_output=True, text=True)
        assert done.returncode == 0, (words, done.stderr)
        return done.stdout

    def start(self):
        munge = [f"--{name}-file={self.folder}/{name}" for name in ("key", "pid", "log", "seed")]
        socket_there = f"--socket={self.folder}/munge.socket"
        self.begin("munged", "--foreground", "--force", *munge, socket_there)
        self.begin("slurmctld", "-D", "-i")
        self.begin("slurmd", "-D")
        until = time.monotonic() + 30.0
        while time.monotonic() < until:
            done = subprocess.run(
                ["sinfo", "--noheader", "--format=%T"],
                env=self.environment,
                capture_output=True,
                text=True,
            )
            if done.stdout.strip() == "idle":
                return
            time.sleep(0.2)
        raise RuntimeError(f"no node is idle: {done.stdout}{done.stderr}")

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

    def states(self) -> dict[int, str]:
        """Of all its jobs, by their numbers."""
        lines = self.ask("squeue", "--noheader", "--states=all", "--format=%i %T").splitlines()
        return {int(number): state for number, state in (line.split() for line in lines)}


@contextmanager
def running(cpus: int = 8, memory: int = 16000) -> Iterator[Slurm]:
    """Skips the test where it cannot be."""
    for name in PROGRAMS:
        if not shutil.which(name):
            pytest.skip(f"{name} is not installed (slurm-wlm, munge)")
    if os.geteuid():
        pytest.skip("slurmd here wants root")
    folder = Path(tempfile.mkdtemp(prefix="slurm-"))  # short: a socket's path has a bound
    here = Slurm(folder, cpus, memory)
    try:
        here.start()
        yield here
    finally:
        here.stop()
        shutil.rmtree(folder, ignore_errors=True)
