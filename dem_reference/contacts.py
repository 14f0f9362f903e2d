"""Every contact force of a moment, rebuilt from the grains' state.

The engine reports forces, but no energies.

LIGGGHTS evaluates a force with the positions of time t and the velocities of t - dt/2. Rebuilt with
those half-step velocities, the sum of contact forces on each grain agrees with the engine's own to
round-off (`Snapshot.force_error`), which is what makes the energies below trustworthy.

Energies and powers of one contact [symbols in grains.py]; u is the relative velocity at time t, v
the one at t - dt/2:
    U_n = 8/15 Y* sqrt(R*) delta^(5/2)          U_t = 1/2 k_t |s|^2
    P_n = gamma_n v_n u_n                         P_t = -F_t . u_t - dU_t/dt
The work of a force over one step is F . u dt exactly, since u is the mean of the velocities before
and after it; with v in its place the dissipation came out 4 % too large. With dU_t/dt written out,
P_t = gamma_t v_t . u_t - 1/2 dk_t/dt |s|^2 while sticking, and
-F_t . u_t - d/dt[(mu F_n)^2 / (2 k_t)] while sliding. The second terms matter: k_t follows the
overlap, so U_t is no true potential, and what it gains or loses without work must be booked for the
balance to close. All of them are smooth in time and can therefore be sampled.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .grains import Grains
from .scene import TYPES, Plane

# The engine has cut the spring at this step where k_t |s| = mu |F_n| to round-off. That of F_n is
# its two terms', and theirs the overlap's, a small difference of coordinates.
SLIDING_TOLERANCE, ROUND_OFF = 1e-8, 1e-15


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


@dataclass
class Snapshot:
    """State of all grains at one time and their contacts, as the engine holds them.

    atoms: see Liggghts.atoms; rows: see Liggghts.contacts.
    """

    grains: Grains
    atoms: dict
    rows: np.ndarray
    dt: float  # [s]
    gravity: float  # [m/s2]
    thickness: float | None  # periodic length along z [m]
    planes: list[Plane]  # the walls that stand at this time
    radial: bool = False  # whether means depend on the distance from the y axis, not on x

    def __post_init__(self):
        g, a = self.grains, self.atoms
        self.mobile = a["type"] == TYPES["grain"]
        index = np.empty(a["id"].max() + 1, dtype=np.int64)
        index[a["id"]] = np.arange(a["id"].size)
        self.i, self.j = (
            index[self.rows[:, 0].astype(np.int64)],
            index[self.rows[:, 1].astype(np.int64)],
        )
        # velocities the force was evaluated with; a glued grain has none
        self.v_half = np.where(self.mobile[:, None], a["v"] - self.dt / (2 * g.mass) * a["f"], 0.0)
        self.omega_half = np.where(
            self.mobile[:, None], a["omega"] - self.dt / (2 * g.inertia) * a["torque"], 0.0
        )
        self._pairs()

    def _pairs(self) -> None:
        g, a, i, j = self.grains, self.atoms, self.i, self.j
        branch = a["x"][i] - a["x"][j]
        if self.thickness:
            branch[:, 2] -= self.thickness * np.round(branch[:, 2] / self.thickness)
        distance = np.sqrt(dot(branch, branch))
        n = branch / distance[:, None]
        delta = g.diameter - distance
        arm = (g.radius - delta / 2)[:, None]  # from a centre to the contact point
        self.branch, self.distance, self.normal, self.overlap, self.arm = (
            branch,
            distance,
            n,
            delta,
            arm,
        )
        v_n, v_t = self._relative(self.v_half, self.omega_half)

        r = g.radius / 2
        m = np.where(
            self.mobile[i] & self.mobile[j], g.mass / 2, g.mass
        )  # the glued grain's mass is infinite
        root = np.sqrt(r * delta)
        s_n, k_t = 2 * g.contact_modulus * root, 8 * g.contact_shear_modulus * root
        gamma_n, gamma_t = g.damping_factor * np.sqrt(s_n * m), g.damping_factor * np.sqrt(k_t * m)
        f_hertz = 4 / 3 * g.contact_modulus * root * delta
        f_n = f_hertz - gamma_n * v_n
        s = self.rows[:, 3:6]
        s_length = np.sqrt(dot(s, s))
        cap = g.friction * np.abs(f_n)
        blur = (
            (SLIDING_TOLERANCE + ROUND_OFF * np.abs(a["x"]).max() / delta)
            * g.friction
            * (f_hertz + gamma_n * np.abs(v_n))
        )
        sliding = k_t * s_length >= cap - blur
        spring = -k_t[:, None] * s
        f_t = spring - np.where(sliding, 0.0, gamma_t)[:, None] * v_t

        self.v_n, self.v_t = v_n, v_t
        self.u_n, self.u_t = self._relative(
            *(np.where(self.mobile[:, None], a[name], 0.0) for name in ("v", "omega"))
        )
        self.s_n, self.k_t, self.gamma_n, self.gamma_t = s_n, k_t, gamma_n, gamma_t
        self.f_n, self.f_t, self.s_length, self.sliding = f_n, f_t, s_length, sliding
        self.force = f_n[:, None] * n + f_t  # on the first grain, from the second

    def _relative(self, velocity: np.ndarray, spin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Relative velocity of the pairs along the normal, (n,), and their slip, (n, 3)."""
        v = velocity[self.i] - velocity[self.j]
        v_n = dot(v, self.normal)
        return v_n, v - v_n[:, None] * self.normal - np.cross(
            self.arm * (spin[self.i] + spin[self.j]), self.normal
        )

    @cached_property
    def elastic_normal(self) -> np.ndarray:
        """U_n of each contact [J]."""
        g = self.grains
        return 8 / 15 * g.contact_modulus * np.sqrt(g.radius / 2) * self.overlap**2.5

    @cached_property
    def elastic_tangential(self) -> np.ndarray:
        """U_t of each contact [J]."""
        return self.k_t * self.s_length**2 / 2

    @cached_property
    def power_normal(self) -> np.ndarray:
        """P_n of each contact [W]."""
        return self.gamma_n * self.v_n * self.u_n

    @cached_property
    def power_tangential(self) -> np.ndarray:
        """P_t of each contact [W]."""
        rate = -self.u_n / (2 * self.overlap)  # (dk_t/dt) / k_t, with d(delta)/dt = -u_n
        stuck = self.gamma_t * dot(self.v_t, self.u_t) - rate * self.elastic_tangential
        # d/dt [(mu F_n)^2 / (2 k_t)] with
        # dF_n/dt = -S_n u_n - gamma_n du_n/dt - (rate/2) gamma_n v_n
        a = np.where(self.mobile[:, None], self.atoms["f"] / self.grains.mass, 0.0)
        du_n = dot(a[self.i] - a[self.j], self.normal) + dot(self.u_t, self.u_t) / self.distance
        df_n = -self.s_n * self.u_n - self.gamma_n * du_n - rate / 2 * self.gamma_n * self.v_n
        du = self.grains.friction**2 * self.f_n / self.k_t * (df_n - rate / 2 * self.f_n)
        slid = -dot(self.f_t, self.u_t) - du
        return np.where(self.sliding, slid, stuck)

    @cached_property
    def elastic_parts(self) -> np.ndarray:
        """U_n and U_t of each contact (n, 2) [J]."""
        return np.column_stack([self.elastic_normal, self.elastic_tangential])

    @cached_property
    def power_parts(self) -> np.ndarray:
        """P_n and P_t of each contact (n, 2) [W]."""
        return np.column_stack([self.power_normal, self.power_tangential])

    @cached_property
    def work_rate_parts(self) -> np.ndarray:
        """-F_n u_n and -F_t . u_t of each contact (n, 2) [W]: taken from its grains' motion."""
        return np.column_stack([-self.f_n * self.u_n, -dot(self.f_t, self.u_t)])

    @cached_property
    def pair_force(self) -> np.ndarray:
        """Sum of grain-grain contact forces on each grain (n, 3) [N]."""
        total = np.zeros_like(self.atoms["x"])
        for k in range(3):
            total[:, k] = np.bincount(self.i, self.force[:, k], len(total)) - np.bincount(
                self.j, self.force[:, k], len(total)
            )
        return total

    @cached_property
    def wall(self) -> "WallContacts":
        return WallContacts(self)

    @cached_property
    def force_error(self) -> float:
        """Largest difference between the engine's force on a moving grain and the rebuilt one [N].

        Corners of Coulomb walls aside.
        """
        rebuilt = self.pair_force + np.array([0, -self.grains.mass * self.gravity, 0])
        np.add.at(rebuilt, self.wall.grain, self.wall.force)
        known = self.mobile.copy()
        known[self.wall.ambiguous] = False
        return float(np.abs((self.atoms["f"] - rebuilt)[known]).max(initial=0.0))

    @cached_property
    def kinetic(self) -> float:
        """Translational kinetic energy of the moving grains [J]."""
        v = self.atoms["v"][self.mobile]
        return self.grains.mass / 2 * float((v * v).sum())

    @cached_property
    def rotational(self) -> float:
        omega = self.atoms["omega"][self.mobile]
        return self.grains.inertia / 2 * float((omega * omega).sum())

    @cached_property
    def potential(self) -> float:
        """Potential energy of the moving grains, zero at y = 0 [J]."""
        return self.grains.mass * self.gravity * float(self.atoms["x"][self.mobile, 1].sum())

    @cached_property
    def elastic(self) -> float:
        return float(
            self.elastic_normal.sum() + self.elastic_tangential.sum() + self.wall.elastic.sum()
        )


