"""A resolved case as LIGGGHTS commands.

The templates in scripts/ are the physics; this file fills their numbers in.
"""

from dataclasses import dataclass
from math import inf
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from cases.scenes import floor_length, gravity_of, is_chute, is_silo

from .base import rough_base
from .grains import PLAIN_YOUNG_MODULUS, Grains

SCRIPTS = Path(__file__).parent / "scripts"
TYPES = {"grain": 1, "smooth": 2, "glued": 3, "base": 4, "left": 5}
BASE_SPACING = 0.95  # rows of the glued base along x, in diameters: no hole lets a grain through
BASE_JITTER = 0.1  # random displacement of a glued grain, in diameters
BASE_DEPTH = (0.5, 0.75)  # depth of its centre below y = 0, in diameters
SAFETY_FLOOR = 2.0  # depth of the smooth plane below the glued base, in diameters
CELL_SKIN = 0.2  # neighbour-list skin, in diameters
# Solid fraction at which random insertion still finds room quickly (it saturates near 0.33).
POURING_SOLID_FRACTION = 0.26


def render(template: str, **numbers) -> str:
    return Template((SCRIPTS / f"{template}.in").read_text()).substitute(numbers)


def prime_seeds(seed: int, count: int) -> list[int]:
    """Different primes above 10000, as LIGGGHTS demands of its seeds, from the run's one seed."""
    candidates = np.random.default_rng(seed).permutation(np.arange(10001, 60001, 2))
    primes = (int(n) for n in candidates if all(n % k for k in range(3, int(n**0.5) + 1, 2)))
    return [next(primes) for _ in range(count)]


def axisymmetric(case: dict) -> bool:
    """Whether the column is a quarter of a cylinder about the y axis.

    It then stands between smooth walls at x = 0 and z = 0.
    """
    return case["geometry"]["dimension"] == "axisymmetric"


def width(case: dict) -> float:
    """Extent of the scene along z [m]."""
    return case["geometry"]["floor_length" if axisymmetric(case) else "thickness"]


def silo(case: dict) -> bool:
    """Whether the column leaves by an orifice in its bottom."""
    return is_silo(case["geometry"])


def chute(case: dict) -> bool:
    """Whether a layer flows down a plane, periodic along x and z."""
    return is_chute(case["geometry"])


def periods(case: dict) -> dict[str, Any]:
    """Periods along z and x, `thickness` and `length` [m]; None where nothing repeats."""
    geometry = case["geometry"]
    across = case["walls"]["front_back"] == "periodic"
    return {
        "thickness": geometry["thickness"] if across else None,
        "length": geometry["length"] if chute(case) else None,
    }


def column_volume(case: dict) -> float:
    """Volume of the column of grains as simulated [m3]."""
    geometry = case["geometry"]
    base = np.pi / 4 * geometry["length"] if axisymmetric(case) else geometry["thickness"]
    return geometry["height"] * geometry["length"] * base


def glued_base(case: dict, grains: Grains, seed: int) -> np.ndarray:
    """Centres of the glued grains, (n, 3): a jittered lattice, tops 0 to d/4 below y = 0.

    Every other row along x is shifted by half a spacing across: rows in line leave grooves in which
    grains roll away.
    """
    if case["walls"]["base"] != "glued":
        return np.empty((0, 3))
    d = grains.diameter
    length, depth = floor_length(case["geometry"]), width(case)
    if chute(case):
        return rough_base(length, depth, d, seed)
    across = max(1, round(depth / d))
    periodic = case["walls"]["front_back"] == "periodic"
    z = (np.arange(across) + 0.5) * depth / across
    x = np.arange(0.0, length, BASE_SPACING * d)
    shift = np.arange(x.size) % 2 * depth / across / 2 * periodic
    x, z = np.repeat(x, across), (z + shift[:, None]).ravel()
    random = np.random.default_rng(seed)
    x = x + random.uniform(-BASE_JITTER, BASE_JITTER, x.size) * d
    z = z + random.uniform(-BASE_JITTER, BASE_JITTER, x.size) * d
    z = z % depth if periodic else np.clip(z, d / 2, depth - d / 2)
    base = np.column_stack([x, -random.uniform(*BASE_DEPTH, x.size) * d, z])
    return base[np.hypot(x, z) <= length] if axisymmetric(case) else base


def floor_height(case: dict, grains: Grains) -> float:
    """y of the plane below everything [m]: the base itself when it is a Coulomb plane."""
    return -SAFETY_FLOOR * grains.diameter if case["walls"]["base"] == "glued" else 0.0


