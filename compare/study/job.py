"""What every program that a sweep starts is called like: CONFIG KEY -o RESULT.json."""

import argparse
import json
from pathlib import Path

from cases.files import write_atomically


def run(program: str, doc: str, make) -> int:
    """make(case, task) -> what RESULT.json holds; CONFIG names the case and, under KEY, the task (compare/study/sweep.py)."""
    parser = argparse.ArgumentParser(prog=program, description=doc.splitlines()[0])
    parser.add_argument("config", type=Path)
    parser.add_argument("key")
    parser.add_argument("-o", "--out", type=Path, required=True)
    options = parser.parse_args()
    config = json.loads(options.config.read_text())
    write_atomically(
        options.out, json.dumps(make(Path(config["case"]), config["recipes"][options.key]))
    )
    return 0