class WallContacts:
    """Contacts with walls: R* = r, m* = m.

    The wall is a half-plane whose lower edge may be touched from below.

    The friction of a Coulomb wall is what the engine's force leaves over after grain contacts,
    gravity and the walls' normal forces; of two Coulomb walls touched at once the first takes it.
    Of a rising gate only the edge does work on the grains; that work is not tallied, and shows as
    unaccounted energy.
    """

    def __init__(self, shot: Snapshot):
        g = shot.grains
        parts = [self._touching(shot, plane) for plane in shot.planes]
        self.grain, self.code, self.normal, self.overlap, speed, rough = (
            np.concatenate(column) for column in zip(*parts)
        )
        v_n = dot(shot.v_half[self.grain], self.normal) - speed
        u_n = dot(shot.atoms["v"][self.grain], self.normal) - speed
        root = np.sqrt(g.radius * self.overlap)
        gamma = g.damping_factor * np.sqrt(2 * g.contact_modulus * root * g.mass)
        f_n = 4 / 3 * g.contact_modulus * root * self.overlap - gamma * v_n
        self.force = f_n[:, None] * self.normal
        self.elastic = 8 / 15 * g.contact_modulus * np.sqrt(g.radius) * self.overlap**2.5
        self.power = gamma * v_n * u_n
        self.work_rate = -f_n * u_n
        self.branch = (g.radius - self.overlap)[
            :, None
        ] * self.normal  # grain centre - contact point
        rough = np.flatnonzero(rough)
        _, first, count = np.unique(self.grain[rough], return_index=True, return_counts=True)
        self.ambiguous = self.grain[
            rough[first[count > 1]]
        ]  # grains whose friction cannot be told apart
        if rough.size:
            self._add_friction(shot, rough[first])

    @staticmethod
    def _touching(shot: Snapshot, plane: Plane) -> tuple:
        """Grains that touch a wall.

        Index, code, normal into the grain (n, 3), overlap, the wall's speed along the normal,
        roughness.
        """
        radius, x = shot.grains.radius, shot.atoms["x"]
        gap = np.zeros_like(x)  # from the nearest point of the wall to the centre
        gap[:, plane.axis] = x[:, plane.axis] - plane.position
        gap[:, 1] += np.minimum(x[:, 1] - plane.lowest, 0.0) if plane.lowest > -np.inf else 0.0
        distance = np.sqrt(dot(gap, gap))
        grain = np.flatnonzero((distance < radius) & shot.mobile)
        normal = gap[grain] / distance[grain, None]
        return (
            grain,
            np.full(grain.size, plane.code),
            normal,
            radius - distance[grain],
            plane.rise * normal[:, 1],
            np.full(grain.size, plane.friction > 0),
        )

    def _add_friction(self, shot: Snapshot, rough: np.ndarray) -> None:
        left_over = shot.atoms["f"] - shot.pair_force
        left_over[:, 1] += shot.grains.mass * shot.gravity
        np.subtract.at(left_over, self.grain, self.force)
        grain, normal = self.grain[rough], self.normal[rough]
        f_t = left_over[grain] - dot(left_over[grain], normal)[:, None] * normal
        u = shot.atoms["v"][grain] - np.cross(shot.atoms["omega"][grain], self.branch[rough])
        u_t = u - dot(u, normal)[:, None] * normal
        self.force[rough] += f_t
        self.power[rough] -= dot(f_t, u_t)
        self.work_rate[rough] -= dot(f_t, u_t)
