"""What the grains refuse, and an engine that is missing or stops, each in one line."""

import subprocess
import sys

import pytest

from cases.errors import CaseError, EngineError
from dem_reference import engine
from dem_reference.process import run_engine

CASE = "cases/column_ci"


def run(*words):
    return subprocess.run(
        [sys.executable, "-m", "dem_reference.run", CASE, *words],
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_step_above_the_contact_limit_is_bad_input(tmp_path):
    done = run("-o", str(tmp_path / "dem.h5"), "--set", "dem.time_step_fraction=0.4")
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1 and "contact limit" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_slab_thinner_than_the_grains_is_bad_input(tmp_path):
    done = run("-o", str(tmp_path / "dem.h5"), "--set", "geometry.thickness=0.003")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "geometry.thickness" in done.stderr


def test_a_missing_engine_is_said_in_one_line(monkeypatch):
    monkeypatch.setattr(engine, "LIBRARY", "libno_such_engine.so.3")
    with pytest.raises(EngineError, match="libno_such_engine.so.3 cannot be loaded .* install"):
        engine.load_library()


def bad_command(folder, report):
    engine.Liggghts(folder / "log").commands("units si\natom_style granular\nno_such_command 1 2 3")


def test_the_engines_own_error_line_is_reported(tmp_path):
    with pytest.raises(
        EngineError, match="LIGGGHTS: stopped with code 1 .*Unknown command: no_such_command"
    ):
        run_engine(bad_command, tmp_path, log=tmp_path / "log")


def lose_a_grain(folder, report):
    """A box with fixed faces and no floor: the grain falls out."""
    lines = """units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
region domain block 0 0.1 0 0.1 0 0.1 units box
create_box 1 domain
neighbor 0.0004 bin
fix young all property/global youngsModulus peratomtype 5e6
fix poisson all property/global poissonsRatio peratomtype 0.3
fix restitution all property/global coefficientRestitution peratomtypepair 1 0.9
fix friction all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hertz tangential history
pair_coeff * *
create_atoms 1 single 0.05 0.01 0.05 units box
set type 1 density 2500 diameter 0.002
fix gravity all gravity 9.81 vector 0 -1 0
fix motion all nve/sphere
thermo_style custom step atoms
thermo_modify lost error norm no
thermo 100
timestep 1e-4
run 10000
"""
    engine.Liggghts(folder / "log").commands(lines)


def test_lost_grains_stop_the_run(tmp_path):
    with pytest.raises(EngineError, match="(?i)lost atoms"):
        run_engine(lose_a_grain, tmp_path, log=tmp_path / "log")


def count_to(number, report):
    for k in range(number):
        report((k + 1) / number, f"at {k + 1}")
    if number > 3:
        raise CaseError("three at most")
    return number


def test_work_reports_and_returns_and_its_refusal_comes_back(tmp_path):
    said = []
    done = run_engine(count_to, 2, log=tmp_path / "log", report=lambda *words: said.append(words))
    assert done.result == 2 and done.cpu_seconds > 0
    assert said == [(0.5, "at 1"), (1.0, "at 2")]
    with pytest.raises(CaseError, match="three at most"):
        run_engine(count_to, 4, log=tmp_path / "log")
