"""The library that keeps the grains' accounts, against the same in plain Python, and in parts."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import grain_oracle as oracle
from cases.case import load
from dem_reference import packing
from dem_reference.collapse import Column, audit_of
from dem_reference.grains import Grains
from dem_reference.moment import Accounts, Moment, atoms_of, planes_of
from dem_reference.process import run_engine
from dem_reference.run import main
from dem_reference.scene import Plane
from dem_reference.spent import PARTS, Spent

CASE = "cases/column_ci"
GRAINS = Grains(2e-3, 2500.0, 5e6, 0.3, 0.88, 0.5)
SPREAD = {"size_spread": 0.2, "wall_restitution": 0.5}
ROLLING = {"rolling_friction": 0.1, "rolling_damping": 0.3}
KINDS = {
    "equal": GRAINS,
    "spread": replace(GRAINS, **SPREAD),
    "epsd": replace(GRAINS, rolling_model="epsd", **ROLLING),
    "spread, two sizes, epsd2": replace(GRAINS, sizes="two", **SPREAD, **ROLLING),
}
every_kind = pytest.mark.parametrize("grains", KINDS.values(), ids=KINDS)
DT, GRAVITY, THICKNESS, SIDE = 1e-5, 9.81, 0.008, 0.016
# A Coulomb wall and floor that share a corner, a smooth front, and a gate that is being lifted.
WALLS = [Plane(-1, 0, 0.0, 0.4), Plane(-3, 1, 0.0, 0.3), Plane(-4, 2, 0.0)]
WALLS += [Plane(-2, 0, 0.012, lowest=0.008, rise=0.5)]
INTERVAL, UNIT, THRESHOLD = 1e-4, 2e-4, 0.6
THRESHOLDS = THRESHOLD * np.array([0.5, 1.0, 2.0, 4.0])
# Sums of a few hundred terms that partly cancel, in another order.
ROUND_OFF = 1e-11
PIECES = 40  # of a block of steps


def states(grains=GRAINS, samples=6, seed=5):
    return list(oracle.random_states(grains, 400, SIDE, THICKNESS, samples, seed))


def look(moment: Moment, atoms: dict, rows: np.ndarray, owned=None) -> Moment:
    moment.look(atoms_of(atoms, owned), rows.ctypes.data, len(rows), planes_of(WALLS))
    return moment


def new_moment(grains=GRAINS) -> Moment:
    return Moment(grains, DT, GRAVITY, THICKNESS)


def told(atoms: dict, rows: np.ndarray, grains=GRAINS) -> oracle.State:
    return oracle.State(grains, atoms, rows, DT, GRAVITY, THICKNESS, WALLS)


@every_kind
def test_contacts_are_those_of_plain_python(grains):
    for atoms, rows in states(grains):
        moment, plain = look(new_moment(grains), atoms, rows), told(atoms, rows, grains)
        slid = [one["sliding"] for one in plain.pairs]
        assert 0.1 < np.mean(slid) < 0.9 and {one["rough"] for one in plain.walls} == {True, False}
        both = ("force", "elastic", "power", "work_rate")
        for names, ours, theirs in (
            ((*both, "torque"), moment.pairs, plain.pairs),
            ((*both, "driven"), moment.touches, plain.walls),
        ):
            for name in names:
                expected = np.array([one[name] for one in theirs])
                scale = np.abs(expected).max()
                assert ours[name] == pytest.approx(expected, rel=ROUND_OFF, abs=1e-13 * scale)
        for name, value in plain.held().items():
            assert getattr(moment.held, name) == pytest.approx(value, rel=ROUND_OFF), name


@every_kind
@pytest.mark.parametrize("every_step", [False, True])
def test_accounts_are_those_of_plain_python(every_step, grains):
    (first, *others), moment = states(grains), new_moment(grains)
    look(moment, *first)
    ours = Accounts(moment, INTERVAL, every_step, UNIT, THRESHOLD)
    start = told(first[0], first[1], grains)
    plain = oracle.Accounts(start, INTERVAL, every_step, UNIT, THRESHOLDS)
    for atoms, rows in others:
        look(moment, atoms, rows)
        state = told(atoms, rows, grains)
        ours.add(moment)
        plain.add(state)
        sums, enduring, _ = ours.row(moment)
        expected, by_id, lasting = plain.row(state)
        assert list(sums) == pytest.approx(expected, rel=ROUND_OFF)
        assert enduring == pytest.approx(lasting, rel=ROUND_OFF, abs=1e-12 * np.abs(expected).max())
        shares = [by_id.get(int(one), 0.0) for one in atoms["id"]]
        assert ours.by_grain(moment) == pytest.approx(
            np.array(shares), rel=ROUND_OFF, abs=1e-13 * np.abs(shares).max()
        )
    assert len(plain.classes) > 50 and 0 < enduring[1] != pytest.approx(enduring[3])
    found = ours.lifetimes()
    ages, heat = np.array(plain.classes).T
    edges = np.searchsorted(found.edges, ages)
    assert found.contacts == pytest.approx(np.bincount(edges, minlength=len(found.contacts)))
    classes = np.bincount(edges, heat, len(found.contacts))
    assert found.heat.sum(axis=1) == pytest.approx(
        classes, rel=1e-9, abs=1e-12 * np.abs(heat).sum()
    )


def parts_of(atoms: dict, rows: np.ndarray, turn=0):
    """What each of two ranks is handed: grains of its half of the ids, those that touch them, and
    the contacts of its grains; halves change hands with every turn.
    """
    for rank in (0, 1):
        mine = (atoms["id"] + turn) % 2 == rank
        ids = atoms["id"][mine]
        own_rows = rows[np.isin(rows[:, :2], ids).any(axis=1)]
        borrowed = np.isin(atoms["id"], own_rows[:, :2]) & ~mine
        order = np.concatenate([np.flatnonzero(mine), np.flatnonzero(borrowed)])
        part = {name: np.ascontiguousarray(values[order]) for name, values in atoms.items()}
        yield part, np.ascontiguousarray(own_rows), int(mine.sum())


@pytest.mark.parametrize("every_step", [False, True])
def test_sums_of_two_ranks_are_those_of_the_whole(every_step):
    """And would be more where every rank took all that it is handed for its own."""
    history = states()
    # all ranks know the largest coordinate to tell sliding from sticking; here it decides nothing
    whole, shares, greedy = new_moment(), [new_moment(), new_moment()], [new_moment(), new_moment()]
    accounts: list[Accounts] = []
    kept: list[tuple] = []
    for k, (atoms, rows) in enumerate(history):
        look(whole, atoms, rows)
        for one, careless, (part, its_rows, owned) in zip(shares, greedy, parts_of(atoms, rows)):
            kept.append((part, its_rows))  # as long as it is looked at
            look(one, part, its_rows, owned)
            look(careless, part, its_rows)
        sides = [whole, *shares, *greedy]
        if k == 0:
            accounts = [Accounts(one, INTERVAL, every_step, UNIT, THRESHOLD) for one in sides]
            continue
        for account, one in zip(accounts, sides):
            account.add(one)
    rows_of = np.array([(*a.row(m)[0], *a.row(m)[1]) for a, m in zip(accounts, sides)])
    expected = rows_of[0]
    assert rows_of[1:3].sum(axis=0) == pytest.approx(expected, rel=1e-10)
    assert rows_of[3:].sum(axis=0) != pytest.approx(expected, rel=1e-2)
    for name in ("kinetic", "rotational", "potential", "normal", "tangential", "wall"):
        both = sum(getattr(one.held, name) for one in shares)
        assert both == pytest.approx(getattr(whole.held, name), rel=ROUND_OFF)
    error = max(one.held.force_error for one in shares)
    assert error == pytest.approx(whole.held.force_error, rel=ROUND_OFF)


@pytest.mark.parametrize("handed", [True, False])
@pytest.mark.parametrize("every_step", [False, True])
def test_contacts_that_change_hands_keep_their_ages_and_accounts(every_step, handed):
    """All of them in every other sample; where they are not handed over, they begin anew."""
    history, kept = states(), []
    whole, shares = new_moment(), [new_moment(), new_moment()]
    accounts: list[Accounts] = []
    for k, (atoms, rows) in enumerate(history):
        look(whole, atoms, rows)
        for one, (part, its_rows, owned) in zip(shares, parts_of(atoms, rows, k // 2)):
            kept.append((part, its_rows))  # as long as it is looked at
            look(one, part, its_rows, owned)
        if k == 0:
            sides = [whole, *shares]
            accounts = [Accounts(one, INTERVAL, every_step, UNIT, THRESHOLD) for one in sides]
            continue
        if handed:
            owners = (np.arange(atoms["id"].max() + 1) + k // 2) % 2
            gone = [account.leave(owners, rank) for rank, account in enumerate(accounts[1:])]
            assert all(one.size > 0 for one in gone) == (k % 2 == 0)
            for account, carried in zip(accounts[1:], reversed(gone)):
                account.join(carried)
        for account, one in zip(accounts, [whole, *shares]):
            account.add(one)
    size = int(history[0][0]["id"].max()) + 1
    heat, *parts = (a.by_id(m, size) for a, m in zip(accounts, [whole, *shares]))
    assert sum(parts) == pytest.approx(heat, rel=1e-9, abs=1e-12 * np.abs(heat).max())
    enduring = [a.row(m)[1] for a, m in zip(accounts, [whole, *shares])]
    same = np.allclose(sum(enduring[1:]), enduring[0], rtol=1e-9, atol=1e-12 * np.abs(heat).sum())
    for account in accounts:
        account.finish()
    ended, *halves = (account.lifetimes() for account in accounts)
    contacts = sum(half.contacts for half in halves)
    assert (same and np.array_equal(contacts, ended.contacts)) == handed
    if handed:
        assert sum(half.heat for half in halves) == pytest.approx(
            ended.heat, rel=1e-9, abs=1e-12 * np.abs(ended.heat).sum()
        )


def test_parts_of_the_processor_time_add_up(tmp_path):
    """What lies between the parts is a loop and its reports."""
    target = tmp_path / "dem.h5"
    words = ["--packings", str(tmp_path / "packings"), "--quiet"]
    assert main([CASE, "-o", str(target), *words]) == 0
    with h5py.File(target) as file:
        told = dict(file.attrs)
    parts = {part: told[f"cpu_seconds_{part}"] for part in PARTS}
    assert all(seconds > 0.0 for seconds in parts.values())
    collapse = told["cpu_seconds_collapse"]
    assert 0.95 * collapse < sum(parts.values()) <= collapse
    assert told["cpu_seconds"] == pytest.approx(collapse + told["cpu_seconds_packing"])


def in_turns(case: dict, settled: Path, blocks: int, log: Path, report) -> tuple[float, float]:
    """Seconds of processor time that the engine takes unlooked at and in pieces between looks, a
    block of steps each in turns.
    """
    column, taken = Column(case, settled, log), [Spent(), Spent()]
    audit = audit_of(case, column)
    for block in range(blocks):
        spent, pieces = taken[block % 2], PIECES if block % 2 else 1
        for _ in range(pieces):
            with spent.on("engine"):
                column.engine.advance(PIECES // pieces * column.plan.sample)
            with spent.on("audit"):
                audit.accounts.add(column.look(0.0))
    return taken[0].seconds["engine"], taken[1].seconds["engine"]


def test_the_engines_time_is_that_of_the_engine_alone(tmp_path):
    """In turns, so that what else the machine does falls on both. Every piece of ten steps
    evaluates the forces once more when it begins, a tenth of its steps' work at most; as much again
    is for what the looks leave in the processor's caches.
    """
    case, log = packing.dict_of(load(CASE)), tmp_path / "log"
    settled = packing.obtain(case, 1, tmp_path / "packings", lambda done, text: None)
    alone, pieces = run_engine(in_turns, case, settled, 2 * 14, log, log=log).result
    assert 0.95 < pieces / alone < 1.2
