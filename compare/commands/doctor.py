"""Say what this machine lacks: packages, engines, build, memory, cores."""

import os
import platform
import re
import shutil
import subprocess

from cases import cores
from cases.programs import ROOT, program

TARGETS = ()  # it says what is missing, so nothing is set up for it

MEMORY = 2.0  # [GiB] a build of two files at a time needs about this much
DISK = 1.0  # [GiB] the build folder and a few runs


def arguments(parser):
    pass


def run(options) -> int:
    checks = [
        *packages(),
        engine("liggghts", "-help"),
        *built(),
        *machine(),
    ]
    for good, what, detail in checks:
        print(f"{'ok     ' if good else 'MISSING'}  {what:<28} {detail}")
    missing = sum(not good for good, _, _ in checks)
    print(
        f"grainpair doctor: {missing} of {len(checks)} checks need attention"
        if missing
        else "grainpair doctor: nothing is missing"
    )
    return 3 if missing else 0


def output(command: list[str]) -> str:
    """What a command prints; empty if there is no such command."""
    try:
        return subprocess.run(
            command, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=20
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ""


def packages():
    """Those that every run needs, one by one; of the further lists, how much is there."""
    versions = installed(wanted := listed("packages.txt"))
    for name in wanted:
        yield name in versions, f"package {name}", versions.get(
            name, f"install it with: apt-get install {name}"
        )
    for file in sorted(ROOT.glob("packages-*.txt")):
        more = listed(file.name)
        there = len(installed(more))
        rest = "" if there == len(more) else "; the launcher installs the rest where it is needed"
        yield True, file.name, f"{there} of {len(more)} are there{rest}"


def listed(name: str) -> list[str]:
    """The packages of a list."""
    return re.sub("#.*", "", (ROOT / name).read_text()).split()


def installed(names: list[str]) -> dict[str, str]:
    """Versions of those that are there."""
    said = output(["dpkg-query", "-W", "-f=${db:Status-Status} ${Package} ${Version}\n", *names])
    return dict(line.split()[1:] for line in said.splitlines() if line.startswith("installed "))


def engine(name: str, flag: str):
    """An engine is there if its executable is and starts, which it does only with its libraries."""
    path = shutil.which(name)
    if not path:
        return False, f"engine {name}", "no such program"
    lost = [line.split()[0] for line in output(["ldd", path]).splitlines() if "not found" in line]
    if lost:
        return False, f"engine {name}", f"{path} lacks {', '.join(lost)}"
    words = output([path, flag]).strip().splitlines()
    return bool(words), f"engine {name}", words[0] if words else f"{path} does not start"


def built():
    for name in ("mpm_case", "mpm_run", "grain_map"):
        path = program(name)
        there = path.exists()
        yield there, f"program {name}", path if there else "not built; `run` builds it"


def machine():
    system = platform.freedesktop_os_release()
    known = system.get("ID") == "debian" and system.get("VERSION_ID") in ("12", "13")
    yield known, "system", system["PRETTY_NAME"]
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    yield memory >= MEMORY, "memory", f"{memory:.1f} GiB (at least {MEMORY:g})"
    disk = shutil.disk_usage(ROOT).free / 2**30
    yield disk >= DISK, "disk", f"{disk:.1f} GiB free (at least {DISK:g})"
    count = cores.usable()
    yield True, "cores", f"{count}{'' if count > 1 else '; the engines run one after the other'}"
