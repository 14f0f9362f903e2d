#!/usr/bin/python3
"""Hands a job script of Snakemake's to Slurm and prints its number.

A job that is on the cluster already is not handed in again; nor is one that was cancelled, or that
has said itself why it cannot be done.
"""

import json
import re
import shlex
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import records
import status

KEYS = Path(__file__).with_name("cluster.toml")
END = "end-of-the-job"
PATIENCE, INTERVAL = 3600.0, 5.0  # [s] for a controller that has answered before


class Refused(Exception):
    """Why Slurm does not take a job."""


def bundle_of(job: dict) -> str:
    return job["wildcards"]["name"]


def words(job: dict, keys: dict) -> list[str]:
    """The command line of sbatch, which reads the script from its input."""
    need = job["resources"]
    out = ["sbatch", "--parsable", "--requeue", f"--job-name={records.name_of(bundle_of(job))}"]
    out += ["--nodes=1", f"--ntasks={job['threads']}", "--cpus-per-task=1"]
    out += [f"--mem={need['mem_mb']}M", f"--time={need['runtime']}"]
    out += [f"--output={records.FOLDER}/%j.out", "--open-mode=append"]
    for name in ("account", "partition", "qos"):
        out += [f"--{name}={keys[name]}"] * bool(keys[name])
    return out + keys["options"]


def script(text: str, keys: dict) -> str:
    """Snakemake's script with the cluster's modules before it, in the cluster's container."""
    lines = ["#!/bin/sh" if not keys["modules"] else "#!/bin/bash -l"]
    lines += [f"module load {shlex.quote(name)} || exit" for name in keys["modules"]]
    if keys["container"]:
        inside = shlex.join([keys["runtime"], "exec", keys["container"], "/bin/sh"])
        return "\n".join([*lines, f"exec {inside} << '{END}'", text, END, ""])
    return "\n".join([*lines, text, ""])


def refusal(before: dict) -> str:
    """Why another attempt is of no use; "" where it may be."""
    state, names = before.get("state", ""), before.get("names", [])
    if state == "CANCELLED":
        return "it was cancelled"
    logs = (Path("logs") / f"{name}.log" for name in names)
    if state == "FAILED" and any(said_why(log) for log in logs):
        return "it said why it failed"
    return ""


def said_why(log: Path) -> bool:
    """Whether a job has told of a failure of its own: not that it was interrupted, as by Slurm
    where its node fails.
    """
    said = log.read_text(errors="replace").strip() if log.exists() else ""
    return bool(said) and not said.endswith(": interrupted")


def main(path: str) -> int:
    text = Path(path).read_text()
    found = re.search(r"^# properties = (.*)$", text, re.MULTILINE)
    if not found:
        print(f"{path}: not a job script of Snakemake's", file=sys.stderr)
        return 2
    job, keys = json.loads(found[1]), tomllib.loads(KEYS.read_text())
    bundle, need = bundle_of(job), job["resources"]
    if need["attempt"] > 1 and (why := refusal(records.newest_of(bundle))):
        print(f"{bundle}: not handed in again, {why}", file=sys.stderr)
        return 1
    try:
        number, is_new = handed_in(bundle, words(job, keys), script(text, keys))
    except Refused as why:
        print(f"sbatch: {why}", file=sys.stderr)
        return 1
    if is_new or records.read(number).get("bundle") != bundle:
        record = {"bundle": bundle, "names": job["params"]["names"], "attempt": need["attempt"]}
        record |= {"memory": need["mem_mb"], "minutes": need["runtime"], "state": "PENDING"}
        records.write(number, record)
    print(f"{number}:{bundle}")
    return 0


def handed_in(bundle: str, command: list[str], text: str) -> tuple[str, bool]:
    """The number that Slurm knows a job by, and whether it is new: it may be there from a call that
    was killed, or sbatch's answer was lost. Waits for a controller that has answered before. Raises
    Refused.
    """
    until, known, why = time.monotonic() + PATIENCE, records.are_there(), ""
    records.FOLDER.mkdir(parents=True, exist_ok=True)  # sbatch wants it for the output
    while True:
        number, answered = status.on_cluster(bundle)
        if number:
            return number, False
        if answered or not known:
            if why:
                raise Refused(why)
            done = subprocess.run(command, input=text, capture_output=True, text=True)
            if done.returncode == 0:  # of several clusters, its name follows
                return done.stdout.strip().split(";")[0], True
            why = (done.stderr.strip() or "failed").splitlines()[-1]
        elif time.monotonic() > until:
            raise Refused("the controller of Slurm does not answer")
        else:
            why = ""
            time.sleep(INTERVAL)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
