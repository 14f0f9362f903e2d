"""What `grainpair --version` says; builds nothing and needs Python's own library only."""

import re
import subprocess

from cases.programs import ROOT, program
from cases.provenance import commit

# name as users know it, Debian's package that holds it
LIBRARIES = {
    "LIGGGHTS": "liggghts",
    "LAMMPS": "lammps",
    "HDF5": "libhdf5-dev",
    "Eigen": "libeigen3-dev",
}


def number() -> str:
    """The version of this project, as CMakeLists.txt states it."""
    found = re.search(
        r"^project\(grainpair VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE
    )
    return found[1] if found else "unknown"


def text() -> str:
    """Version and commit; then, line by line, compiler, engines and libraries as installed."""
    rows = {
        "programs": built(),
        "compiler": first_line(["c++", "--version"]) or "not installed",
        **{name: package(debian) for name, debian in LIBRARIES.items()},
    }
    width = max(map(len, rows))
    lines = [f"  {name:<{width}}  {value}" for name, value in rows.items()]
    return "\n".join([f"grainpair {number()}, commit {commit()}", *lines])


def built() -> str:
    """Which commit the compiled programs are of."""
    header = program("generated") / "mpm" / "version.hpp"
    if not program("mpm_run").exists() or not header.exists():
        return "not built"
    found = re.search(r'GRAINPAIR_COMMIT "(.*)"', header.read_text())
    return f"built from commit {found[1]}" if found else "built"


def package(name: str) -> str:
    """Installed version of a package of Debian."""
    state = first_line(["dpkg-query", "-W", "-f=${db:Status-Status} ${Version}", name])
    return state.removeprefix("installed ") if state.startswith("installed ") else "not installed"


def first_line(command: list[str]) -> str:
    """The first line a command prints; empty where there is no such command or it fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.partition("\n")[0] if done.returncode == 0 else ""
