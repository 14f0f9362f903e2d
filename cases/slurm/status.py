#!/usr/bin/python3
"""Tells Snakemake what has become of a job of Slurm's: success, failed or running."""

import subprocess
import sys
import time

import records

# States from which a job goes on by itself
GOES_ON = {"PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "STOPPED", "SIGNALING"}
GOES_ON |= {"REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "RESIZING", "STAGE_OUT", "RESV_DEL_HOLD"}
NODE_FAIL, PATIENCE = "NODE_FAIL", 5  # [s] in which Slurm puts such a job back, if it does
UNREACHABLE = "UNREACHABLE"
UNKNOWN = "UNKNOWN"


def ask(*words: str) -> tuple[str, bool]:
    """The first word of the first line of an answer, and whether there was one."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return "", False
    # an unknown number is an answer, too
    answered = done.returncode == 0 or "Invalid job id" in done.stderr
    return (done.stdout.split() or [""])[0].rstrip("+"), answered


def state_of(number: str) -> str:
    """Slurm's word for it: of what is at hand, else of the accounts, where they are kept."""
    state, answered = ask("squeue", "--noheader", "--states=all", "--format=%T", f"--jobs={number}")
    if state:
        return state
    kept, _ = ask("sacct", "-X", "--noheader", "--parsable2", "--format=State", f"--jobs={number}")
    return kept or (UNKNOWN if answered else UNREACHABLE)


def main(number: str) -> int:
    state = state_of(number)
    for _ in range(PATIENCE):
        if state == NODE_FAIL:
            time.sleep(1.0)
            state = state_of(number)
    if state in GOES_ON or state == UNREACHABLE:  # which may pass: the controller is away
        print("running")
        return 0
    record = records.read(number)
    if record and record["state"] != records.WITHDRAWN:
        records.write(number, record | {"state": state})
    print("success" if state == "COMPLETED" else "failed")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
