"""The same column twice: as our own run writes it, and through LIGGGHTS' text dumps of it.

What differs by design: contacts with primitive walls, which LIGGGHTS tells nobody; dissipation; and
the forces of contacts, which its `dump local` evaluates anew, with the velocities at the end of the
step in place of those half a step before, and adds damping where a contact slides.
"""

import shutil
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest

from cases.case import load
from cases.programs import call, program
from compare.importing.options import Options
from compare.importing.pipeline import convert
from dem_reference import packing
from dem_reference.release import release
from dem_reference.plan import Plan
from dem_reference.grains import Grains
from dem_reference.run import main
from dem_reference.script import command

CASE = "cases/column_ci"
SET = ["time.maximum=1.5", "time.frame_interval=0.5"]
# Columns of the dumps of grains, and of `pair/gran/local pos id force`.
GRAINS = "id type x y z vx vy vz omegax omegay omegaz radius mass fx fy fz"
MOBILE, PLACE, PULL, FIRST, FORCE = 1, slice(2, 5), slice(13, 16), 6, slice(9, 12)
CONTACTS = """
uncompute id_sum
uncompute pairs
compute shown all pair/gran/local pos id force
"""
# Our own file has velocities, spins and what it tells of contacts in single precision, and so have
# most fields.
SINGLE = 2.0**-24
DIGITS = {"fifteen": 2 * SINGLE, "six": 2 * SINGLE + 5e-6}
PLACES = {"fifteen": 0.0, "six": 5e-8}  # m, of coordinates below 0.1 m
# Quotients, without a bound, of fields that are compared.
LEFT = {"void_ratio", "stress_ratio", "inertial_number", "time"}
SEEN = (
    *("density", "momentum", "velocity", "velocity_gradient", "granular_temperature", "fabric"),
    *("contact_stress", "kinetic_stress", "interaction_force_density", "coordination", "pressure"),
)


def dumps(name: str, every: int, word: str | None = None) -> str:
    columns = " ".join(f"c_shown[{k}]" for k in range(1, 13))
    lines = [
        f"dump {name} all custom {every} {name}.*.dump {GRAINS}",
        f"dump of_{name} all local {every} {name}.*.local {columns}",
    ]
    if word:
        lines.append(f'dump_modify {name} format "%d %d {" ".join([word] * 14)}"')
        lines.append(f'dump_modify of_{name} format "{" ".join([word] * 12)}"')
    return "\n".join(lines) + "\n"


def tables() -> dict:
    return packing.dict_of(load(CASE, SET))


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """dem.h5 of our driver; the text dumps of the same trajectory, with fifteen digits and as they
    come, with six; and what is imported of them.
    """
    folder = tmp_path_factory.mktemp("same")
    words = [word for key in SET for word in ("--set", key)]
    store = folder / "packings"
    own = [CASE, "-o", str(folder / "dem.h5"), "--packings", str(store), "--quiet"]
    assert main([*own, *words]) == 0
    settled = packing.obtain(tables(), 1, store, lambda done, text: None)
    plan, grains = Plan.of(tables()), Grains.of(tables())
    text = release(tables(), grains, plan, settled, folder).removesuffix("run 0") + CONTACTS
    text += dumps("fifteen", plan.frame, "%.15g") + dumps("six", plan.frame)
    (folder / "column.in").write_text(f"{text}run 0\nrun {plan.last}\n")
    subprocess.run([*command(1), "-in", "column.in"], cwd=folder, check=True, capture_output=True)
    for name in DIGITS:
        grains_of = tuple(folder.glob(f"{name}.*.dump"))
        contacts_of = tuple(folder.glob(f"{name}.*.local"))
        options = Options(grains_of, contacts_of, time_step=plan.dt)
        notes = convert(options, load(CASE, SET), folder / f"{name}.h5")
        odd = [note for note in notes if not note.startswith(("assumed", "walls"))]
        assert [note.split()[1] for note in odd] == ["height"], notes  # one grain lies on the top
    return folder


def columns(group: h5py.Group, name: str) -> np.ndarray:
    return np.stack([group[f"{name}/{axis}"][()] for axis in "xyz"], axis=1)


def rows_of(folder: Path, step: str, ending: str) -> np.ndarray:
    return np.loadtxt(folder / f"fifteen.{step}.{ending}", skiprows=9, ndmin=2)


def told(folder: Path, step: str) -> dict[tuple[int, int], np.ndarray]:
    """Forces on the first of two grains, as LIGGGHTS tells them."""
    rows = rows_of(folder, step, "local")
    pairs = {(int(row[FIRST]), int(row[FIRST + 1])): row[FORCE] for row in rows}
    return pairs | {(b, a): -force for (a, b), force in pairs.items()}


@pytest.fixture(scope="module")
def own(folder) -> Path:
    """Our file with the contacts that LIGGGHTS tells, and the forces as it tells them."""
    path = folder / "own.h5"
    shutil.copyfile(folder / "dem.h5", path)
    with h5py.File(path, "r+") as file:
        for step, frame in file["data"].items():
            old, forces = frame["contacts"], told(folder, step)
            kept = old["second"][()] > 0
            first, second = (old[name][()][kept] for name in ("first", "second"))
            vectors = {name: columns(old, name)[kept] for name in ("branch", "position")}
            vectors["force"] = np.array([forces[pair] for pair in zip(first, second)])
            assert len(forces) == 2 * len(first)
            del frame["contacts"]
            new = frame.create_group("contacts")
            new["first"], new["second"] = first, second
            for name, values in vectors.items():
                for k, axis in enumerate("xyz"):
                    new[f"{name}/{axis}"] = values[:, k]
    return path


