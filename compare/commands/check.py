"""Run the checks of style and of types that CI runs; each mistake fails.

Formatters and linters come from Debian, packages-check.txt; the launcher installs them for this
command. What clang-tidy found clean is not looked at again until it, a header or the rules change.
"""

import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from cases.programs import ROOT, call, module, program

PACKAGES = ["laws", "studies", "test", "cluster", "check"]
TARGETS = ("grainpair_version",)  # clang-tidy reads how to compile from the build's folder
FOLDERS = ("cases", "mpm", "dem_reference", "compare", "tests")
SCRIPTS = ("grainpair", ".ci/run", "tests/first_step.sh")

# What clang-tidy looks at: it takes some ten seconds a file, and with the files the headers they
# include. Left out are kernels, each of which takes it minutes; tests and benchmarks; mains, which
# declare options and call, where the library of options alone takes half a minute; and laws but the
# one that includes the headers of all.
TIDY = (
    "cases/*.cpp",
    "compare/mapping/*.cpp",
    "dem_reference/ledger/*.cpp",
    "mpm/external/*.cpp",
    "mpm/materials/solid_fluid.cpp",
    "mpm/output/*.cpp",
    "mpm/points/packing.cpp",
    "mpm/programs/*.cpp",
    "mpm/step/simulation.cpp",
)


def arguments(parser):
    parser.add_argument(
        "tools", nargs="*", metavar="TOOL", help=f"those to run (all: {', '.join(CHECKS)})"
    )
    parser.add_argument("--fix", action="store_true", help="first format what is not formatted")


def run(options) -> int:
    unknown = [name for name in options.tools if name not in CHECKS]
    if unknown:
        print(
            f"grainpair check: no tool '{unknown[0]}' (known: {', '.join(CHECKS)})", file=sys.stderr
        )
        return 2
    if options.fix:
        words(["clang-format", "-i", *cpp()])
        words(module("black", "-q", "."))
    failed = []
    for name in options.tools or CHECKS:
        start = time.monotonic()
        told = CHECKS[name]()
        print(f"{'FAILED' if told else 'ok    '}  {name:<14} {time.monotonic() - start:5.0f} s")
        if told:
            failed.append(name)
            print(told, flush=True)
    print(f"grainpair check: {', '.join(failed) + ' failed' if failed else 'all is well'}")
    return int(bool(failed))


def words(command: list[str]) -> str:
    """What a command that fails says; empty where it ends well."""
    done = call(command, cwd=ROOT)
    if done.returncode == 0:
        return ""
    return (done.stdout + done.stderr).strip() or f"{command[0]}: ended with {done.returncode}"


def cpp() -> list[str]:
    return [
        str(file.relative_to(ROOT))
        for folder in FOLDERS
        for file in sorted((ROOT / folder).rglob("*.[ch]pp"))
    ]


def clang_format() -> str:
    return words(["clang-format", "--dry-run", "-Werror", *cpp()])


def python(*command: str) -> Callable[[], str]:
    return lambda: words(module(*command))


def shellcheck() -> str:
    return words(["shellcheck", *SCRIPTS])


def clang_tidy() -> str:
    """Findings in the files of TIDY, several looked at side by side."""
    commands: dict[str, list[str]] = {}  # by folder, of the unit that is told most
    for entry in json.loads(program("compile_commands.json").read_text()):
        if Path(entry["file"]).suffix != ".cpp":
            continue
        line = shlex.split(entry["command"])
        folder, flags = folder_of(line[line.index("-o") + 1]), compiler(entry["command"])
        commands[folder] = max(flags, commands.get(folder, []), key=len)
    chosen = [
        str(file.relative_to(ROOT))
        for pattern in TIDY
        for file in sorted(ROOT.glob(pattern))
        if not file.name.endswith("_main.cpp")
    ]
    lost = [name for name in chosen if folder_of(name) not in commands]
    if lost:
        return f"{', '.join(lost)}: not part of the build (see {program('compile_commands.json')})"
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        told = pool.map(lambda name: tidy(name, commands[folder_of(name)]), chosen)
    findings = re.split(r"^(?=/\S+:\d+:\d+: (?:error|warning))", "".join(told), flags=re.M)
    return "".join(dict.fromkeys(findings)).strip()  # a header's are told with every file


def folder_of(file: str) -> str:
    """The folder that a source or an object is of; all that it compiles is told the same flags."""
    return file.split("/", 1)[0]


def compiler(command: str) -> list[str]:
    """The flags of a compiler's command line.

    Without what launches it, its input, its output, and what is of another compiler: warnings, and
    precompiled headers.
    """
    line = shlex.split(command)
    name = next(i for i, word in enumerate(line) if word.endswith("++"))  # c++, or a path to it
    flags: list[str] = []
    rest = iter(line[name + 1 :])
    for word in rest:
        if word in ("-o", "-c", "-include"):
            next(rest)
        elif not word.startswith("-W"):
            flags.append(word)
    return flags


def tidy(name: str, flags: list[str]) -> str:
    """Findings in one file, with the headers it includes."""
    stamp = program("tidy") / f"{name.replace('/', '-')}.clean"
    content = digest(name, flags)
    if stamp.exists() and stamp.read_text() == content:
        return ""
    command = ["clang-tidy", "--quiet", name, "--", *flags]
    done = call(command, cwd=ROOT)
    if done.returncode:
        return done.stdout.strip() or done.stderr.strip()
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(content)
    return ""


def digest(name: str, flags: list[str]) -> str:
    """A hash of all that decides what clang-tidy says of a file: rules, flags, contents."""
    listed = subprocess.run(
        ["c++", "-MM", *flags, name], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    files = listed.replace("\\\n", " ").split()[1:]
    told = hashlib.sha256(repr(flags).encode())
    for file in [".clang-tidy", *files]:
        told.update(hashlib.sha256((ROOT / file).read_bytes()).digest())
    return told.hexdigest()


CHECKS: dict[str, Callable[[], str]] = {
    "clang-format": clang_format,
    "black": python("black", "--check", "--quiet", "."),
    "flake8": python("flake8"),
    "mypy": python("mypy"),
    "shellcheck": shellcheck,
    "clang-tidy": clang_tidy,
}
