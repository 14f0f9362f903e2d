"""The settled column: grains poured behind the closed gate to the void ratio that is asked for.

Protocol of one attempt, the same for every case:
 1. grains placed at random without overlap, solid fraction 0.26, 4 % more than the column holds;
    where their sizes are spread (grains.size_spread) all of the largest, then each takes its own;
 2. they fall onto the base and settle under gravity, soft (dem.packing_young_modulus), with a
    pouring friction mu_p and a viscous drag that limits their speed, until the mean kinetic energy
    of a grain is below 1e-4 m g d;
 3. friction and Young modulus are set to the run's. Where the run's grains are the stiffer, those
    poured were larger by what the weight of the column squeezes them, and take their own size now:
    their overlaps open and the bed comes to rest again by a fraction of a grain. (Raising the
    stiffness at constant overlap locks lateral stress in: K0 near 1.)
 4. grains whose centres lie above H are removed, so that the number kept is what a homogeneous
    column of height H holds;
 5. the drag is removed and the packing rests, until the mean kinetic energy is below 1e-5 m g d.
Search: the void ratio of 5 is measured 2.5 d away from base, walls and surface (void_ratio.py) and
mu_p moved by the difference until it lies within dem.void_ratio_tolerance of initial.void_ratio; at
mu_p = 2 friction has nothing left to give and the drag is raised instead. The nearest attempt is
kept. A seed fixes every random number, so a packing can be made again.
"""

import os
import shutil
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from math import sqrt
from pathlib import Path

import h5py
import numpy as np

from cases import room
from cases.errors import CaseError, EngineError, Failure
from cases.h5_output import H5Output
from cases.scratch import locked, made_folders, named, scratch, told

from . import scene
from .contacts import Snapshot
from .content import packing_key
from .engine import Liggghts
from .grains import Grains, time_step
from .initial_state import box_stress, fields
from .process import Report, fails_again, run_engine
from .void_ratio import bulk_box, quarter_bulk_box, void_ratio

RESTART = "packing.restart"
POUR_SURPLUS = 1.04
SETTLED, AT_REST = 1e-4, 1e-5  # mean kinetic energy of a grain [m g d]
REFERENCE_DRAG = 4e-4  # [kg/s] of packing_damping = 1 for the reference grain
REFERENCE_DIAMETER, REFERENCE_MASS = 2e-3, 2532 * np.pi / 6 * 2e-3**3
FRICTION_RANGE = (0.0, 2.0)
SLOPE = 0.05  # d(void ratio)/d(mu_p), measured on columns of 25 d
LONGEST_STEP = 0.4  # limit of one move of mu_p
PIECE = 500  # steps between looks at the kinetic energy


def drag(case: dict, grains: Grains, factor: float) -> float:
    """Drag coefficient [kg/s] with which grains of any size fall at one multiple of sqrt(g d)."""
    time_ratio = sqrt(REFERENCE_DIAMETER / grains.diameter * case["geometry"]["gravity"] / 9.81)
    return factor * REFERENCE_DRAG * grains.mass / REFERENCE_MASS * time_ratio


def nominal_count(case: dict, grains: Grains) -> float:
    """Grains that a column of the asked void ratio holds."""
    return scene.column_volume(case) / (1 + case["initial"]["void_ratio"]) / grains.mean_volume


def squeeze(case: dict, grains: Grains) -> float:
    """Overlap over diameter of softer `grains` under the weight of the whole column.

    A contact of a packing under pressure p carries about f = p d^2, with which Hertz gives
    (f / (4/3 Y* sqrt(R*)))^(2/3).
    """
    geometry = case["geometry"]
    pressure = (
        grains.density
        / (1 + case["initial"]["void_ratio"])
        * geometry["gravity"]
        * geometry["height"]
    )
    d = grains.diameter
    return (pressure * d**2 / (4 / 3 * grains.contact_modulus * sqrt(d / 4))) ** (2 / 3) / d


