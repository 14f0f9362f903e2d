"""What flows in a run, cell by cell: the conditions that a law is asked under, and the answer.

Fields of grain_map, of the grains or of a run of the continuum. With s = dev sigma, D the rate of
strain and gdot = sqrt(2 dev D : dev D):

    mu_D = s : D/(p gdot)          effective friction: what the stress does to the flow
    |s|/p = sqrt(s : s/2)/p        stress ratio, as tau/p in simple shear
    cos(s, D) = s : D/(|s| gdot)   so that mu_D = |s|/p cos(s, D)
    I = gdot d sqrt(rho_s/p)       inertial number

A cell's weight is its work, the power of the deviatoric stress times the cell's volume and the time
between frames [J].
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from scipy import ndimage

from cases.errors import CaseError
from cases.reading import opened
from compare.mapping.reductions import bulk_solid_fraction, temperature
from compare.mapping.runs import Run

STATIC, CREEP = 0.2, 1.0  # of gdot sqrt(H/g): below, at rest; below, creeping
# The zones, each with the solid fractions between which it lies; the first two by rate alone.
ZONES = ("static", "creep", "dense", "medium", "loose", "ballistic")
FRACTIONS = (0.57, 0.53, 0.40)  # between dense, medium, loose and ballistic
FLOWING = 0.45  # solid fraction from which a law is judged by one number
LEAST_PRESSURE = 0.01  # of rho_b g d: below, nothing is carried


@dataclass(frozen=True)
class Cells:
    """Cells of all frames in which stress and flow are known, each (n,) but for `width` [d]."""

    width: float
    tau: np.ndarray  # time [sqrt(H/g)]
    x: np.ndarray  # [m]
    y: np.ndarray
    zone: np.ndarray  # index into ZONES
    solid_fraction: np.ndarray
    pressure: np.ndarray  # [Pa]
    shear_rate: np.ndarray  # [1/s]
    friction: np.ndarray  # mu_D
    stress_ratio: np.ndarray  # |s|/p
    inertial_number: np.ndarray
    temperature: np.ndarray  # granular [m2/s2]
    dissipation: np.ndarray  # at contacts [W/m3]; NaN where it was not sampled
    weight: np.ndarray  # volume and interval [m3 s]

    def __len__(self) -> int:
        return len(self.tau)

    def where(self, mask: np.ndarray) -> "Cells":
        return replace(
            self, **{f.name: getattr(self, f.name)[mask] for f in fields(self) if f.name != "width"}
        )

    @property
    def void_ratio(self) -> np.ndarray:
        return 1.0 / self.solid_fraction - 1.0

    @property
    def unit_work(self) -> np.ndarray:
        """p gdot V dt, the work of a friction of one [J]."""
        return self.pressure * self.shear_rate * self.weight

    @property
    def work(self) -> np.ndarray:
        """Of the deviatoric stress [J]; negative where the flow works on the stress."""
        return self.friction * self.unit_work

    @property
    def flowing(self) -> np.ndarray:
        return (self.zone > 0) & (self.solid_fraction > FLOWING)

    def coaxiality(self) -> float:
        """cos(s, D) of what flows, weighted by |s| gdot."""
        one = self.where(self.flowing)
        most = (one.stress_ratio * one.unit_work).sum()
        return float(one.work.sum() / most) if most > 0.0 else float("nan")


def sees_the_air(solid_fraction: np.ndarray, limit: float, width: float) -> np.ndarray:
    """Cells (ny, nx) nearer than `width` [cells] to a free surface: to a cell whose solid fraction
    is below `limit`. The walls at the first row and column are none. A single column is a profile:
    it has no sides.
    """
    reach = int(np.ceil(width))
    span = np.arange(-reach, reach + 1)
    near = span[:, None] ** 2 + span**2 <= width**2
    air = np.pad(solid_fraction < limit, reach, mode="edge")
    air[-reach:, :] = True
    if solid_fraction.shape[1] > 1:
        air[:, -reach:] = True
    return ndimage.binary_dilation(air, near)[reach:-reach, reach:-reach]


def refuse_without_stress(path: Path):
    """CaseError where a run's frames hold nothing that a stress could be made of."""
    with opened(path) as file:
        for step, frame in file["data"].items():
            if "contacts" not in frame and "stress" not in frame["particles/cloud"]:
                raise CaseError(
                    f"{path}: frame {step} has no contacts (the stress of grains is a sum over "
                    "them) run the grains with output.contacts = true"
                )


