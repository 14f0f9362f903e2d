#!/usr/bin/python3
"""Tells Snakemake what has become of a job of Slurm's: success, failed or running."""

import subprocess
import sys
import time
from pathlib import Path

import records

# States from which a job goes on by itself
GOES_ON = {"PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "STOPPED", "SIGNALING"}
GOES_ON |= {"REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "RESIZING", "STAGE_OUT", "RESV_DEL_HOLD"}
NODE_FAIL, PATIENCE = "NODE_FAIL", 5  # [s] in which Slurm puts such a job back, if it does
UNREACHABLE = "UNREACHABLE"
UNKNOWN = "UNKNOWN"
SQUEUE = ("squeue", "--noheader", "--format=%i|%T|%j|%Z")
SACCT = ("sacct", "-X", "--noheader", "--parsable2", "--format=JobIDRaw,State,JobName,WorkDir")


def ask(*words: str) -> tuple[list[list[str]], bool]:
    """The lines of an answer, each a job's number, state, name and folder, and whether there was
    an answer.
    """
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return [], False
    # an unknown number is an answer, too
    answered = done.returncode == 0 or "Invalid job id" in done.stderr
    lines = (line.strip().split("|", 3) for line in done.stdout.splitlines())
    return [line for line in lines if len(line) == 4], answered


def among(lines: list[list[str]], bundle: str) -> list[tuple[str, str]]:
    """Numbers and states of those jobs that are what Snakemake calls so in this folder: once a
    controller has lost its state it deals out the same numbers again.
    """
    return [
        (number, (state.split() or [UNKNOWN])[0].rstrip("+"))  # "CANCELLED by 1000"
        for number, state, name, folder in lines
        if name == records.name_of(bundle) and records.is_here(folder)
    ]


def on_cluster(bundle: str) -> tuple[str, bool]:
    """The number of the job that is at work on a bundle, or waits, "" where there is none; and
    whether Slurm has answered.
    """
    lines, answered = ask(*SQUEUE, "--me", f"--name={records.name_of(bundle)}")
    found = [number for number, state in among(lines, bundle) if state in GOES_ON]
    return (found or [""])[-1], answered


def state_of(number: str, bundle: str) -> str:
    """Slurm's word for it: of what is at hand, else of the accounts, where they are kept."""
    lines, answered = ask(*SQUEUE, "--states=all", f"--jobs={number}")
    kept, _ = (lines, True) if among(lines, bundle) else ask(*SACCT, f"--jobs={number}")
    for _, state in among(kept, bundle):
        return state
    return UNKNOWN if answered else UNREACHABLE


def main(name: str) -> int:
    number, bundle = records.told(name)
    state = state_of(number, bundle)
    for _ in range(PATIENCE):
        if state == NODE_FAIL:
            time.sleep(1.0)
            state = state_of(number, bundle)
    if state in GOES_ON or state == UNREACHABLE:  # which may pass: the controller is away
        print("running")
        return 0
    if state == UNKNOWN and (Path("bundles") / bundle).exists():  # forgotten since
        state = "COMPLETED"
    record = records.read(number)
    if record.get("bundle") == bundle and record["state"] != records.WITHDRAWN:
        records.write(number, record | {"state": state})
    print("success" if state == "COMPLETED" else "failed")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
