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
        alike = np.full(len(atoms["id"]), g.radius)
        self.r = atoms.get("radius", alike)
        self.m = g.density * 4 / 3 * np.pi * self.r**3
        self.inertia = 0.4 * self.m * self.r**2
        self.place = {int(one): k for k, one in enumerate(atoms["id"])}
        zero = ~self.mobile[:, None]
        self.now = {name: np.where(zero, 0.0, atoms[name]) for name in ("v", "omega", "f")}
        self.half = {
            "v": np.where(zero, 0.0, atoms["v"] - dt / 2 * atoms["f"] / self.m[:, None]),
            "omega": np.where(
                zero, 0.0, atoms["omega"] - dt / 2 * atoms["torque"] / self.inertia[:, None]
            ),
        }
        self.pairs = [self.pair(row) for row in rows]
        self.pair_force = np.zeros_like(atoms["x"])
        for one in self.pairs:
            self.pair_force[one["i"]] += one["force"]
            self.pair_force[one["j"]] -= one["force"]
        self.walls = [one for plane in planes for one in self.touching(plane)]
        self.friction_of_walls()

    # long: one contact law, term by term
    def pair(self, row) -> dict:
        g, a = self.g, self.atoms
        i, j = self.place[int(row[0])], self.place[int(row[1])]
        branch = a["x"][i] - a["x"][j]
        if self.thickness:
            branch[2] -= self.thickness * np.round(branch[2] / self.thickness)
        distance = np.linalg.norm(branch)
        n, delta = branch / distance, self.r[i] + self.r[j] - distance
        arms = self.r[i] - delta / 2, self.r[j] - delta / 2

        def relative(velocity, spin):
            v = velocity[i] - velocity[j]
            return v @ n, v - (v @ n) * n - np.cross(arms[0] * spin[i] + arms[1] * spin[j], n)

        v_n, v_t = relative(self.half["v"], self.half["omega"])
        u_n, u_t = relative(self.now["v"], self.now["omega"])
        m = 1 / sum(1 / self.m[k] for k in (i, j) if self.mobile[k])
        r = 1 / (1 / self.r[i] + 1 / self.r[j])
        root = np.sqrt(r * delta)
        s_n, k_t = 2 * g.contact_modulus * root, 8 * g.contact_shear_modulus * root
        gamma_n, gamma_t = (g.damping_factor * np.sqrt(k * m) for k in (s_n, k_t))
        hertz, mu, s = 4 / 3 * g.contact_modulus * root * delta, g.friction, row[3:6]
        f_n = hertz - gamma_n * v_n
        blur = SLIDING_TOLERANCE + ROUND_OFF * np.abs(a["x"]).max() / delta
        sliding = k_t * np.linalg.norm(s) >= mu * (abs(f_n) - blur * (hertz + gamma_n * abs(v_n)))
        f_t = -k_t * s - (0.0 if sliding else gamma_t) * v_t
        stored = np.array([8 / 15 * g.contact_modulus * root * delta**2, k_t * (s @ s) / 2, 0.0])
        rate = -u_n / (2 * delta)
        pull = self.now["f"][i] / self.m[i] - self.now["f"][j] / self.m[j]
        du_n = pull @ n + u_t @ u_t / distance
        df_n = -s_n * u_n - gamma_n * du_n - rate / 2 * gamma_n * v_n
        if sliding:
            p_t = -(f_t @ u_t) - mu**2 * f_n / k_t * (df_n - rate / 2 * f_n)
        else:
            p_t = gamma_t * (v_t @ u_t) - rate * stored[1]
        torque, work_r, p_r = np.zeros(3), 0.0, 0.0
        if g.rolls:
            limit = g.rolling_friction * r * abs(f_n)
            k_r = k_t * r**2
            if g.rolling_model == "epsd":
                k_r = 2.25 * hertz / delta * (g.rolling_friction * r) ** 2
            w, before = (part["omega"][i] - part["omega"][j] for part in (self.now, self.half))
            spring = row[6:9]
            doubt = blur * (hertz + gamma_n * abs(v_n)) * g.rolling_friction * r
            full = np.linalg.norm(spring) >= limit - doubt
            torque = spring.copy()
            if g.rolling_model == "epsd" and not full:
                inertia = 1.4 / sum(1 / (self.m[k] * self.r[k] ** 2) for k in (i, j))
                across = before - (before @ n) * n
                torque += 2 * g.rolling_damping * np.sqrt(inertia * k_r) * across
            stored[2] = spring @ spring / (2 * k_r)
            work_r = torque @ w
            gain = spring @ (w - (w @ n) * n) - rate * stored[2]
            if full:
                gain = (g.rolling_friction * r) ** 2 * f_n / k_r * (df_n - rate / 2 * f_n)
            p_r = work_r - gain
        return {
            "i": i,
            "j": j,
            "key": frozenset((int(row[0]), int(row[1]))),
            "force": f_n * n + f_t,
            "elastic": stored,
            "torque": -torque,
            "power": np.array([gamma_n * v_n * u_n, p_t, p_r]),
            "work_rate": np.array([-f_n * u_n, -(f_t @ u_t), work_r]),
            "sliding": sliding,
        }

    def touching(self, plane):
        g, x = self.g, self.atoms["x"]
        for k in np.flatnonzero(self.mobile):
            gap = np.zeros(3)
            gap[plane.axis] = x[k, plane.axis] - plane.position
            gap[1] += min(x[k, 1] - plane.lowest, 0.0)
            distance = np.linalg.norm(gap)
            if distance >= self.r[k]:
                continue
            n, delta = gap / distance, self.r[k] - distance
            v_n, u_n = (part["v"][k] @ n - plane.rise * n[1] for part in (self.half, self.now))
            root = np.sqrt(self.r[k] * delta)
            gamma = g.wall_damping_factor * np.sqrt(2 * g.contact_modulus * root * self.m[k])
            f_n = 4 / 3 * g.contact_modulus * root * delta - gamma * v_n
            yield {
                "grain": k,
                "normal": n,
                "branch": distance * n,
                "rough": plane.friction > 0,
                "driven": f_n * plane.rise * n[1],
                "force": f_n * n,
                "elastic": 8 / 15 * g.contact_modulus * root * delta**2,
                "power": gamma * v_n * u_n,
                "work_rate": -f_n * u_n,
            }

    def friction_of_walls(self):
        rest = self.atoms["f"] - self.pair_force
        rest[:, 1] += self.m * self.gravity
        for wall in self.walls:
            rest[wall["grain"]] -= wall["force"]
        turned = self.atoms["torque"] - self.pair_torque()
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
            if self.g.rolls:
                power += (turned[k] + np.cross(wall["branch"], f_t)) @ self.now["omega"][k]
            wall |= {"force": wall["force"] + f_t}
            wall |= {name: wall[name] - power for name in ("power", "work_rate")}
            left[k] -= f_t
        self.force_error = np.abs(left[known]).max(initial=0.0)

    def pair_torque(self) -> np.ndarray:
        out = np.zeros_like(self.atoms["x"])
        for one in self.pairs:
            i, j = one["i"], one["j"]
            branch = self.atoms["x"][i] - self.atoms["x"][j]
            branch[2] -= self.thickness * np.round(branch[2] / self.thickness)
            distance = np.linalg.norm(branch)
            overlap = self.r[i] + self.r[j] - distance
            turn = np.cross(branch / distance, one["force"])
            out[i] += one["torque"] - (self.r[i] - overlap / 2) * turn
            out[j] -= one["torque"] + (self.r[j] - overlap / 2) * turn
        return out

    def held(self) -> dict:
        n = self.mobile
        sums = sum((one["elastic"] for one in self.pairs), np.zeros(3))
        return {
            "kinetic": self.m @ (self.now["v"] ** 2).sum(axis=1) / 2,
            "rotational": self.inertia @ (self.now["omega"] ** 2).sum(axis=1) / 2,
            "potential": self.gravity * (self.m * self.atoms["x"][:, 1])[n].sum(),
            "normal": sums[0],
            "tangential": sums[1],
            "rolling": sums[2],
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
        return one["elastic"] if self.every_step else np.zeros(3)

    @staticmethod
    def shares(state: State, value: str, weight: float):
        """Normal, tangential, base, wall, rolling, driven; and by id."""
        sums, grains = np.zeros(6), defaultdict[int, float](float)
        ids = state.atoms["id"]
        for one in state.pairs:
            rate, moving = weight * one[value], [k for k in (one["i"], one["j"]) if state.mobile[k]]
            base = rate.sum() if len(moving) < 2 else 0.0
            sums += [rate[0], rate[1], base, 0.0, rate[2], 0.0]
            for k in moving:
                grains[int(ids[k])] += rate.sum() / len(moving)
        for one in state.walls:
            sums[3] += weight * one[value]
            grains[int(ids[one["grain"]])] += weight * one[value]
        return sums, grains

    def add(self, state: State):
        value = "work_rate" if self.every_step else "power"
        sums, grains = self.shares(state, value, self.interval)
        sums[5] = self.interval * sum(one["driven"] for one in state.walls)
        self.taken = self.taken + sums
        for one, joules in grains.items():
            self.grains[one] += joules
        seen = {one["key"]: one[value] * self.interval for one in state.pairs}
        for gone in [key for key in self.account if key not in seen]:
            self.book(self.age.pop(gone), self.account.pop(gone).sum())
        for key, heat in seen.items():
            self.age[key] = self.age.get(key, 0.0) + self.interval / self.unit
            self.account[key] = self.account.get(key, np.zeros(3)) + heat

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
    own = g.diameters(count, np.random.default_rng(seed + 1))
    x = random.uniform(0, [side, side, thickness], (count, 3))
    drift = random.normal(0, 0.02 * g.diameter, (count, 3))
    ids, kind = random.permutation(3 * count)[:count] + 1, np.where(
        random.random(count) < 0.1, 3, 1
    )
    for _ in range(samples):
        x = x + drift
        order = random.permutation(count)
        values = {"x": x[order], "id": ids[order], "type": kind[order]}
        radius = own[order] / 2
        for name, scale in (("v", 0.1), ("omega", 50.0), ("f", 1e-2), ("torque", 1e-5)):
            values[name] = random.normal(0, scale, (count, 3))
        atoms = {name: np.ascontiguousarray(values[name], kind_) for name, kind_ in ARRAYS.items()}
        branch = atoms["x"][:, None] - atoms["x"]
        branch[..., 2] -= thickness * np.round(branch[..., 2] / thickness)
        if not g.even:
            atoms["radius"] = radius
        reach = radius[:, None] + radius
        near = np.argwhere(np.triu(np.linalg.norm(branch, axis=2) < reach, 1))
        mobile = atoms["type"] == 1
        near = near[mobile[near].any(axis=1)]
        rows = np.zeros((len(near), 10 if g.rolls else 7))
        rows[:, :2] = atoms["id"][near]
        rows[:, 3:6] = random.normal(0, 1, (len(near), 3)) * random.choice(
            [1e-8, 1e-3], (len(near), 1)
        )
        if g.rolls:
            rows[:, 6:9] = random.normal(0, 1, (len(near), 3)) * random.choice(
                [1e-11, 1e-4], (len(near), 1)
            )
        yield atoms, rows
