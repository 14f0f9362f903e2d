"""The grains' energy accounts once more, contact by contact and in plain Python: what the library
of dem_reference/ledger/ is held against. And states of grains to hold it against.
"""

from collections import defaultdict

import numpy as np

from dem_reference.grains import Grains
from dem_reference.moment import ARRAYS

SLIDING_TOLERANCE, ROUND_OFF = 1e-8, 1e-15


class State:
    """Contacts of one moment: `pairs` and `walls` as dictionaries, energies held [J]."""

    def __init__(self, g: Grains, atoms: dict, rows, dt, gravity, thickness, planes):
        self.g, self.dt, self.gravity = g, dt, gravity
        self.atoms, self.thickness = atoms, thickness
        self.mobile = atoms["type"] == 1
        self.place = {int(one): k for k, one in enumerate(atoms["id"])}
        zero = ~self.mobile[:, None]
        self.now = {name: np.where(zero, 0.0, atoms[name]) for name in ("v", "omega", "f")}
        self.half = {
            "v": np.where(zero, 0.0, atoms["v"] - dt / (2 * g.mass) * atoms["f"]),
            "omega": np.where(zero, 0.0, atoms["omega"] - dt / (2 * g.inertia) * atoms["torque"]),
        }
        self.pairs = [self.pair(row) for row in rows]
        self.pair_force = np.zeros_like(atoms["x"])
        for one in self.pairs:
            self.pair_force[one["i"]] += one["force"]
            self.pair_force[one["j"]] -= one["force"]
        self.walls = [one for plane in planes for one in self.touching(plane)]
        self.friction_of_walls()

    def pair(self, row) -> dict:
        g, a = self.g, self.atoms
        i, j = self.place[int(row[0])], self.place[int(row[1])]
        branch = a["x"][i] - a["x"][j]
        if self.thickness:
            branch[2] -= self.thickness * np.round(branch[2] / self.thickness)
        distance = np.linalg.norm(branch)
        n, delta = branch / distance, g.diameter - distance
        arm = g.radius - delta / 2

        def relative(velocity, spin):
            v = velocity[i] - velocity[j]
            return v @ n, v - (v @ n) * n - np.cross(arm * (spin[i] + spin[j]), n)

        v_n, v_t = relative(self.half["v"], self.half["omega"])
        u_n, u_t = relative(self.now["v"], self.now["omega"])
        m = g.mass / 2 if self.mobile[i] and self.mobile[j] else g.mass
        root = np.sqrt(g.radius / 2 * delta)
        s_n, k_t = 2 * g.contact_modulus * root, 8 * g.contact_shear_modulus * root
        gamma_n, gamma_t = (g.damping_factor * np.sqrt(k * m) for k in (s_n, k_t))
        hertz, mu, s = 4 / 3 * g.contact_modulus * root * delta, g.friction, row[3:6]
        f_n = hertz - gamma_n * v_n
        blur = SLIDING_TOLERANCE + ROUND_OFF * np.abs(a["x"]).max() / delta
        sliding = k_t * np.linalg.norm(s) >= mu * (abs(f_n) - blur * (hertz + gamma_n * abs(v_n)))
        f_t = -k_t * s - (0.0 if sliding else gamma_t) * v_t
        stored = np.array([8 / 15 * g.contact_modulus * root * delta**2, k_t * (s @ s) / 2])
        rate = -u_n / (2 * delta)
        if sliding:
            du_n = (self.now["f"][i] - self.now["f"][j]) @ n / g.mass + u_t @ u_t / distance
            df_n = -s_n * u_n - gamma_n * du_n - rate / 2 * gamma_n * v_n
            p_t = -(f_t @ u_t) - mu**2 * f_n / k_t * (df_n - rate / 2 * f_n)
        else:
            p_t = gamma_t * (v_t @ u_t) - rate * stored[1]
        return {
            "i": i,
            "j": j,
            "key": frozenset((int(row[0]), int(row[1]))),
            "force": f_n * n + f_t,
            "elastic": stored,
            "power": np.array([gamma_n * v_n * u_n, p_t]),
            "work_rate": np.array([-f_n * u_n, -(f_t @ u_t)]),
            "sliding": sliding,
        }

    def touching(self, plane):
        g, x = self.g, self.atoms["x"]
        for k in np.flatnonzero(self.mobile):
            gap = np.zeros(3)
            gap[plane.axis] = x[k, plane.axis] - plane.position
            gap[1] += min(x[k, 1] - plane.lowest, 0.0)
            distance = np.linalg.norm(gap)
            if distance >= g.radius:
                continue
            n, delta = gap / distance, g.radius - distance
            v_n, u_n = (part["v"][k] @ n - plane.rise * n[1] for part in (self.half, self.now))
            root = np.sqrt(g.radius * delta)
            gamma = g.damping_factor * np.sqrt(2 * g.contact_modulus * root * g.mass)
            f_n = 4 / 3 * g.contact_modulus * root * delta - gamma * v_n
            yield {
                "grain": k,
                "normal": n,
                "branch": distance * n,
                "rough": plane.friction > 0,
                "force": f_n * n,
                "elastic": 8 / 15 * g.contact_modulus * root * delta**2,
                "power": gamma * v_n * u_n,
                "work_rate": -f_n * u_n,
            }

    def friction_of_walls(self):
        rest = self.atoms["f"] - self.pair_force + [0, self.g.mass * self.gravity, 0]
        for wall in self.walls:
            rest[wall["grain"]] -= wall["force"]
        left, known, first = rest.copy(), self.mobile.copy(), set()
        for wall in (one for one in self.walls if one["rough"]):
            k, n = wall["grain"], wall["normal"]
            if k in first:
                known[k] = False
                continue
            first.add(k)
            f_t = rest[k] - (rest[k] @ n) * n
            u = self.now["v"][k] - np.cross(self.now["omega"][k], wall["branch"])
            power = f_t @ (u - (u @ n) * n)
            wall |= {"force": wall["force"] + f_t}
            wall |= {name: wall[name] - power for name in ("power", "work_rate")}
            left[k] -= f_t
        self.force_error = np.abs(left[known]).max(initial=0.0)

    def held(self) -> dict:
        g, n = self.g, self.mobile
        sums = sum((one["elastic"] for one in self.pairs), np.zeros(2))
        return {
            "kinetic": g.mass / 2 * (self.now["v"] ** 2).sum(),
            "rotational": g.inertia / 2 * (self.now["omega"] ** 2).sum(),
            "potential": g.mass * self.gravity * self.atoms["x"][n, 1].sum(),
            "normal": sums[0],
            "tangential": sums[1],
            "wall": sum(one["elastic"] for one in self.walls),
            "force_error": self.force_error,
        }