def beyond_floor(x: np.ndarray, case: dict) -> np.ndarray:
    """Which of the grains at x, (n, 3) [m], left the floor at its end (n,); in a chute none."""
    if chute(case):
        return np.zeros(len(x), bool)
    reach = np.hypot(x[:, 0], x[:, 2]) if axisymmetric(case) else x[:, 0]
    return reach > floor_length(case["geometry"])


@dataclass(frozen=True)
class Plane:
    """A plane wall: what the contact records call it and where it is."""

    code: int  # -1 left, -2 gate or wall of a silo, -3 floor, -4 front, -5 back, -6 bottom
    axis: int
    position: float  # [m]
    friction: float = 0.0
    lowest: float = -inf  # y of its lower edge [m], for a gate that is being lifted
    begin: float = -inf  # x of its left edge [m], of a silo's bottom
    rise: float = 0.0  # its speed along y [m/s]


def planes(case: dict, grains: Grains) -> list[Plane]:
    """The walls that stay, so without the gate, and without those of a silo (plates.py)."""
    walls = case["walls"]
    out = [
        *([] if chute(case) else [Plane(-1, 0, 0.0, walls["left_friction"])]),
        Plane(-3, 1, floor_height(case, grains), walls["base_friction"]),
    ]
    if walls["front_back"] == "smooth":
        out += [Plane(-4, 2, 0.0)] + [Plane(-5, 2, width(case))] * (not axisymmetric(case))
    return out


def pair_table(diagonal: float, **pairs: float) -> str:
    """A symmetric 5 x 5 LIGGGHTS property table.

    Pairs named `grain_left=...` override the common value.
    """
    table = np.full((5, 5), diagonal)
    for name, value in pairs.items():
        i, j = (TYPES[part] - 1 for part in name.split("_"))
        table[i, j] = table[j, i] = value
    return " ".join(f"{value:.17g}" for value in table.ravel())


def rolling(grains: Grains) -> str:
    """Words that add rolling resistance to a contact model."""
    return f" rolling_friction {grains.rolling_model}" if grains.rolls else ""


def wall(grains: Grains) -> str:
    """Words of a wall's contact model."""
    return f"mobile wall/gran model hertz tangential history{rolling(grains)}"


def rolling_properties(grains: Grains) -> str:
    """Its property commands. A smooth wall resists no rolling, a Coulomb wall as a grain does."""
    if not grains.rolls:
        return ""
    properties = {"RollingFriction": grains.rolling_friction}
    if grains.rolling_model == "epsd":
        properties["RollingViscousDamping"] = grains.rolling_damping
    return "\n".join(
        f"fix {name} all property/global coefficient{name} peratomtypepair 5 "
        + pair_table(0.0, **{f"grain_{part}": value for part in ("grain", "glued", "base", "left")})
        for name, value in properties.items()
    )


def material(case: dict, grains: Grains, young_modulus: float, friction: float) -> str:
    """Property commands with the given stiffness [Pa] and grain-grain friction."""
    walls = case["walls"]
    at_wall = grains.wall_restitution or grains.restitution
    return render(
        "material",
        young=" ".join([f"{young_modulus:.17g}"] * 5),
        poisson=" ".join([f"{grains.poisson_ratio:.17g}"] * 5),
        restitution=pair_table(
            grains.restitution, **{f"grain_{wall}": at_wall for wall in ("smooth", "base", "left")}
        ),
        rolling=rolling_properties(grains),
        friction=pair_table(
            0.0,
            grain_grain=friction,
            grain_glued=friction,
            grain_base=walls["base_friction"],
            grain_left=walls["left_friction"],
        ),
    )


def hardness(*young_moduli: float) -> str:
    """The command that lifts LIGGGHTS' bounds on the Young modulus, where one lies outside."""
    lower, upper = PLAIN_YOUNG_MODULUS
    return "\n".join(
        ["soft_particles yes"] * any(e < lower for e in young_moduli)
        + ["hard_particles yes"] * any(e > upper for e in young_moduli)
    )


def beginning(case: dict, grains: Grains, start: str, *young_moduli: float, ranks: str = "") -> str:
    """Units, box (from `start`: a create_box or a read_restart) and contact law; `ranks`: how many
    share the box along x, y and z, all of them along x unless told.
    """
    periodic = case["walls"]["front_back"] == "periodic"
    return render(
        "scene",
        along="p" if chute(case) else "m",
        front_back="p" if periodic else "m",
        hardness=hardness(*young_moduli),
        ranks=ranks or "* 1 1",
        start=start,
        skin=CELL_SKIN * grains.diameter,
        rolling=rolling(grains),
    )


