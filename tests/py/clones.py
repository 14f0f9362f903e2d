"""A copy of what Python needs of this clone, for tests of where a clone lies and whose it is."""

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from cases.programs import ROOT, program

PROGRAMS = ("mpm_case", "mpm_run", "mpm_point", "grain_map", "grain_ledger.so")
LEFT_OUT = shutil.ignore_patterns("reference", "__pycache__", "claims")


def copied(target: Path) -> Path:
    """The sources, without results and without anything built."""
    for folder in ("cases", "compare", "dem_reference", "mpm"):
        shutil.copytree(ROOT / folder, target / folder, ignore=LEFT_OUT)
    for file in ("grainpair", "CMakeLists.txt", "CMakePresets.json"):
        shutil.copy(ROOT / file, target / file)
    for packages in ROOT.glob("packages*.txt"):
        (target / packages.name).write_text("bash\n")
    return target


def built(folder: Path) -> Path:
    """A build folder of another clone, with the programs, open to all users."""
    folder.mkdir(parents=True)
    for name in PROGRAMS:
        shutil.copy(program(name), folder / name)
    (folder / "CMakeCache.txt").write_text("CMAKE_HOME_DIRECTORY:INTERNAL=/elsewhere\n")
    return folder


def call(command: list, folder: Path, *, user: str | None = None, **environment: str):
    """Runs a command in `folder` with nothing but PATH and `environment` around it; as another
    `user` where the tests are root's.
    """
    other: dict[str, Any] = {"user": user, "group": "nogroup", "extra_groups": []} if user else {}
    return subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        env={"PATH": os.environ["PATH"]} | environment,
        check=False,
        **(other if os.getuid() == 0 else {}),
    )