class Accounts:
    """Dissipated since the first state, by sum, grain id and age of the contact."""

    def __init__(self, start: State, interval, every_step, unit, thresholds):
        self.interval, self.every_step, self.unit = interval, every_step, unit
        self.thresholds = thresholds
        self.taken, self.grains = self.shares(start, "elastic", float(every_step))
        self.age = {one["key"]: np.inf for one in start.pairs}
        self.account = {one["key"]: self.held(one) for one in start.pairs}
        self.ended = np.zeros(len(thresholds))
        self.classes: list[tuple[float, float]] = []  # age and heat of ended contacts

    def held(self, one) -> np.ndarray:
        return one["elastic"] if self.every_step else np.zeros(2)

    @staticmethod
    def shares(state: State, value: str, weight: float):
        """Normal, tangential, base, wall; and by id."""
        sums, grains = np.zeros(4), defaultdict[int, float](float)
        ids = state.atoms["id"]
        for one in state.pairs:
            rate, moving = weight * one[value], [k for k in (one["i"], one["j"]) if state.mobile[k]]
            sums += [*rate, rate.sum() if len(moving) < 2 else 0.0, 0.0]
            for k in moving:
                grains[int(ids[k])] += rate.sum() / len(moving)
        for one in state.walls:
            sums[3] += weight * one[value]
            grains[int(ids[one["grain"]])] += weight * one[value]
        return sums, grains

    def add(self, state: State):
        value = "work_rate" if self.every_step else "power"
        sums, grains = self.shares(state, value, self.interval)
        self.taken = self.taken + sums
        for one, joules in grains.items():
            self.grains[one] += joules
        seen = {one["key"]: one[value] * self.interval for one in state.pairs}
        for gone in [key for key in self.account if key not in seen]:
            self.book(self.age.pop(gone), self.account.pop(gone).sum())
        for key, heat in seen.items():
            self.age[key] = self.age.get(key, 0.0) + self.interval / self.unit
            self.account[key] = self.account.get(key, np.zeros(2)) + heat

    def book(self, age: float, heat: float):
        self.ended += np.where(age > self.thresholds, heat, 0.0)
        self.classes.append((age, heat))

    def row(self, state: State):
        """Sums, by id, and by contacts older than each threshold."""
        sums, grains = self.shares(state, "elastic", float(self.every_step))
        enduring = self.ended.copy()
        for one in state.pairs:
            rest = (self.account[one["key"]] - self.held(one)).sum()
            enduring += np.where(self.age[one["key"]] > self.thresholds, rest, 0.0)
        by_id = {one: self.grains[one] - grains[one] for one in {*self.grains, *grains}}
        return self.taken - sums, by_id, enduring


def random_states(g: Grains, count: int, side: float, thickness: float, samples: int, seed: int):
    """Grains at random that drift, a tenth of them glued, in the order of an engine that sorts
    anew: yields arrays as of Liggghts.atoms and rows as of Liggghts.contacts. Springs are shorter
    and longer than friction holds.
    """
    random = np.random.default_rng(seed)
    x = random.uniform(0, [side, side, thickness], (count, 3))
    drift = random.normal(0, 0.02 * g.diameter, (count, 3))
    ids, kind = random.permutation(3 * count)[:count] + 1, np.where(
        random.random(count) < 0.1, 3, 1
    )
    for _ in range(samples):
        x = x + drift
        order = random.permutation(count)
        values = {"x": x[order], "id": ids[order], "type": kind[order]}
        for name, scale in (("v", 0.1), ("omega", 50.0), ("f", 1e-2), ("torque", 1e-5)):
            values[name] = random.normal(0, scale, (count, 3))
        atoms = {name: np.ascontiguousarray(values[name], kind_) for name, kind_ in ARRAYS.items()}
        branch = atoms["x"][:, None] - atoms["x"]
        branch[..., 2] -= thickness * np.round(branch[..., 2] / thickness)
        near = np.argwhere(np.triu(np.linalg.norm(branch, axis=2) < g.diameter, 1))
        mobile = atoms["type"] == 1
        near = near[mobile[near].any(axis=1)]
        rows = np.zeros((len(near), 7))
        rows[:, :2] = atoms["id"][near]
        rows[:, 3:6] = random.normal(0, 1, (len(near), 3)) * random.choice(
            [1e-8, 1e-3], (len(near), 1)
        )
        yield atoms, rows