def new_box(case: dict, grains: Grains, top: float) -> str:
    """Box of the whole scene up to `top` [m].

    Its faces grow with the grains except the periodic ones.
    """
    d, geometry = grains.diameter, case["geometry"]
    edge = 0.0 if case["walls"]["front_back"] == "periodic" else d
    left, right = (0.0, geometry["length"]) if chute(case) else (-d, geometry["floor_length"] + d)
    return (
        f"region domain block {left} {right} {-(SAFETY_FLOOR + 1) * d} {top} "
        f"{-edge} {width(case) + edge} units box\ncreate_box 5 domain"
    )


def glued_atoms(case: dict, grains: Grains, seed: int) -> str:
    """Commands that create the base and name the two groups.

    New grains of the insertion join `mobile`.
    """
    lines = [
        f"create_atoms 3 single {x:.17g} {y:.17g} {z:.17g} units box"
        for x, y, z in glued_base(case, grains, seed)
    ]
    if lines:
        lines.append(f"set type 3 density {grains.density} diameter {grains.diameter}")
    return "\n".join(["group mobile type 1", *lines, "group base type 3"])


def bodies(case: dict, grains: Grains, level: bool = False) -> str:
    """Gravity, walls, integration and the computes; `level`: as if the scene were not inclined."""
    walls = case["walls"]
    sides = [("front", 0.0)] + [("back", width(case))] * (not axisymmetric(case))
    both = [f"fix {name} {wall(grains)} primitive type 2 zplane {z}" for name, z in sides]
    pull, weight = (0.0, case["geometry"]["gravity"]) if level else gravity_of(case["geometry"])
    left_type = TYPES["smooth" if walls["left"] == "smooth" else "left"]
    left = f"fix left {wall(grains)} primitive type {left_type} xplane 0.0"
    return render(
        "bodies",
        wall=wall(grains),
        gravity=case["geometry"]["gravity"],
        direction=f"{pull:.17g} {-weight:.17g} 0" if pull else "0 -1 0",
        weight=weight,
        left="" if chute(case) else left,
        floor=floor_height(case, grains),
        floor_type=TYPES["smooth" if walls["base"] == "glued" else "base"],
        front_and_back="\n".join(both if walls["front_back"] == "smooth" else []),
    )


def gate(case: dict, grains: Grains) -> str:
    """The closed gate: a smooth plane at x = L0, or a cylinder of R0 = L0 about the y axis; of a
    chute none.
    """
    if chute(case):
        return ""
    shape = "ycylinder {:.17g} 0 0" if axisymmetric(case) else "xplane {:.17g}"
    return f"fix gate {wall(grains)} primitive type 2 " + shape.format(case["geometry"]["length"])


def pouring(case: dict, grains: Grains, count: int, seed: int) -> tuple[str, float]:
    """Commands that place `count` grains, all of the largest diameter, at random above the base,
    and their height [m].
    """
    r, geometry = grains.largest / 2, case["geometry"]
    inset = 0.0 if case["walls"]["front_back"] == "periodic" else r
    left = 0.0 if chute(case) else r
    right, back = geometry["length"] - left, (
        geometry["length"] - r if axisymmetric(case) else width(case) - inset
    )
    length = geometry["length"] - 2 * left
    area = np.pi / 4 * length**2 if axisymmetric(case) else length * (width(case) - 2 * inset)
    top = grains.largest + count * (np.pi / 6 * grains.largest**3) / (
        POURING_SOLID_FRACTION * area
    )
    box = f"block {left} {right} {r} {top} {inset} {back} units box"
    region = (
        f"region box {box}\nregion cylinder cylinder y 0 0 {right} {r} {top} units box\n"
        "region pouring intersect 2 box cylinder"
        if axisymmetric(case)
        else f"region pouring {box}"
    )
    seeds = prime_seeds(seed, 3)
    text = render(
        "pour",
        region=region,
        template_seed=seeds[0],
        mixture_seed=seeds[1],
        pouring_seed=seeds[2],
        density=grains.density,
        radius=r,
        grains=count,
    )
    return text, top


def closed_gate(case: dict) -> list[Plane]:
    """The gate behind which the packing is made; of a cylinder the contact records know nothing,
    and a chute has none.
    """
    return [] if axisymmetric(case) or chute(case) else [Plane(-2, 0, case["geometry"]["length"])]


def rising_gate(case: dict, time: float) -> Plane:
    """The gate `time` [s] after it began to rise from y = 0."""
    speed = case["walls"]["gate_speed"]
    return Plane(-2, 0, case["geometry"]["length"], lowest=speed * time, rise=speed)
