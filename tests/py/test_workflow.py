"""Many jobs: what stops them is one line, what was made is kept, and no text of a case reaches a
shell.
"""

import subprocess
import sys

import pytest

from cases import workflow
from cases.errors import EngineError
from cases.programs import ROOT

CI = ROOT / "cases" / "column_ci"
SNAKEFILE = """
rule all:
    input: expand("{job}.txt", job=config["jobs"])

rule job:
    output: "{job}.txt"
    log: "logs/{job}.log"
    params: file=config["file"]
    shell: "{PYTHON} job.py {{params.file}} {{wildcards.job}} 2> {{log}}"
"""
JOB = """
import json, sys
from pathlib import Path
config, job = json.loads(Path(sys.argv[1]).read_text()), sys.argv[2]
if job in config["failing"]:
    sys.exit(f"engine: job {job} lost its grains (a made-up reason)")
Path(f"{job}.txt").write_text("made")
"""


@pytest.fixture
def make(tmp_path):
    """Runs jobs by name, some of which fail, in one folder."""
    snakefile, folder = tmp_path / "Snakefile", tmp_path / "kept"
    snakefile.write_text(
        SNAKEFILE.replace("{PYTHON}", sys.executable).replace("{{", "{").replace("}}", "}")
    )
    folder.mkdir()
    (folder / "job.py").write_text(JOB)

    class Make:
        def __init__(self):
            self.folder = folder

        def __call__(self, *jobs, failing=()):
            config = {"jobs": jobs, "failing": failing}
            workflow.run(snakefile, folder, config, workflow.Where(cores=2), alone=True)

    return Make()


def test_a_job_that_fails_is_told_in_one_line_and_taken_up_again(make):
    with pytest.raises(EngineError, match="^engine: job b lost its grains .*logs/b.log") as error:
        make("a", "b", failing=["b"])
    assert "\n" not in str(error.value)
    made = (make.folder / "a.txt").stat().st_mtime_ns
    make("a", "b")
    assert (make.folder / "b.txt").read_text() == "made"
    assert (make.folder / "a.txt").stat().st_mtime_ns == made
    assert not list(make.folder.glob("config-*"))


def test_a_workflow_that_cannot_start_is_told_in_one_line(make):
    (make.folder.parent / "Snakefile").write_text("rule all:\n    input: nonsense(\n")
    with pytest.raises(EngineError, match="^snakemake: stopped") as error:
        make("a")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("title", ["'; touch X; '", '\\"; touch X; \\"', "$(touch X)", "`touch X`"])
def test_no_text_of_a_case_reaches_a_shell(tmp_path, monkeypatch, title):
    monkeypatch.setenv("GRAINPAIR_RUNS", str(tmp_path / "runs"))
    words = ["--seeds", "1", "--set", f'title="{title}"', "--table", tmp_path / "t.csv"]
    words += [
        "--set",
        "geometry.thickness=0.003",
    ]  # refused once the job has begun, which is all that is needed here
    command = [sys.executable, "-m", "dem_reference.ensemble", CI, *words]
    done = subprocess.run([str(w) for w in command], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 3 and "less than 2 grain diameters" in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1
    assert not [*tmp_path.rglob("X"), *ROOT.glob("X"), *ROOT.glob("runs/**/X")]
