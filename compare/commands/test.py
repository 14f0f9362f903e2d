"""Run every test that CI runs: C++ and Python, with the real grain engine."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

from cases.programs import ROOT, program


def arguments(parser):
    parser.add_argument("--slow", action="store_true", help="also the tests that take minutes")
    parser.add_argument("--only", metavar="WORD", help="the tests whose name contains WORD")


def run(options) -> int:
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as scratch:
        cpp, python = Path(scratch) / "cpp.xml", Path(scratch) / "python.xml"
        ctest = [
            "ctest",
            "--test-dir",
            program(""),
            "-j",
            str(os.cpu_count()),
            "--output-on-failure",
            "--progress",
            "--no-tests=ignore",
            "--output-junit",
            cpp,
        ]
        pytest = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            ROOT / "tests" / "py",
            f"--junitxml={python}",
        ]
        if options.only:
            ctest += ["-R", options.only]
            pytest += ["-k", options.only]
        if not options.slow:
            ctest += ["-E", "^Slow"]
            pytest += ["-m", "not slow"]
        codes = [
            subprocess.run(ctest, cwd=ROOT).returncode,
            subprocess.run(pytest, cwd=ROOT).returncode,
        ]
        codes[1] *= codes[1] != 5  # pytest: no test has such a name
        counts = [count(report) for report in (cpp, python)]
    print(
        f"grainpair test: {'FAILED' if any(codes) else 'passed'} in {time.monotonic() - start:.0f} s (C++ {counts[0]}; "
        f"Python {counts[1]})"
    )
    return int(any(codes))


def count(report: Path) -> str:
    """ "12 passed, 1 failed, 0 skipped" of a JUnit report."""
    if not report.exists():
        return "not run"
    suites = list(ElementTree.parse(report).getroot().iter("testsuite"))
    total, failed, skipped = (
        sum(int(suite.get(word, 0)) for suite in suites)
        for word in ("tests", "failures", "skipped")
    )
    failed += sum(int(suite.get("errors", 0)) for suite in suites)
    return f"{total - failed - skipped} passed, {failed} failed, {skipped} skipped"
