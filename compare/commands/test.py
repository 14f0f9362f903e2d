"""Run every test that CI runs: C++ and Python, with the real grain engine.

With --only and the name of a law (a file of mpm/materials), only what that law decides is built and
run: the battery that every law passes and the tests that name it.
"""

import os
import re
import subprocess
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

from cases import cores
from cases.programs import ROOT, module, program

CPP = ROOT / "tests" / "cpp"
BATTERY = "material_test"  # runs over every law that is registered
PACKAGES = ["laws", "studies", "test"]
ALONE = 20  # tests that may be tried once more: what spoils more is no accident


def arguments(parser):
    parser.add_argument("--slow", action="store_true", help="also the tests that take minutes")
    parser.add_argument(
        "--only", metavar="WORD", help="tests whose name contains WORD; of a law, all that test it"
    )


def targets(words: list[str]) -> list[str]:
    """What to build for the command line `words`: of a law the programs that test it, else all."""
    law = next(
        (
            word.removeprefix("--only=") if word.startswith("--only=") else following
            for word, following in zip(words, [*words[1:], ""])
            if word == "--only" or word.startswith("--only=")
        ),
        "",
    )
    return list(tests_of(law)) if is_law(law) else ["all"]


def is_law(word: str) -> bool:
    return (
        bool(re.fullmatch(r"\w+", word)) and (ROOT / "mpm" / "materials" / f"{word}.cpp").exists()
    )


def tests_of(law: str) -> dict[str, str]:
    """The test programs that a law decides, each with its filter for GoogleTest.

    Of a file named after the law, and of one that names it before its first test, every test; else,
    and of the battery, which runs over all laws, the tests that name it and the instances that have
    it as their parameter.
    """
    found = {}
    for file in sorted(CPP.glob("*_test.cpp")):
        head, *blocks = re.split(r"^(?=TEST|INSTANTIATE_)", file.read_text(), flags=re.MULTILINE)
        named = re.compile(rf"\b{law}\b")
        if file.stem == f"{law}_test" or (file.stem != BATTERY and named.search(head)):
            found[file.stem] = "*"
            continue
        names = [
            f"*{suite}.{name}*"
            for block in blocks
            if named.search(block)
            for suite, name in re.findall(r"^TEST\w*\((\w+),\s*(\w+)\)", block)
        ]
        instances = any(named.search(block) for block in blocks if block.startswith("INST"))
        if names or instances or file.stem == BATTERY:
            found[file.stem] = ":".join([f"*/{law}", *names])
    return found


def run(options) -> int:
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as scratch:
        reports = Path(scratch)
        only = options.only or ""
        codes = [
            law_tests(only, reports) if is_law(only) else ctest(options, reports),
            pytest(options, reports),
        ]
        cpp, python = count(reports.glob("cpp*.xml")), count(reports.glob("python.xml"))
    print(
        f"grainpair test: {'FAILED' if any(codes) else 'passed'} in "
        f"{time.monotonic() - start:.0f} s (C++ {cpp}; Python {python})"
    )
    return int(any(codes))


def ctest(options, reports: Path) -> int:
    command = ["ctest", "--test-dir", str(program("")), "-j", str(os.cpu_count())]
    command += ["--output-on-failure", "--progress", "--no-tests=ignore"]
    command += ["--output-junit", str(reports / "cpp.xml")]
    if options.only:
        command += ["-R", options.only]
    if not options.slow:
        command += ["-E", "^Slow"]
    return subprocess.run(command, cwd=ROOT).returncode


def law_tests(law: str, reports: Path) -> int:
    """Runs the programs of `tests_of`, side by side."""
    environment = os.environ | {"GOMP_SPINCOUNT": "0"}  # threads that wait leave the cores alone
    running = [
        subprocess.Popen(
            [
                str(program(f"tests/{name}")),
                f"--gtest_filter={chosen}",
                "--gtest_brief=1",
                f"--gtest_output=xml:{reports / f'cpp_{name}.xml'}",
            ],
            cwd=ROOT,
            env=environment,
        )
        for name, chosen in tests_of(law).items()
    ]
    return max(abs(one.wait()) for one in running)


def pytest(options, reports: Path) -> int:
    """Tests drive browsers, clusters and engines on a machine that others use: what failed beside
    others is tried once more alone, and said where it passes then.
    """
    words = ["--numprocesses", str(cores.usable())]
    # tests of a file share what takes long to make
    words += ["--dist", "loadfile", str(ROOT / "tests" / "py")]
    if options.only:
        words += ["-k", options.only]
    if not options.slow:
        words += ["-m", "not slow"]
    code = call_pytest(words, reports / "python.xml")
    failed = outcomes(reports / "python.xml", failed=True) if code == 1 else []
    if 0 < len(failed) <= ALONE:
        print(f"grainpair test: once more and alone: {len(failed)} that failed", flush=True)
        code = call_pytest(failed, reports / "again.xml")
        passed = outcomes(reports / "again.xml", failed=False)
        for name in failed:
            print(f"grainpair test: {name} failed, and alone {'not' if name in passed else 'too'}")
    return 0 if code == 5 else code  # 5: no test has such a name


def call_pytest(words: list[str], report: Path) -> int:
    place = ["--rootdir", str(ROOT), "-c", str(ROOT / "tests" / "pytest.ini")]  # of tests' names
    command = module("pytest", "-q", f"--junitxml={report}", *place, *words)
    return subprocess.run(command, cwd=ROOT).returncode


def outcomes(report: Path, failed: bool) -> list[str]:
    """Tests that failed, or that did not, as pytest takes them."""
    return [
        f"{case.get('classname', '').replace('.', '/')}.py::{case.get('name')}"
        for case in ElementTree.parse(report).getroot().iter("testcase")
        if failed == any(case.find(word) is not None for word in ("failure", "error"))
    ]


def count(reports) -> str:
    """ "12 passed, 1 failed, 0 skipped" of JUnit reports."""
    suites = [
        suite
        for report in reports
        for suite in ElementTree.parse(report).getroot().iter("testsuite")
    ]
    if not suites:
        return "not run"
    total, failed, skipped = (
        sum(int(suite.get(word, 0)) for suite in suites)
        for word in ("tests", "failures", "skipped")
    )
    failed += sum(int(suite.get("errors", 0)) for suite in suites)
    return f"{total - failed - skipped} passed, {failed} failed, {skipped} skipped"
