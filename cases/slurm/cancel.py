#!/usr/bin/python3
"""Withdraws jobs from Slurm, for Snakemake when it is stopped: another call may hand them in."""

import subprocess
import sys

import records
import status


def main(names: list[str]) -> int:
    lines, _ = status.ask(*status.SQUEUE, "--me")
    there = []
    for number, bundle in map(records.told, names):
        if number in [one for one, _ in status.among(lines, bundle)]:
            there.append(number)
            records.write(number, records.read(number) | {"state": records.WITHDRAWN})
    return subprocess.run(["scancel", *there]).returncode if there else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
