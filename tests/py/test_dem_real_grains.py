"""Grains of several sizes that resist rolling, walls of another restitution, a gate that lifts
them: on the smallest column, every account against what would be missing without it.
"""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy import stats

from cases.case import load
from compare.mapping.runs import open_run
from compare.verdict.budget import budget
from dem_reference import edge, second_opinion, summary
from dem_reference.collision import place
from dem_reference.contacts import Snapshot
from dem_reference.grains import Grains
from dem_reference.process import run_engine
from dem_reference.run import main

CASE = "cases/column_ci"
S = 0.2
REAL = [f"grains.size_spread={S}", "grains.rolling_friction=0.1", "walls.restitution=0.5"]
QUICK = ["dem.void_ratio_tolerance=0.2"]  # the first attempt at the packing will do
EVERY_STEP = ["time.maximum=1.5", "dem.audit_interval=1"]
CLOSED = 1e-3  # of the energy released: what the balance of every step leaves open at most


def run(path: Path, store: Path, *sets: str, words=()) -> Path:
    assigned = [word for one in sets for word in ("--set", one)]
    words = ["-o", str(path), "--packings", str(store), "--quiet", *assigned, *words]
    assert main([CASE, *words]) == 0
    return path


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("packings")


@pytest.fixture(scope="module")
def real(tmp_path_factory, store):
    path = tmp_path_factory.mktemp("real") / "dem.h5"
    return run(path, store, *REAL, *QUICK, *EVERY_STEP)


@pytest.fixture(scope="module")
def lifted(tmp_path_factory, store):
    """A gate whose edge is at two thirds of the column at the end."""
    gate = ['walls.gate="lifted"', "walls.gate_speed=0.1", "time.maximum=3.0"]
    path = tmp_path_factory.mktemp("lifted") / "dem.h5"
    return run(path, store, *QUICK, "dem.audit_interval=1", *gate)


def energies(path: Path) -> tuple[dict, float]:
    """The history, and the energy released [J]."""
    with h5py.File(path) as file:
        energy = {name: values[()] for name, values in file["energy"].items()}
    return energy, energy["potential"][0] - energy["potential"][-1]


def test_diameters_are_spread_evenly_by_number():
    grains = Grains(2e-3, 2500.0, 5e6, 0.3, 0.88, 0.5, size_spread=S)
    d = grains.diameters(1000, np.random.default_rng(1))
    assert np.sort(d) == pytest.approx(2e-3 * np.linspace(1 - S * 0.999, 1 + S * 0.999, 1000))
    assert np.pi / 6 * (d**3).mean() == pytest.approx(grains.mean_volume, rel=1e-6)
    two = Grains(2e-3, 2500.0, 5e6, 0.3, 0.88, 0.5, sizes="two", size_spread=S)
    d = two.diameters(10, np.random.default_rng(1))
    assert sorted(d) == pytest.approx([1.6e-3] * 5 + [2.4e-3] * 5)
    assert np.pi / 6 * (d**3).mean() == pytest.approx(two.mean_volume, rel=1e-12)


def test_the_file_tells_each_grains_size(real):
    """Of those poured a twenty-fifth lay above the column."""
    with h5py.File(real) as file:
        cloud = file["data/0/particles/cloud"]
        kind, radius = cloud["kind"][()], cloud["radius"][()]
        volume, mass = cloud["solid_volume"][()], cloud["mass"][()]
        told, packing = dict(file.attrs), dict(file["packing"].attrs)
    moving = radius[kind == 1]
    assert np.all(radius[kind == 3] == 1e-3)
    # a random share of an even distribution: its mean is off by s/sqrt(3 n), of which three
    assert moving.mean() == pytest.approx(1e-3, rel=3 * S / np.sqrt(3 * moving.size))
    assert 0.8e-3 <= moving.min() < 0.81e-3 and 1.19e-3 < moving.max() <= 1.2e-3
    assert volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=1e-12)
    assert mass == pytest.approx(load(CASE)["grains.density"] * volume, rel=1e-12)
    assert packing["mass"] == pytest.approx(mass[kind == 1].sum(), rel=1e-12)
    assert told["diameter"] == pytest.approx(2 * (moving**4).sum() / (moving**3).sum())
    assert open_run(real).diameter == told["diameter"]
    column = 0.02 * 0.02 * 0.006
    assert packing["void_ratio_overall"] == pytest.approx(column / volume[kind == 1].sum() - 1)


