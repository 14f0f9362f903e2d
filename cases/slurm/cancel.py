#!/usr/bin/python3
"""Withdraws jobs from Slurm, for Snakemake when it is stopped: another call may hand them in."""

import subprocess
import sys

import records


def main(numbers: list[str]) -> int:
    for number in numbers:
        if record := records.read(number):
            records.write(number, record | {"state": records.WITHDRAWN})
    return subprocess.run(["scancel", *numbers]).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
