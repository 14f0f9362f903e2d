"""Which columns of a table are contacts: by the user's word, by their names, or by what they hold.

LIGGGHTS' `compute pair/gran/local` and `wall/gran/local` have one order whatever is asked for: pos
(6 columns), vel (6), id (3), force (3), … [LIGGGHTS manual, compute pair/gran/local]. LAMMPS'
`compute pair/local` gives as fx, fy, fz the force along the line of centres alone; the tangential
one is p1, p2, p3 of its granular pair styles [LAMMPS manual, pair gran/*], at a right angle to it.
Both give the force on the first of the two.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from cases.errors import CaseError
from compare.importing.frame import CONTACTS

NEEDED = CONTACTS[:5]
OPTION = 'say which they are: --contacts "first=7,second=8,fx=10,fy=11,fz=12" (numbers or names)'
DIGITS = 1e-4  # two numbers of six digits, products of three of them, agree to this
NOISE = 1e-9  # of the largest: what differences of doubles leave where a force is zero
NORMAL_ALONE = "the forces are normal parts alone (no friction, or p1 p2 p3 were not dumped)"
ALONG = "the forces are all along the line of centres (no friction, or normal parts alone)"
NAMES = {
    "first": ("first", "id1", "patom1", "natom1", "atom1", "particle1", "i"),
    "second": ("second", "id2", "patom2", "natom2", "atom2", "particle2", "j"),
    "fx": ("fx", "forcex", "force_x"),
    "fy": ("fy", "forcey", "force_y"),
    "fz": ("fz", "forcez", "force_z"),
    "px": ("px", "contactx", "contact_x"),
    "py": ("py", "contacty", "contact_y"),
    "pz": ("pz", "contactz", "contact_z"),
    "power": ("power",),
}
TANGENTIAL = {"fx": "p1", "fy": "p2", "fz": "p3"}

Columns = dict[str, np.ndarray]
Triple = tuple[str, str, str]


@dataclass
class Layout:
    """The columns of each quantity of CONTACTS, which are summed, or what makes them of all; and
    what a reader of the result must know.
    """

    sums: dict[str, list[str]]
    make: Callable[[Columns], Columns] | None = None
    notes: list[str] = field(default_factory=list)

    def contacts(self, columns: Columns) -> Columns:
        out = {role: np.sum([columns[c] for c in names], 0) for role, names in self.sums.items()}
        return out | (self.make(columns) if self.make else {})


def of_user(words: str, names: list[str], columns: Columns, where: str) -> Layout:
    """The layout that "first=7,fx=c_p[2]+c_p[5],…" tells; raises CaseError where it does not."""
    sums: dict[str, list[str]] = {}
    for word in words.split(","):
        role, _, value = (part.strip() for part in word.partition("="))
        if role not in CONTACTS or not value:
            raise CaseError(f"--contacts: {word!r} (of {', '.join(CONTACTS)}) as in fx=10")
        sums[role] = []
        for one in (part.strip() for part in value.split("+")):
            if one not in names and one.isdecimal() and 1 <= int(one) <= len(names):
                one = names[int(one) - 1]
            if one not in columns:
                raise CaseError(f"{where}: no column {one} of numbers (has {', '.join(names)})")
            sums[role].append(one)
    missing = [role for role in NEEDED if role not in sums]
    if missing:
        raise CaseError(f"--contacts: no {', '.join(missing)} (needs {', '.join(NEEDED)})")
    return Layout(sums)


def of_names(columns: Columns) -> Layout | None:
    """The layout that plain names tell, if they do."""
    lower = {name.lower(): name for name in reversed(columns)}
    sums = {
        role: [lower[name]]
        for role, names in NAMES.items()
        for name in reversed(names)
        if name in lower
    }
    if not all(role in sums for role in NEEDED):
        return None
    layout = Layout(sums)
    if all(name in lower for name in TANGENTIAL.values()):
        for role, name in TANGENTIAL.items():
            sums[role].append(lower[name])
        layout.notes.append("p1, p2, p3 are taken as the tangential force, which is added")
    return layout


def of_content(columns: Columns) -> list[Layout]:
    """Every layout that fits what the columns hold; one where that tells."""
    groups: dict[str, dict[int, str]] = {}
    for name in columns:
        if compute := compute_of(name):
            groups.setdefault(compute, {})[int(name[len(compute) + 1 : -1])] = name
    one = [
        layout
        for group in groups.values()
        for start in (1, 7, 13)
        if (layout := of_liggghts(columns, group, start))
    ]
    return one or of_lammps(columns)


def compute_of(name: str) -> str:
    """The compute or fix that a column with a number is of: c_pair of c_pair[3]."""
    found = re.fullmatch(r"([cf]_\w+)\[[0-9]{1,9}\]", name)
    return found[1] if found else ""


def are_ids(values: np.ndarray, least: int) -> bool:
    return bool(np.all((values == np.trunc(values)) & (values >= least)))


def vectors(columns: Columns, names: Triple | list[str]) -> np.ndarray:
    return np.stack([columns[name] for name in names], axis=1)


def of_liggghts(columns: Columns, group: dict[int, str], start: int) -> Layout | None:
    """The layout if the ids of one compute are its columns from number `start`."""
    numbers = (start, start + 1, *range(start + 3, start + 6))
    if not all(number in group for number in numbers):
        return None
    first, second = (columns[group[start + i]] for i in (0, 1))
    third = columns[group[start + 2]] if start + 2 in group else np.zeros_like(first)
    force = [group[start + i] for i in (3, 4, 5)]
    if all(are_ids(np.abs(columns[name]), 1) for name in force):
        return None  # other ids
    if not (are_ids(first, 0) and are_ids(second, 0) and are_ids(third, 0)):
        return None
    of_pairs = bool(np.all((first >= 1) & (second >= 1) & (first != second) & (third <= 1)))
    of_walls = start + 2 in group and bool(np.all(third >= 1))
    if of_pairs == of_walls:
        return None
    sums = dict(zip(("fx", "fy", "fz"), ([name] for name in force)))
    places = (
        [group[i] for i in range(1, 7)]
        if start > 1 and all(i in group for i in range(1, 7))
        else []
    )
    if of_walls:
        return wall_layout(columns, group, start, sums, places)
    layout = Layout(sums | {"first": [group[start]], "second": [group[start + 1]]})
    rest = [group[start + i] for i in (6, 7, 8) if start + i in group]
    if places:
        add_tangential(columns, layout, force, rest, places, third == 0)
    return layout


def add_tangential(
    columns: Columns, layout: Layout, force: list, rest: list, places: list, near: np.ndarray
) -> None:
    """Where the forces are all along the branch, of the pairs `near` that cross no boundary, they
    are the normal part: the tangential one, at a right angle, follows as `rest` or is missing.
    """
    branch = vectors(columns, places[:3]) - vectors(columns, places[3:])
    along = vectors(columns, force)
    if not near.any() or not are_parallel(branch[near], along[near]) or not along[near].any():
        return
    if (
        len(rest) == 3
        and vectors(columns, rest).any()
        and are_square(along, vectors(columns, rest))
    ):
        for role, name in zip(("fx", "fy", "fz"), rest):
            layout.sums[role].append(name)
        layout.notes.append("force_normal and force_tangential are added")
    else:
        layout.notes.append(ALONG)


def wall_layout(
    columns: Columns, group: dict[int, str], start: int, sums: dict, places: list[str]
) -> Layout:
    """Of `wall/gran/local`: id holds mesh, triangle and grain, pos the contact point and centre."""
    point, centre = places[:3], places[3:]

    def make(columns: Columns) -> Columns:
        out = {"second": -1.0 - columns[group[start]]}
        if places:
            branch = vectors(columns, centre) - vectors(columns, point)
            out |= dict(zip(("px", "py", "pz"), (columns[name] for name in point)))
            out |= dict(zip(("bx", "by", "bz"), branch.T))
        return out

    if places:
        branch = vectors(columns, centre) - vectors(columns, point)
        force = vectors(columns, [sums[role][0] for role in ("fx", "fy", "fz")])
        if np.mean(np.sum(branch * force, 1) >= 0) < 0.9:  # velocities, say
            places = point = centre = []
    return Layout(sums | {"first": [group[start + 2]]}, make)


def of_lammps(columns: Columns) -> list[Layout]:
    """The layouts of `property/local` and `pair/local`: two adjacent columns of ids, and in what
    is no id, of another compute, one triple of forces, or two at a right angle to each other.
    """
    names = [name for name in columns if name != "index"]
    whole = [are_ids(columns[name], 1) for name in names]
    pairs = [
        (names[i], names[i + 1])
        for i in range(len(names) - 1)
        if whole[i] and whole[i + 1] and run_before(whole, i) % 2 == 0
        if are_pairs(columns[names[i]], columns[names[i + 1]])
    ]
    forces = forces_of(columns, [name for name, ids in zip(names, whole) if not ids])
    return [
        Layout(
            {"first": [first], "second": [second]}
            | {role: [one[i] for one in force] for i, role in enumerate(("fx", "fy", "fz"))},
            notes=[] if len(force) == 2 else [NORMAL_ALONE],
        )
        for first, second in pairs
        for force in forces
        if not compute_of(first) or compute_of(first) != compute_of(force[0][0])
    ]


def forces_of(columns: Columns, names: list[str]) -> list[tuple[Triple, ...]]:
    """The triples that may be the force, alone or the sum of two, among columns that are no ids:
    those that leave no column unexplained. Two triples are at a right angle in every row.
    """
    triples = [
        triple
        for triple in zip(names, names[1:], names[2:])
        if np.isfinite(vectors(columns, triple)).all()
    ]
    square: list[tuple[Triple, ...]] = [
        (a, b)
        for at, a in enumerate(triples)
        for b in triples[at + 3 :]
        if is_force(columns, a) or is_force(columns, b)
        if are_square(vectors(columns, a), vectors(columns, b))
        if explained(columns, names, (a, b))
    ]
    return square or [
        (one,) for one in triples if is_force(columns, one) and explained(columns, names, (one,))
    ]


def is_force(columns: Columns, triple: Triple) -> bool:
    """Whether some component is negative, which no list of distances, energies, … is."""
    return bool(np.any(vectors(columns, triple) < 0))


def explained(columns: Columns, names: list[str], force: tuple[Triple, ...]) -> bool:
    """Whether what is left beside the force is zero, the size of its parts, a distance (positive
    everywhere) or dx, dy, dz.
    """
    left = [name for name in names if not any(name in triple for triple in force)]
    sizes = [norm(vectors(columns, triple)) for triple in force]
    for triple in zip(left, left[1:], left[2:]):
        length = norm(vectors(columns, triple))
        others = [columns[name] for name in left if name not in triple]
        if np.all(length > 0) and any(np.allclose(one, length, DIGITS, 0) for one in others):
            left = [name for name in left if name not in triple]
            break
    return all(
        np.all(columns[name] > 0)
        or not columns[name].any()
        or any(np.allclose(np.abs(columns[name]), size, DIGITS, 0) for size in sizes)
        for name in left
    )


def run_before(flags: list[bool], at: int) -> int:
    """How many true flags stand in a row right before `at`."""
    count = 0
    while count < at and flags[at - count - 1]:
        count += 1
    return count


def are_pairs(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two columns of whole numbers are ids of pairs: never equal, few of them twice (two
    images), where a type, say, would come again and again.
    """
    pairs = np.stack([np.minimum(first, second), np.maximum(first, second)], axis=1)
    return bool(np.all(first != second)) and len(np.unique(pairs, axis=0)) > 0.9 * len(pairs)


def are_parallel(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.all(norm(np.cross(a, b)) <= DIGITS * norm(a) * norm(b)))


def are_square(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two vectors are at a right angle in every row where neither is a rounding error."""
    sizes = norm(a), norm(b)
    real = np.all([size > NOISE * size.max(initial=0.0) for size in sizes], axis=0)
    aligned = np.abs(np.sum(a * b, axis=1)) > DIGITS * sizes[0] * sizes[1]
    return not np.any(real & aligned)


def norm(a: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a, axis=1)