def prepare(case: dict, seed: int, friction: float, damping: float, folder: Path, report) -> None:
    """One attempt, in this process; leaves packing.restart and packing.h5 in `folder`."""
    attempt = Attempt(case, Liggghts(folder / "log", Grains.of(case)), report)
    attempt.pour(seed, friction, damping)
    attempt.stiffen()
    attempt.cut()
    engine = attempt.engine
    atoms = engine.atoms()
    shot = Snapshot(
        attempt.grains,
        atoms,
        engine.contacts(),
        attempt.dt,
        case["geometry"]["gravity"],
        planes=scene.planes(case, attempt.grains) + scene.closed_gate(case),
        **scene.periods(case),
    )
    engine.command(f"write_restart {RESTART}")  # in the log's folder
    with H5Output(folder / "packing.h5") as file:
        describe(file, case, shot)
        file.attrs.update(
            seed=seed, packing_friction=friction, packing_damping=damping, protocol=__doc__.strip()
        )


class Attempt:
    """The steps of the protocol, on a running engine; its methods are called in their order."""

    def __init__(self, case: dict, engine: Liggghts, report: Report):
        self.case, self.engine, self.report, self.grains = case, engine, report, Grains.of(case)
        self.dt = 0.0  # time step of the last phase [s]
        self.longest = 0.0  # any phase may take [s]
        self.poured = 0  # grains
        self.diameters = np.empty(0)  # of the grains in the order of their ids, unless all are even

    def pour(self, seed: int, friction: float, damping: float) -> None:
        """1 and 2."""
        case, grains, engine = self.case, self.grains, self.engine
        gravity = case["geometry"]["gravity"]
        count = round(POUR_SURPLUS * nominal_count(case, grains))
        soft = min(case["dem"]["packing_young_modulus"], grains.young_modulus)
        softer = Grains.of(case, soft)
        swelling = 1 + (squeeze(case, softer) if soft < grains.young_modulus else 0.0)
        swollen = replace(softer, diameter=swelling * grains.diameter)
        pour, top = scene.pouring(case, swollen, count, seed)
        self.dt = case["dem"]["time_step_fraction"] * softer.rayleigh_time()
        box = scene.new_box(case, grains, top + grains.diameter)
        engine.commands(scene.beginning(case, grains, box, soft))
        engine.commands(scene.material(case, grains, soft, friction))
        engine.commands(scene.glued_atoms(case, grains, seed))
        gate = scene.gate(case, grains)
        engine.commands(scene.bodies(case, grains, level=True) + "\n" + gate + "\n" + pour)
        engine.commands(f"thermo {PIECE}\ntimestep {self.dt:.17g}\nrun 1\nunfix pouring")
        self.poured = self.of_type("grain")
        if self.poured < count:
            raise EngineError(
                f"packing: {self.poured} grains inserted of {count} asked (column too narrow for "
                "random insertion)"
            )
        if not grains.even:
            self.diameters = grains.diameters(count, np.random.default_rng(seed))
            self.resize(swelling)
        fall = sqrt(2 * top / gravity)
        terminal = grains.mass * gravity / max(drag(case, grains, damping), 1e-300)
        self.longest = 4 * (fall + top / terminal)
        engine.commands(f"fix drag mobile viscous {drag(case, grains, damping):.17g}\nrun 0")
        self.rest(SETTLED, self.poured, "settling", (0.0, 0.8))

    def stiffen(self) -> None:
        """3."""
        case, grains, engine = self.case, self.grains, self.engine
        self.dt = case["dem"]["time_step_fraction"] * grains.rayleigh_time()
        if grains.even:
            size = f"density {grains.density} diameter {grains.diameter:.17g}"
            engine.command(f"set group mobile {size}")
        else:
            self.resize(1.0)
        engine.command(f"timestep {self.dt:.17g}")
        engine.commands(scene.material(case, grains, grains.young_modulus, grains.friction))
        engine.commands(f"fix drag mobile viscous {drag(case, grains, 1.0):.17g}\nrun 0")
        self.rest(SETTLED, self.poured, "resting", (0.8, 0.95))

    def cut(self) -> None:
        """4 and 5."""
        height, engine = self.case["geometry"]["height"], self.engine
        engine.command(f"region surplus block INF INF {height:.17g} INF INF INF units box")
        engine.command("delete_atoms region surplus compress no")
        kept = self.of_type("grain")
        engine.commands("unfix drag\nrun 0")
        self.rest(AT_REST, kept, "resting", (0.95, 1.0))
        if engine.count() != kept + self.of_type("glued"):
            raise EngineError("packing: LIGGGHTS lost grains", Failure.LOST_GRAINS)

    def resize(self, swelling: float) -> None:
        """Gives every grain its own diameter times `swelling`."""
        ids = self.engine.integers("id")[self.engine.integers("type") == scene.TYPES["grain"]]
        self.engine.resize(np.sort(ids), swelling * self.diameters, self.grains.density)

    def of_type(self, name: str) -> int:
        return int((self.engine.atoms()["type"] == scene.TYPES[name]).sum())

    def rest(self, level: float, grains: int, text: str, span: tuple[float, float]) -> None:
        """Goes on until the mean kinetic energy of `grains` is below `level` [m g d].

        `span`: of the whole work, what this phase takes its report from and to.
        """
        unit = (
            grains * self.grains.mean_mass * self.case["geometry"]["gravity"] * self.grains.diameter
        )
        pieces = int(self.longest / self.dt / PIECE) + 1
        for piece in range(pieces):
            self.engine.advance(PIECE)
            if self.engine.scalar("kinetic") < level * unit and piece >= 3:
                return
            self.report(span[0] + (span[1] - span[0]) * piece / pieces, text)
        raise EngineError(
            f"packing: still moving after {self.longest:.3g} s of {text} (mean kinetic energy "
            f"{self.engine.scalar('kinetic') / unit:.1e} m g d) raise dem.packing_damping"
        )


