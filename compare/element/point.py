"""The law on the element tests' paths, by the program that it is compiled into: mpm_point.

PointModel answers what Model answers in closed form, by driving a material point; the two must
agree.
"""

import csv
import json
from functools import cached_property, lru_cache

import numpy as np

from cases.errors import EngineError
from cases.programs import ROOT, call, program
from cases.scratch import temporary
from compare.element.card import Card
from compare.element.model import Model
from dem_reference.grains import Grains

# Any scene: only its material and grains are read, and those are set here.
BASE = ROOT / "cases" / "column" / "case.toml"
QUIET = 1e-15  # granular temperature of a packing at rest [m2/s2]


class PointModel:
    """A card for given grains, driven point by point; the methods are those of Model.

    Triaxial compression goes at the rate of `inertial_number`: at e < e_c the law's collisional
    stress depends on the rate however slow it is, and the closed form is its limit at no rate.
    """

    def __init__(self, card: Card, grains: Grains, inertial_number: float = 1e-6):
        self.card, self.grains, self.inertial_number = card, grains, inertial_number
        self.drive = lru_cache(maxsize=None)(self._drive)

    @property
    def nu_c(self) -> float:
        return 1 / (1 + self.card.critical_void_ratio)

    def frictionless(self) -> "PointModel":
        return PointModel(
            Model(self.card, self.grains).frictionless().card, self.grains, self.inertial_number
        )

    @cached_property
    def settings(self) -> list[str]:
        """The case's keys that make it this card and these grains."""
        values = {f"material.{name}": value for name, value in vars(self.card).items()}
        values |= self.grains.keys()
        return [f"{key}={value}" for key, value in values.items()]

    def _drive(
        self, void_ratio: float, pressure: float, temperature: float, *legs: str, every: int = 1
    ) -> dict:
        """Columns of mpm_point's CSV for a path of `legs`, as arrays by name.

        A leg is a TOML table without its header. A row per `every` steps is kept.
        """
        text = [
            f"case = {json.dumps(str(BASE))}",
            f"every = {every}",
            f"set = {json.dumps([*self.settings, f'initial.void_ratio={float(void_ratio)!r}'])}",
            "[start]",
            f"void_ratio = {float(void_ratio)!r}",
            f"pressure = {float(pressure)!r}",
            f"granular_temperature = {float(temperature)!r}",
        ]
        for leg in legs:
            text += ["[[leg]]", leg]
        with temporary() as folder:
            path, out = folder / "path.toml", folder / "point.csv"
            path.write_text("\n".join(text) + "\n")
            done = call([program("mpm_point"), path, "-o", out])
            if done.returncode:
                raise EngineError(f"mpm_point: {done.stderr.strip()}")
            rows = list(
                csv.reader(
                    line for line in out.read_text().splitlines() if not line.startswith("#")
                )
            )
        return dict(zip(rows[0], np.array(rows[1:], dtype=float).T))

    def shear(self, nu, rate) -> dict:
        """Steady simple shear at constant volume; see Model.shear. Stress of the last step."""
        nu, rate = np.broadcast_arrays(np.asarray(nu, dtype=float), np.asarray(rate, dtype=float))
        names = ("granular_temperature", "pressure", "shear_stress")
        answers = np.array(
            [self._steady(float(a), float(b)) for a, b in zip(nu.ravel(), rate.ravel())]
        )
        return {name: values.reshape(nu.shape) for name, values in zip(names, answers.T)}

    def _steady(self, nu: float, rate: float) -> tuple[float, float, float]:
        end = self.drive(
            1 / nu - 1,
            self._start(nu),
            QUIET,
            f'path = "simple_shear"\nrate = {float(rate)!r}\nstrain = 12.0\nsteps = 4000',
            every=4000,
        )
        shear = abs(end["sigma_q_xy"][-1] + end["sigma_c_xy"][-1])
        return end["granular_temperature"][-1], end["p_q"][-1] + end["p_c"][-1], shear

    def reversal(self, nu, rate, strain, span: float) -> dict:
        """Simple shear at constant volume from rest, and back; see Model.reversal."""
        pairs = zip(np.atleast_1d(nu), np.atleast_1d(rate))
        answers = [self._reversed(float(a), float(b), strain, span) for a, b in pairs]
        return {name: np.stack([one[name] for one in answers], axis=1) for name in answers[0]}

    def _reversed(self, nu: float, rate: float, strain, span: float) -> dict:
        legs = [
            f'path = "simple_shear"\nrate = {float(rate)!r}\n'
            f"strain = {float(sense * span)!r}\nsteps = 20000"
            for sense in (1, -1)
        ]
        history = self.drive(1 / nu - 1, self._start(nu), QUIET, *legs, every=5)
        strain = np.asarray(strain, dtype=float)
        passed = np.linspace(0, 2 * span, len(history["time"]))  # both legs in equal steps
        at = np.array([strain, span + strain])
        shear = history["sigma_q_xy"] + history["sigma_c_xy"]
        return {
            "granular_temperature": np.interp(at, passed, history["granular_temperature"]),
            "pressure": np.interp(at, passed, history["p_q"] + history["p_c"]),
            "shear_stress": np.interp(at, passed, shear) * [[1], [-1]],
        }

    def _start(self, nu: float) -> float:
        """Pressure at which shear starts [Pa].

        Denser than critical, half the critical one: from no stress at all, none would build up.
        """
        return 0.5 * float(Model(self.card, self.grains).critical_pressure(nu))

    def cooling_time(self, nu, T0, T):
        """When homogeneous cooling has brought T0 down to T [s]; see Model.cooling_time."""
        nu, T0, T = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (nu, T0, T)))
        return np.array(
            [
                self._cooled(float(a), float(b), float(c))
                for a, b, c in zip(nu.ravel(), T0.ravel(), T.ravel())
            ]
        ).reshape(nu.shape)

    def _cooled(self, nu: float, T0: float, T: float) -> float:
        if T >= T0:
            return 0.0
        legs, step = [], 1e-7  # steps that grow as the cooling slows down
        for _ in range(12):
            legs.append(f'path = "rest"\nduration = {float(400 * step)!r}\nsteps = 400')
            step *= 3
        history = self.drive(1 / nu - 1, 0.0, T0, *legs, every=10)
        # 1/sqrt(T) is straight in time: interpolate that
        return float(np.interp(T**-0.5, history["granular_temperature"] ** -0.5, history["time"]))

    def triaxial(self, void_ratio: float, lateral: float, axial_strain) -> dict:
        """Drained triaxial compression; see Model.triaxial."""
        axial_strain = np.asarray(axial_strain, dtype=float)
        rate = self.grains.strain_rate(self.inertial_number, lateral)
        # The elastic rise is short: small steps there.
        start, end = 0.01, float(axial_strain.max()) * 1.001
        history = self.drive(
            float(void_ratio),
            float(lateral),
            QUIET,
            f'path = "triaxial"\nrate = {float(rate)!r}\nstrain = {start}\nsteps = 2000',
            f'path = "triaxial"\nrate = {float(rate)!r}\n'
            f"strain = {float(end - start)!r}\nsteps = 4000",
            every=20,
        )
        stress = {
            name: history[f"sigma_q_{name}"] + history[f"sigma_c_{name}"]
            for name in ("xx", "yy", "zz")
        }
        at = {
            "deviator": stress["yy"] - (stress["xx"] + stress["zz"]) / 2,
            "pressure": sum(stress.values()) / 3,
            "volumetric_strain": sum(history[f"strain_{name}"] for name in ("xx", "yy", "zz")),
            "void_ratio": history["void_ratio"],
        }
        return {
            name: np.interp(axial_strain, history["strain_yy"], values)
            for name, values in at.items()
        }

    def isotropic(self, void_ratio, pressure, pressures):
        """Void ratio at `pressures` on the isotropic path through (void_ratio, pressure).

        See Model.isotropic.
        """
        history = self.drive(
            float(void_ratio),
            float(pressure),
            QUIET,
            'path = "isotropic"\nrate = 0.01\nstrain = 0.15\nsteps = 6000',
            every=20,
        )
        return np.interp(pressures, history["p_q"], history["void_ratio"])

    def moduli(self, pressure):
        """Tangent bulk and shear modulus on the isotropic axis, from strains of 1e-6.

        See Model.moduli.
        """
        answers = np.array([self._moduli(float(p)) for p in np.atleast_1d(pressure)]).T
        return answers if np.ndim(pressure) else answers[:, 0]

    def _moduli(self, pressure: float) -> tuple[float, float]:
        # Dense, so that the point is elastic whatever its pressure.
        e, gamma = 0.5, 1e-6
        squeezed = self.drive(
            e, pressure, QUIET, f'path = "isotropic"\nrate = 1e-4\nstrain = {gamma}\nsteps = 10'
        )
        sheared = self.drive(
            e, pressure, QUIET, f'path = "simple_shear"\nrate = 1e-4\nstrain = {gamma}\nsteps = 10'
        )
        return ((squeezed["p_q"][-1] - pressure) / gamma, abs(sheared["sigma_q_xy"][-1]) / gamma)