def test_the_balance_closes_to_a_thousandth(real):
    energy, released = energies(real)
    assert np.abs(energy["unaccounted"]).max() < CLOSED * released
    parts = ("normal", "tangential", "rolling", "wall")
    total = sum(energy[f"dissipated_{part}"] for part in parts)
    assert energy["dissipated"] == pytest.approx(total, abs=1e-12 * released)
    with h5py.File(real) as file:
        assert file.attrs["force_error"] < 1e-12  # of a weight of 1e-4 N
        assert file.attrs["torque_error"] < 1e-15  # of a weight at a radius, 1e-7 N m


@pytest.mark.parametrize("account", ["dissipated_rolling", "elastic_rolling"])
def test_without_an_account_of_rolling_it_does_not(real, account):
    energy, released = energies(real)
    missing = np.abs(energy["unaccounted"] + energy[account] - energy[account][0]).max()
    assert missing > (CLOSED if account.startswith("d") else 0.0) * released
    if account == "dissipated_rolling":
        assert missing > 10 * CLOSED * released


def test_grains_push_a_gate_that_rises(lifted):
    """Its edge stands on them: what it does on them is negative, and without it the balance is off
    by more than it may be.
    """
    energy, released = energies(lifted)
    assert np.abs(energy["unaccounted"]).max() < CLOSED * released
    without = energy["unaccounted"] - energy["gate_work"]
    assert energy["gate_work"][-1] < -CLOSED * released < CLOSED * released < without[-1]
    side = open_run(lifted)
    side.reference_energy = released
    account = {one.name: one.values for one in budget(side, split=False)}
    assert account["work of the gate"] == pytest.approx(-energy["gate_work"] / released)
    assert np.abs(account["residual"]).max() < CLOSED


def test_a_plain_run_has_none_of_these_accounts(store, tmp_path):
    path = run(tmp_path / "dem.h5", store, "time.maximum=0.05", *QUICK)
    with h5py.File(path) as file:
        assert not {"dissipated_rolling", "elastic_rolling", "gate_work"} & set(file["energy"])
        assert not {"diameter", "torque_error"} & set(file.attrs)
        assert "dissipated_rolling" not in file["lifetime"]


def meet(case: dict, grains: Grains, dt: float, log: Path, report) -> np.ndarray:
    """Pairs of a grain and one of six tenths of its size meet and part: kinetic energy before and
    after [J], and the work done on their contacts, normal, tangential, rolling (3,) [J].
    """
    speed = np.array([0.1, 0.3, 1.0])
    v = np.column_stack([speed, speed, 0 * speed]) / 2
    engine = place(case, grains, dt, speed, v, log)
    ids = np.arange(1, 2 * speed.size + 1)
    size = np.where(ids > speed.size, 0.6, 1.0) * grains.diameter
    engine.resize(ids, size, grains.density)
    engine.command("run 0")

    def energy() -> float:
        atoms = engine.atoms()
        m = grains.density * 4 / 3 * np.pi * atoms["radius"] ** 3
        spin = 0.4 * m * atoms["radius"] ** 2 * (atoms["omega"] ** 2).sum(axis=1)
        return float((m * (atoms["v"] ** 2).sum(axis=1) + spin).sum() / 2)

    before, work, worst, met = energy(), np.zeros(3), 0.0, 0
    for _ in range(int((0.4 * grains.diameter / speed.min() + 5e-4) / dt)):
        engine.advance(1)
        shot = Snapshot(grains, engine.atoms(), engine.contacts(), dt, 0.0, None, [])
        work += shot.work_rate_parts.sum(axis=0) * dt
        worst, met = max(worst, shot.held.torque_error), max(met, len(shot.i))
    assert met > 0 and len(shot.i) == 0 and worst < 1e-15
    return np.array([before, energy(), *work])


@pytest.mark.parametrize("model", ["epsd", "epsd2"])
def test_unequal_grains_that_roll_close_to_round_off(model, tmp_path):
    case = load(CASE, ["grains.rolling_friction=0.1", f"grains.rolling_model={model}"]).values
    grains, log = replace(Grains.of(case), size_spread=0.4), tmp_path / "log"
    dt = 0.1 * grains.rayleigh_time()
    before, after, *work = run_engine(meet, case, grains, dt, log, log=log).result
    assert sum(work) == pytest.approx(before - after, rel=1e-12)
    assert work[2] > 1e-4 * (before - after)  # what would be missing without rolling