def describe(file: h5py.File, case: dict, shot: Snapshot) -> None:
    """What a packing is: void ratio and its profiles, stress ratio, coordination, grains."""
    grains, geometry = shot.grains, case["geometry"]
    length, height, width = geometry["length"], geometry["height"], geometry["thickness"]
    x = shot.atoms["x"][shot.mobile]
    bulk = quarter_bulk_box if scene.axisymmetric(case) else bulk_box
    lower, upper = bulk(length, height, grains.diameter)
    stress = box_stress(shot, lower, upper, width)
    touching = shot.mobile[shot.i].astype(int) + shot.mobile[shot.j]
    radius = shot.of_mobile(shot.radius)
    solid = len(x) * grains.volume if grains.even else float(shot.volume[shot.mobile].sum())
    file.attrs.update(
        void_ratio=void_ratio(x, radius, lower, upper, width),
        void_ratio_asked=case["initial"]["void_ratio"],
        void_ratio_overall=scene.column_volume(case) / solid - 1,
        bulk_box=np.concatenate([lower, upper]),
        lateral_stress_ratio=stress[0, 0] / stress[1, 1],
        lateral_stress_ratio_z=stress[2, 2] / stress[1, 1],
        coordination=touching.sum() / len(x),
        grains=len(x),
        glued_grains=int((~shot.mobile).sum()),
        mass=len(x) * grains.mass if grains.even else grains.density * solid,
        largest_overlap=shot.overlap.max() / grains.diameter,
    )
    if scene.axisymmetric(case):
        return  # profiles over x and y are a slab's
    state = fields(shot, length, height, width)
    units = {"x": "m", "y": "m", "mass": "kg", "void_ratio": "-"}
    for name, values in state.items():
        file[f"profile_{name}"] = values
        file[f"profile_{name}"].attrs["unit"] = units.get(name, "Pa")
    y = state["y"]
    file["profile_void_ratio_y"] = [
        void_ratio(x, radius, (lower[0], a), (upper[0], b), width) for a, b in zip(y[:-1], y[1:])
    ]
    file["profile_void_ratio_y"].attrs.update(
        unit="-", doc="void ratio of layers between the faces profile_y, 2.5 d away from the walls"
    )


def next_try(friction: float, damping: float, found: float, asked: float) -> tuple[float, float]:
    """Friction and damping of the next attempt.

    From those of the last one and the void ratio it reached.
    """
    if found < asked and friction == FRICTION_RANGE[1]:
        return friction, max(1.5 * damping, 0.1)
    step = np.clip((asked - found) / SLOPE, -LONGEST_STEP, LONGEST_STEP)
    return float(np.clip(friction + step, *FRICTION_RANGE)), damping


def attempted(report: Report, attempt: int, done: float, text: str) -> None:
    """Reports the share `done` of attempt number `attempt`, counted from 0, as one of the whole."""
    report((attempt + done) / (attempt + 1), f"packing {attempt + 1}: {text}")


