"""`run --ranks`: both engines share their scene, the siblings do not; and what cannot be shared is
told before anything runs.
"""

import os
import shutil
import subprocess

import pytest

from cases.case import load
from cases.cores import RANK_BYTES
from cases.errors import CaseError
from cases.programs import ROOT, module, program
from compare import __main__ as cli
from compare.commands import run

CI = ROOT / "cases" / "column_ci"
FINE = ["--set", "mpm.cell_size=0.001"]
has_mpi = pytest.mark.skipif(
    not program("mpm_run_ranks").exists() or not shutil.which("mpirun"), reason="no MPI"
)


class Stopped(Exception):
    """Before the comparison."""


@pytest.fixture
def stages(tmp_path, monkeypatch):
    """The command lines that a run starts, by the names of their stages."""

    def of(*words) -> dict[str, list[str]]:
        found = {}

        def keep(chains, **_):
            for one in (stage for chain in chains for stage in chain):
                found[one.name] = [str(word) for word in one.command]
            raise Stopped

        monkeypatch.setattr(run, "run_chains", keep)
        monkeypatch.setattr("cases.cores.usable", lambda: 8)
        monkeypatch.setattr(run, "refuse_without_mpi", lambda: None)
        out = tmp_path / "out"
        with pytest.raises(Stopped):
            cli.main(["run", str(CI), *map(str, words), "--quiet", "--out", str(out)])
        return found

    return of


def after(words: list[str], option: str) -> str:
    """What an option is told, "" where it is not there."""
    return words[words.index(option) + 1] if option in words else ""


@has_mpi
def test_both_engines_share_their_scene(stages):
    found = stages(*FINE, "--ranks", 2)
    ranks = {name: after(words, "--ranks") for name, words in found.items()}
    assert ranks == {
        "grains (DEM)": "2",
        "continuum (MPM)": "2",
        "continuum, coarser cells": "",
        "continuum, slower filters": "",
    }
    assert all("--ranks" not in words for words in stages(*FINE).values())
    # an ensemble takes as many seeds at a time as there are cores for
    grains = stages(*FINE, "--ranks", 2, "--seeds", 9)["grains (DEM), 9 seeds"]
    assert (after(grains, "--ranks"), after(grains, "--jobs")) == ("2", "3")


def test_a_job_has_a_core_for_every_thread_of_every_rank(stages, tmp_path):
    profile = ROOT / "cases" / "slurm"
    found = stages(*FINE, "--ranks", 2, "--threads", 3, "--profile", profile)
    grains = found.pop("grains (DEM), 1 seeds")  # dem_reference.ensemble tells its jobs
    assert after(grains, "--ranks") == "2"
    cores = {name: after(words, "--cores") for name, words in found.items()}
    assert cores == {
        "continuum (MPM)": "6",
        "continuum, coarser cells": "3",
        "continuum, slower filters": "3",
    }
    continuum, coarse, _ = (float(after(words, "--bytes")) for words in found.values())
    assert continuum - coarse == pytest.approx(RANK_BYTES)


@has_mpi
def test_what_the_continuum_refuses_is_told_at_once_in_its_words(tmp_path):
    said = "the column is 10 cells long (a rank takes 8 at least)"
    path = ROOT / "cases" / "column_ci" / "case.toml"
    words = [path, "--ranks", "2", "--set", "mpm.cell_size=0.002"]
    theirs = [program("mpm_run"), *words, "-o", tmp_path / "mpm.h5"]
    ours = module("compare", "run", *words, "--out", tmp_path / "out")
    lines = []
    for command in (theirs, ours):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
        assert done.returncode == 2 and said in done.stderr
        lines.append(done.stderr)
    assert lines[0] == lines[1]
    assert list(tmp_path.iterdir()) == []


def test_without_mpi_nothing_is_run(tmp_path):
    environment = os.environ | {"PATH": str(tmp_path)}
    pair, seeds = module("compare", "run", CI, *FINE), module("dem_reference.ensemble", CI)
    for command in ([*pair, "--ranks", "2"], [*seeds, "--ranks", "2"]):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
        assert done.returncode == 3 and "mpirun: no such program" in done.stderr
        assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_without_its_program_the_continuum_is_refused_first(monkeypatch):
    scene = load(CI, FINE[1:])
    monkeypatch.setattr(run, "refuse_without_mpi", lambda: None)
    monkeypatch.setenv("GRAINPAIR_BUILD", "/nowhere")
    with pytest.raises(CaseError, match="mpm_run_ranks is not there .* libopenmpi-dev"):
        run.refuse_to_share(scene, 2, here=True)
    run.refuse_to_share(scene, 2, here=False)  # nodes of a cluster may have other programs