def cells(run: Run) -> Cells:
    """The cells of a run with mapped fields, a stress among them."""
    field, grid = run.fields, run.fields.grid
    width = float(field.attributes["width"]) / run.diameter
    found = [
        of_frame(run, k, field.attributes["width"] / grid.spacing) for k in range(len(run.time))
    ]
    interval = np.gradient(run.time) if len(run.time) > 1 else np.ones(1)
    tau = np.concatenate([np.full(len(one["x"]), t) for one, t in zip(found, run.tau())])
    weight = np.concatenate([one.pop("weight") * dt for one, dt in zip(found, interval)])
    return Cells(
        width=width,
        tau=tau,
        weight=weight,
        **{name: np.concatenate([one[name] for one in found]) for name in found[0]},
    )


def of_frame(run: Run, frame: int, width: float) -> dict[str, np.ndarray]:
    """What Cells hold of a frame's cells that are known and see no air; `width` in cells."""
    field, case = run.fields, run.case

    def get(name: str) -> np.ndarray:
        return field[name][frame]

    solid = get("solid_fraction")
    pressure, rate = get("pressure"), get("shear_rate")
    # s : D = sigma : D - p tr D
    power = get("stress_power") - pressure * np.trace(get("strain_rate"), axis1=-2, axis2=-1)
    least = (
        LEAST_PRESSURE
        * bulk_solid_fraction(run)
        * case["grains.density"]
        * case["geometry.gravity"]
        * run.diameter
    )
    known = np.isfinite(power) & (pressure > least) & (rate > 0.0)
    known &= ~sees_the_air(solid, 0.5 * bulk_solid_fraction(run), width)
    y, x = (a[known] for a in np.meshgrid(field.grid.y, field.grid.x, indexing="ij"))
    nu, p, gdot = solid[known], pressure[known], rate[known]
    slow = gdot * run.time_scale
    zone = np.select(
        [slow < STATIC, slow < CREEP, *(nu > limit for limit in FRACTIONS)], range(5), 5
    )
    volume = np.broadcast_to(field.grid.cell_volume, solid.shape)[known]
    nothing = np.full(len(p), np.nan)
    return {
        "x": x,
        "y": y,
        "zone": zone,
        "solid_fraction": nu,
        "pressure": p,
        "shear_rate": gdot,
        "friction": power[known] / (p * gdot),
        "stress_ratio": get("deviatoric_stress")[known] / (np.sqrt(3.0) * p),
        "inertial_number": gdot * run.diameter * np.sqrt(case["grains.density"] / p),
        "temperature": temperature(run, frame)[known],
        "dissipation": get("dissipation_density")[known]
        if "dissipation_density" in field
        else nothing,
        "weight": volume,  # times the interval, by whoever knows that
    }


def shuffled(cells: Cells, seed: int = 1) -> Cells:
    """The same cells, the flow of each with the stress of another: nothing in them fits together.

    mu_D is then the stress ratio times the cosine of a direction that is none.
    """
    random = np.random.default_rng(seed)
    order = random.permutation(len(cells))
    cos = np.cos(random.uniform(0.0, 2.0 * np.pi, len(cells)))
    return replace(
        cells,
        pressure=cells.pressure[order],
        stress_ratio=cells.stress_ratio[order],
        friction=cells.stress_ratio[order] * cos,
    )
