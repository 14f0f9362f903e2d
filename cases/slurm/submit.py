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
import tomllib
from pathlib import Path

import records
import status

KEYS = Path(__file__).with_name("cluster.toml")
END = "end-of-the-job"


def words(job: dict, keys: dict) -> list[str]:
    """The command line of sbatch, which reads the script from its input."""
    need = job["resources"]
    out = ["sbatch", "--parsable", "--requeue", f"--job-name=grainpair-{job['wildcards']['name']}"]
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
    if state == "FAILED" and any(log.exists() and log.stat().st_size for log in logs):
        return "it said why it failed"
    return ""


def main(path: str) -> int:
    text = Path(path).read_text()
    found = re.search(r"^# properties = (.*)$", text, re.MULTILINE)
    if not found:
        print(f"{path}: not a job script of Snakemake's", file=sys.stderr)
        return 2
    job, keys = json.loads(found[1]), tomllib.loads(KEYS.read_text())
    bundle, need = job["wildcards"]["name"], job["resources"]
    number, before = records.newest_of(bundle)
    if need["attempt"] > 1 and (why := refusal(before)):
        print(f"{bundle}: not handed in again, {why}", file=sys.stderr)
        return 1
    if number and status.state_of(number) in status.GOES_ON:  # by a call that was killed
        print(number)
        return 0
    records.FOLDER.mkdir(parents=True, exist_ok=True)  # sbatch wants it for the output
    command = words(job, keys)
    done = subprocess.run(command, input=script(text, keys), capture_output=True, text=True)
    if done.returncode:
        print(f"sbatch: {(done.stderr.strip() or 'failed').splitlines()[-1]}", file=sys.stderr)
        return 1
    number = done.stdout.strip().split(";")[0]  # of several clusters, its name follows
    record = {"bundle": bundle, "names": job["params"]["names"], "attempt": need["attempt"]}
    record |= {"memory": need["mem_mb"], "minutes": need["runtime"], "state": "PENDING"}
    records.write(number, record)
    print(number)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