@pytest.fixture(scope="module")
def fields(folder, own) -> Path:
    runs = [own, *(folder / f"{name}.h5" for name in DIGITS)]
    done = call([program("grain_map"), *runs, "-o", folder / "fields.h5", "--quiet"])
    assert done.returncode == 0, done.stderr
    return folder / "fields.h5"


def scales(ours: h5py.Group, width: float) -> dict[str, float]:
    """What each field's error is relative to: of rates the largest that differences of velocities
    under one kernel make, 2 v · 6/w; of fluctuations v √T; else the field's largest value.
    """
    largest = {name: float(np.nanmax(np.abs(values[()]))) for name, values in ours.items()}
    speed, rate = largest["velocity"], 12.0 * largest["velocity"] / width
    heat = {name: speed * largest[name] ** 0.5 for name in largest if "temperature" in name}
    rates = {
        "velocity_gradient": rate,
        "strain_rate": rate,
        "shear_rate": 8**0.5 * rate,
    }  # √(2 D:D)
    heat["kinetic_stress"] = largest["density"] * heat["granular_temperature_one_step"]
    power = {"stress_power": rate * largest["contact_stress"]}
    return largest | heat | rates | power


def errors(fields: Path, name: str, bound: str) -> dict[str, float]:
    """Largest difference of each field, over what the digits of `bound` allow: a weight's logarithm
    has a slope of r/w² ≤ 3/w, as much by its normalisation; no formula holds more than four sums.
    """
    with h5py.File(fields) as file:
        ours, theirs, width = file["own"], file[name], file.attrs["width"]
        assert set(ours) == set(theirs)
        allowed = 4.0 * (DIGITS[bound] + 6.0 * 2**0.5 * PLACES[bound] / width)
        scale, out = scales(ours, width), {}
        for field in set(ours) - LEFT:
            a, b = theirs[field][()], ours[field][()]
            assert np.array_equal(np.isnan(a), np.isnan(b)), field
            out[field] = float(np.nanmax(np.abs(a - b))) / (allowed * scale[field])
        return out


@pytest.mark.parametrize("name", list(DIGITS))
def test_every_field_is_the_same_to_the_digits(fields, name):
    found = errors(fields, name, name)
    assert {"velocity_gradient", "contact_stress", "fabric", "coordination"} <= set(found)
    assert {field: error for field, error in found.items() if error > 1.0} == {}
    with h5py.File(fields) as file:
        assert file[f"{name}/time"][()] == pytest.approx(file["own/time"][()], rel=1e-12)


def test_six_digits_are_told_from_fifteen(fields):
    found = errors(fields, "six", "fifteen")
    assert [field for field in SEEN if found[field] < 1.0] == []


def test_normal_forces_are_apart_by_the_damping_of_half_a_step(folder):
    """γ_n dt/2 times the difference of the accelerations along n; to single precision. The second
    of two grains across a periodic face is a copy, whose velocity is that of half a step before.
    """
    grains, dt = Grains.of(tables()), Plan.of(tables()).dt
    thickness = tables()["geometry"]["thickness"]
    with h5py.File(folder / "dem.h5") as file:
        for step, frame in file["data"].items():
            atoms, theirs = rows_of(folder, step, "dump"), told(folder, step)
            by_id = {int(row[0]): row for row in atoms}
            ours, both = columns(frame["contacts"], "force"), frame["contacts"]
            pairs = list(zip(both["first"][()], both["second"][()]))
            at = [k for k, (_, second) in enumerate(pairs) if second > 0]
            one, two = (np.array([by_id[pairs[k][side]] for k in at]) for side in (0, 1))
            branch = one[:, PLACE] - two[:, PLACE]
            images = np.rint(branch[:, 2] / thickness)
            branch[:, 2] -= thickness * images
            distance = np.linalg.norm(branch, axis=1)
            normal = branch / distance[:, None]
            moving = (one[:, MOBILE] == 1.0) & (two[:, MOBILE] == 1.0)
            mass = np.where(moving, grains.mass / 2, grains.mass)
            root = np.sqrt(grains.radius / 2 * (grains.diameter - distance))
            gamma = grains.damping_factor * np.sqrt(2 * grains.contact_modulus * root * mass)
            pull = [side[:, PULL] * (side[:, MOBILE] == 1.0)[:, None] for side in (one, two)]
            pull[1][(images != 0.0) & (step != "0")] = 0.0
            faster = np.sum((pull[0] - pull[1]) / grains.mass * normal, axis=1) * dt / 2
            apart = np.array([theirs[pairs[k]] for k in at]) - ours[at]
            found = np.sum(apart * normal, axis=1)
            rounding = 4 * SINGLE * np.abs(ours).max()
            assert np.abs(found + gamma * faster).max() < rounding
            assert np.abs(found).max() > 1000 * rounding