def obtain(case: dict, seed: int, store: Path, report) -> Path:
    """Folder of the case's packing (packing.restart, packing.h5) in `store`.

    Made unless it is there already, from the attempts on that a killed process has completed.
    """
    time_step(
        Grains.of(case),
        case["dem"]["time_step_fraction"],
        case["geometry"]["height"],
        case["geometry"]["gravity"],
    )
    target = store / packing_key(case, seed)
    unfinished = target.with_name(f"{target.name}.unfinished")
    if target.is_dir():
        shutil.rmtree(unfinished, ignore_errors=True)  # killed before it could
        report(1.0, "packing found")
        return target
    with ExitStack() as stack:
        stack.enter_context(told(store))
        stack.enter_context(made_folders(store))
        work = stack.enter_context(scratch(store, "packing")).resolve()  # engines work elsewhere
        stack.enter_context(named(work, store))
        try:
            stack.enter_context(locked(target.with_name(f".{target.name}.lock"), target))
        except CaseError:  # somebody makes the same packing: each for himself
            unfinished = work / "completed"
        try:
            tried, best, cpu = search(case, seed, work, unfinished.resolve(), report)
        except BaseException as error:
            if fails_again(error):
                shutil.rmtree(unfinished, ignore_errors=True)
            raise
        kept = work / "kept"
        shutil.copytree(unfinished / str(best), kept)
        with H5Output(kept / "packing.h5", "a") as file:
            file["attempts"] = np.array(tried)
            file["attempts"].attrs.update(
                unit="-", doc="pouring friction, damping, void ratio of each attempt"
            )
            file.attrs.update(cpu_seconds=cpu, engine_version=engine_version(kept / "log"))
        settle(kept)
        try:
            os.rename(kept, target)
        except OSError:  # another run made the same packing meanwhile
            if not target.is_dir():
                raise
        shutil.rmtree(unfinished, ignore_errors=True)
    return target


def search(
    case: dict, seed: int, work: Path, completed: Path, report: Report
) -> tuple[list[tuple[float, float, float]], int, float]:
    """Makes the attempts that are not `completed` yet, a folder that gets each as soon as it is.

    Returns pouring friction, damping and void ratio of each, number of the best, processor time of
    all [s].
    """
    asked, dem = case["initial"]["void_ratio"], case["dem"]
    tried: list[tuple[float, float, float]] = []
    best, cpu = 0, 0.0
    friction, damping = dem["packing_friction"], dem["packing_damping"]
    for attempt in range(dem["packing_attempts"]):
        done = completed / str(attempt)
        if not done.is_dir():
            say = partial(attempted, report, attempt)
            complete(dict_of(case), seed, friction, damping, work / str(attempt), done, say)
        with h5py.File(done / "packing.h5") as file:
            found = float(file.attrs["void_ratio"])
            cpu += float(file.attrs["cpu_seconds"])
        tried.append((friction, damping, found))
        if abs(found - asked) < abs(tried[best][2] - asked):
            best = attempt
        if abs(found - asked) <= dem["void_ratio_tolerance"]:
            break
        friction, damping = next_try(friction, damping, found, asked)
    return tried, best, cpu


def complete(
    case: dict, seed: int, friction: float, damping: float, folder: Path, done: Path, say: Report
) -> None:
    """One attempt in a process of its own, made in `folder`, which is named `done` when it is on
    the disk.
    """
    folder.mkdir()
    words = case, seed, friction, damping, folder
    spent = run_engine(prepare, *words, log=folder / "log", report=say).cpu_seconds
    with H5Output(folder / "packing.h5", "a") as file:
        file.attrs["cpu_seconds"] = spent
    settle(folder)
    done.parent.mkdir(exist_ok=True)
    os.rename(folder, done)


def settle(folder: Path) -> None:
    """Waits until the files of a folder are on the disk. Raises OSError."""
    for file in folder.iterdir():
        room.settle(file)


def dict_of(case) -> dict:
    """The plain tables of a case, which travel to another process."""
    return {
        name: dict(case[name])
        for name in ("geometry", "grains", "initial", "walls", "dem", "time", "output")
    }


def engine_version(log: Path) -> str:
    """First line of an engine log, such as LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, ...)."""
    return log.read_text(errors="replace").splitlines()[0].strip()
