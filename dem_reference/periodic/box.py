"""A box of grains in LIGGGHTS whose three pairs of faces are periodic and whose sides may move."""

from pathlib import Path

import numpy as np

from dem_reference.engine import Liggghts
from dem_reference.grains import Grains
from dem_reference.periodic.start import random_positions
from dem_reference.scene import rolling

SETUP = """\
atom_style granular
atom_modify map array
boundary p p p
newton off
communicate single vel yes
units si
processors * 1 1
region box block 0 {side} 0 {side} 0 {side} units box
create_box 1 box
neighbor {d} bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype {E}
fix m2 all property/global poissonsRatio peratomtype {nu}
fix m3 all property/global coefficientRestitution peratomtypepair 1 {e}
fix m4 all property/global coefficientFriction peratomtypepair 1 {mu}
fix m5 all property/global coefficientRollingFriction peratomtypepair 1 {mu_r}
fix m6 all property/global coefficientRollingViscousDamping peratomtypepair 1 {eta_r}
pair_style gran model hertz {tangential}
pair_coeff * *
timestep {dt}
"""
STATE = """\
fix move all nve/sphere
compute st all stress/atom
compute sxx all reduce sum c_st[1]
compute syy all reduce sum c_st[2]
compute szz all reduce sum c_st[3]
compute sxy all reduce sum c_st[4]
compute con all contact/atom
compute z all reduce ave c_con
thermo_style custom step atoms c_sxx c_syy c_szz c_sxy c_z
thermo_modify lost error norm no flush yes
thermo 1000000000
"""
GROW = """\
variable d equal ramp({d0:.17g},{d})
fix grow all adapt 20 atom diameter v_d
run {steps} post no
unfix grow
set group all diameter {d} density {rho}
neighbor {skin} bin
run 0 post no
"""


GROWTH, PIECE = 20000, 20  # steps of the growth; between changes of size


class Box(Liggghts):
    """`count` grains with `friction` in a periodic cube of `side` [m], started at random.

    Lengths in m, stresses in Pa (compression positive), rates in 1/s.
    """

    def __init__(
        self,
        grains: Grains,
        count: int,
        side: float,
        seed: int,
        friction: float,
        time_step: float,
        log: Path,
        tangential: bool = True,
    ):
        super().__init__(log, grains)
        self.grains, self.time_step = grains, time_step
        centres, d0 = random_positions(count, side, seed)
        self.commands(
            SETUP.format(
                side=side,
                d=grains.diameter,
                E=grains.young_modulus,
                nu=grains.poisson_ratio,
                e=grains.restitution,
                mu=friction,
                mu_r=grains.rolling_friction,
                eta_r=grains.rolling_damping,
                tangential=f"tangential history{rolling(grains)}" if tangential else "",
                dt=time_step,
            )
        )
        self.create(centres)
        self.command(f"set group all density {grains.density} diameter {d0:.17g}")
        self.commands(STATE)
        if not grains.even:
            self.grow(d0, seed)
            return
        self.commands(
            GROW.format(
                d0=d0,
                d=grains.diameter,
                rho=grains.density,
                skin=0.2 * grains.diameter,
                steps=GROWTH,
            )
        )

    def grow(self, start: float, seed: int) -> None:
        """As GROW, each grain to its own size; the largest begins with the diameter `start` [m]."""
        grains, ids = self.grains, np.sort(self.integers("id"))
        own = grains.diameters(ids.size, np.random.default_rng(seed))
        for now in np.linspace(start / grains.largest, 1.0, GROWTH // PIECE + 1):
            self.resize(ids, now * own, grains.density)
            self.command(f"run {PIECE} post no")
        self.command(f"neighbor {0.2 * grains.diameter} bin")
        self.command("run 0 post no")

    def deform(self, rates: np.ndarray, steps: int) -> None:
        """Goes on by `steps` while the sides shrink at `rates`, (3,); grains follow affinely."""
        words = " ".join(f"{axis} erate {-rate:.12g}" for axis, rate in zip("xyz", rates))
        self.command(f"fix shape all deform 1 {words} remap v")
        self.command(f"run {steps} post no")

    def set_friction(self, friction: float) -> None:
        self.command(f"fix m4 all property/global coefficientFriction peratomtypepair 1 {friction}")
        self.command("run 0 post no")

    @property
    def sides(self) -> np.ndarray:
        """Lengths of the box's sides, (3,) [m]."""
        return np.array(
            [self.extent(f"box{axis}hi") - self.extent(f"box{axis}lo") for axis in "xyz"]
        )

    @property
    def void_ratio(self) -> float:
        """Volume of voids over volume of grains, overlaps counted as solid twice [-]."""
        return self.sides.prod() / (self.count() * self.grains.mean_volume) - 1

    @property
    def stress(self) -> np.ndarray:
        """Principal stresses along the axes, (3,) [Pa]."""
        return -np.array([self.scalar(name) for name in ("sxx", "syy", "szz")]) / self.sides.prod()