def test_a_script_runs_the_same_grains(store, tmp_path):
    sets = [*REAL, *QUICK, "time.maximum=0.2"]
    paths = [
        run(tmp_path / "a.h5", store, *sets),
        run(tmp_path / "b.h5", store, *sets, words=("--driver", "script")),
    ]
    ends = []
    for path in paths:
        with h5py.File(path) as file:
            cloud = file[f"data/{file.attrs['steps']}/particles/cloud"]
            ends.append({name: cloud[name][()] for name in ("radius", "position/y", "mass")})
    for name, values in ends[0].items():
        assert np.array_equal(values, ends[1][name]), name


def test_lammps_is_told_the_same_grains(real, tmp_path):
    text, _ = second_opinion.input_files(real, tmp_path)
    rows = (tmp_path / "grains.data").read_text().split("Atoms # sphere\n\n")[1].splitlines()
    told = np.array([row.split() for row in rows], float)
    with h5py.File(real) as file:
        assert told[:, 2] / 2 == pytest.approx(file["data/0/particles/cloud/radius"][()])
    words = text.split(" rolling sds ")[1].split()
    assert float(words[2]) == 0.1 and words[3] == "damping"
    at_wall = [line for line in text.splitlines() if "wall/gran" in line]
    assert len(at_wall) == 3 and not any("rolling" in line for line in at_wall)
    between = next(line for line in text.splitlines() if line.startswith("pair_coeff"))
    assert between.split()[5] != at_wall[0].split()[7]  # restitution


def test_a_summary_counts_mass_not_grains(real):
    found, at_edge = summary.scalars(real), edge.row(real)
    with h5py.File(real) as file:
        cloud = file[f"data/{file.attrs['steps']}/particles/cloud"]
        moving = cloud["kind"][()] == 1
        x, mass = cloud["position/x"][()][moving], cloud["mass"][()][moving]
    # the grain that is there is not beyond, however its place was rounded
    beyond = mass[x > (found["run_out_99"] + 1) * 0.02 * (1 + 1e-12)].sum() / mass.sum()
    assert beyond <= 0.01 < beyond + mass.max() / mass.sum()
    assert 0.0 < at_edge["run_out_edge"] <= found["run_out"] + 0.1
    assert found["dissipated_rolling"] > 0.0 and "gate_work" not in found
    y = np.array([0.0, 1.0, 2.0])
    assert summary.quantile(y, np.array([1.0, 1.0, 8.0]), 0.5) == 2.0
    assert summary.quantile(y, np.ones(3), 0.5) == 1.0


REFERENCE = Path(CASE) / "reference"


def column(kind: str, name: str, engine: str = "") -> pd.Series:
    """Of a table of eight packings, or of the two engines' on them."""
    table = pd.read_csv(REFERENCE / f"real_{kind}{'_lammps' if engine else ''}.csv", comment="#")
    return (table[table["engine"] == engine] if engine else table)[name]


def differ(a: pd.Series, b: pd.Series, level: float = 0.01) -> bool:
    """Welch's test, two-sided: of eight packings each, at 1 %, a difference of 1.6 standard
    deviations shows.
    """
    return bool(stats.ttest_ind(a, b, equal_var=False).pvalue < level)


@pytest.mark.parametrize(
    ("kind", "looser", "shorter", "higher"),
    [("sizes", -1, 0, 0), ("rolling", 1, 1, 1), ("both", 0, 1, 1)],
)
def test_what_sizes_and_rolling_change_is_beyond_the_scatter(kind, looser, shorter, higher):
    """Poured alike; what the README tells. Zero: within the packings' scatter."""
    for name, way in (
        ("void_ratio", looser),
        ("run_out_99", -shorter),
        ("highest_grain_at_wall", higher),
    ):
        plain, other = column("plain", name), column(kind, name)
        assert differ(plain, other) == bool(way), name
        assert way * (other.mean() - plain.mean()) >= 0.0, name


@pytest.mark.parametrize("kind", ["plain", "sizes", "rolling", "both"])
def test_lammps_agrees_within_the_scatter_of_packings(kind):
    """Sixteen comparisons, 5 % of error for all together."""
    for name in ("run_out", "run_out_99", "highest_grain_at_wall", "rotational_peak"):
        ours, theirs = (column(kind, name, engine) for engine in ("liggghts", "lammps"))
        assert not differ(ours, theirs, 0.05 / 16), name


def test_lammps_does_not_where_the_dashpot_is_another():
    """EPSD adds its dashpot to a spring below the bound, `rolling sds` cuts the sum."""
    ours, theirs = (
        column("rolling_epsd", "rotational_peak", engine) for engine in ("liggghts", "lammps")
    )
    assert differ(ours, theirs, 0.05 / 16)
