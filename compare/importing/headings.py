"""What a column is, told from its heading: "Position X (mm)", "velocity_x [m/s]", "pos_x"."""

import re
from dataclasses import dataclass

from cases.errors import CaseError

KNOWN = (
    *("id", "type", "radius", "diameter", "mass", "density", "volume", "void_ratio", "temperature"),
    *("x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz", "time", "step"),
    *("sxx", "syy", "szz", "sxy", "syz", "szx"),
)
# Words that do not change what a column is
FILLERS = {
    "particle",
    "particles",
    "ball",
    "balls",
    "grain",
    "absolute",
    "translational",
    "point",
    "state",
}
AXES = {"x": "x", "y": "y", "z": "z", "0": "x", "1": "y", "2": "z"}
POSITION = {"position", "pos", "coordinate", "coordinates", "coord", "coords", "points", "centroid"}
POSITION |= {"centre", "center", "location"}
VELOCITY = {"velocity", "vel", "v"}
TURNING = {"angular", "ang", "rotational", "rot"}
SPIN = {"omega", "angvel", "spin"}
STRESS = {"stress", "sigma", "s"}
COMPONENTS = {
    **{"xx": "sxx", "yy": "syy", "zz": "szz", "xy": "sxy", "yz": "syz", "zx": "szx"},
    **{"xz": "szx", "yx": "sxy", "zy": "syz", "11": "sxx", "22": "syy", "33": "szz"},
    **{"12": "sxy", "23": "syz", "13": "szx", "31": "szx"},
}
SIX = dict(enumerate(("sxx", "syy", "szz", "sxy", "syz", "szx")))
NINE = {0: "sxx", 4: "syy", 8: "szz", 1: "sxy", 5: "syz", 2: "szx"}
SINGLE = {
    "id": {"id", "ids", "tag"},
    "type": {"type", "material", "species", "material id", "type id"},
    "radius": {"radius", "rad", "r", "radii"},
    "diameter": {"diameter", "diam", "dia", "d"},
    "mass": {"mass", "m"},
    "density": {"density", "rho"},
    "volume": {"volume", "vol"},
    "void_ratio": {"void ratio", "voidratio"},
    "temperature": {"granular temperature"},
    "time": {"time", "t"},
    "step": {"step", "timestep", "time step", "cycle"},
}
GLUED = "|".join(sorted(POSITION | VELOCITY | SPIN | STRESS, key=len, reverse=True))
# What a unit is in SI; a heading without one may mean anything.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "km": 1e3}
TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
MASSES = {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "t": 1e3}
STRESSES = {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "n/m2": 1.0}
TURNS = {"rad/s": 1.0, "1/s": 1.0, "rad/sec": 1.0, "deg/s": 0.017453292519943295}
TURNS["rpm"] = 6.283185307179586 / 60.0
UNITS: dict[str, dict[str, float]] = {
    "length": LENGTHS,
    "time": TIMES,
    "mass": MASSES,
    "speed": {f"{a}/{b}": x / y for a, x in LENGTHS.items() for b, y in TIMES.items()},
    "turn": TURNS,
    "density": {f"{a}/{b}3": x / y**3 for a, x in MASSES.items() for b, y in LENGTHS.items()},
    "volume": {f"{b}3": y**3 for b, y in LENGTHS.items()},
    "stress": STRESSES,
    "temperature": {
        f"{a}2/{b}2": (x / y) ** 2 for a, x in LENGTHS.items() for b, y in TIMES.items()
    },
}
KIND = {
    **dict.fromkeys(("x", "y", "z", "radius", "diameter"), "length"),
    **dict.fromkeys(("vx", "vy", "vz"), "speed"),
    **dict.fromkeys(("omegax", "omegay", "omegaz"), "turn"),
    **dict.fromkeys(("sxx", "syy", "szz", "sxy", "syz", "szx"), "stress"),
    **{name: name for name in ("time", "mass", "density", "volume", "temperature")},
}


@dataclass(frozen=True)
class Heading:
    """A column's heading: the text of the file, what it is of KNOWN (else its text), its unit's
    factor to SI, None where it has none.
    """

    text: str
    name: str
    factor: float | None

    @property
    def known(self) -> bool:
        return self.name in KNOWN


def parts(text: str) -> tuple[str, str | None]:
    """The words of a heading, and the unit in brackets at its end."""
    text = re.sub(r"^\s*Q\d+\s*:\s*", "", text.strip())  # the count of a query, as EDEM puts before
    found = re.fullmatch(r"(.*?)\s*[(\[]([^()\[\]]*)[)\]]\s*", text)
    return (found[1].strip(), found[2].strip()) if found else (text, None)


def tokens(text: str) -> list[str]:
    """The words of a heading, in small letters, without fillers."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    found = re.findall(r"[a-z]+|\d+", re.sub(r"[_\-:.,/]", " ", text).lower())
    split: list[str] = []
    for word in found:
        end = re.fullmatch(rf"({GLUED})(xx|yy|zz|xy|yz|zx|xz|yx|zy|x|y|z)", word)
        start = re.fullmatch(rf"(x|y|z)({GLUED})", word)
        glued = end or start
        split += glued.groups() if glued else [word]
    return split if set(split) <= FILLERS else [word for word in split if word not in FILLERS]


def meaning(text: str) -> str | None:
    """What of KNOWN a heading without its unit means; None if nothing or no one can tell."""
    found = tokens(text)
    joined = " ".join(found)
    for name, forms in SINGLE.items():
        if joined in forms:
            return name
    axes = [word for word in found if word in AXES]
    rest = {word for word in found if word not in AXES}
    if len(axes) == 1 and (rest or axes[0] in "xyz"):
        axis = AXES[axes[0]]
        if rest <= POSITION:
            return axis
        if rest <= VELOCITY:
            return f"v{axis}"
        if rest <= SPIN or (rest & TURNING and rest <= TURNING | VELOCITY and rest & VELOCITY):
            return f"omega{axis}"
    pairs = [word for word in found if word in COMPONENTS]
    if len(pairs) == 1 and len(found) == 2 and rest - set(pairs) <= STRESS:
        return COMPONENTS[pairs[0]]
    return None


def numbered_stress(texts: list[str]) -> dict[int, str]:
    """What the columns Stress:0, Stress:1, … are, by their place: six or nine components in VTK's
    order.
    """
    found = {}
    for at, text in enumerate(texts):
        words = tokens(parts(text)[0])
        if len(words) == 2 and words[0] in STRESS and words[1].isdecimal():
            found[int(words[1])] = at
    names = {6: SIX, 9: NINE}.get(len(found), {})
    return {found[k]: name for k, name in names.items()} if found.keys() >= names.keys() else {}


def factor_of(unit: str | None, name: str, where: str) -> float | None:
    """SI per unit; None where there is none. Raises CaseError for one that `name` cannot have."""
    kind = KIND.get(name)
    if unit is None or kind is None or unit in ("-", ""):
        return None
    plain = unit.lower().replace("µ", "u").replace("μ", "u").replace(" ", "")
    plain = re.sub(r"[\^*]", "", plain.replace("²", "2").replace("³", "3"))
    plain = re.sub(r"^([a-z0-9]+?)[.·]?s-1$", r"\1/s", plain)
    if plain not in UNITS[kind]:
        some = ", ".join(list(UNITS[kind])[:4])
        raise CaseError(f"{where}: unit '{unit}' of a {kind} (known: {some}, ...)")
    return UNITS[kind][plain]


def given(text: str, where: str) -> dict[str, str]:
    """The names that the user gives columns: "x=Name,radius=Other name"."""
    named = {}
    for part in re.split(r",(?=\s*\w+\s*=)", text):
        name, found, column = part.partition("=")
        if not found or name.strip() not in KNOWN:
            raise CaseError(
                f"{where}: --columns '{part}': not NAME=COLUMN with a name of {', '.join(KNOWN)}"
            )
        named[name.strip()] = column.strip()
    return named


def headings(texts: list[str], where: str, columns: str | None = None) -> list[Heading]:
    """What the columns of a file are; `columns` is what the user says of them. Raises CaseError
    where two could be the same, or a unit is unknown.
    """
    named = given(columns, where) if columns else {}
    chosen: dict[int, tuple[str, str | None]] = {}
    for name, wanted in named.items():
        bare, unit = parts(wanted)
        at = [i for i, t in enumerate(texts) if t == wanted]
        at = at or [i for i, t in enumerate(texts) if bare in (t, parts(t)[0])]
        if len(at) != 1:
            raise CaseError(
                f"{where}: --columns {name}={wanted}: {len(at)} columns of that name (has "
                f"{', '.join(texts)})"
            )
        chosen[at[0]] = (name, unit if unit is not None else parts(texts[at[0]])[1])
    found = []
    stress = numbered_stress(texts)
    for i, text in enumerate(texts):
        bare, unit = parts(text)
        known = stress.get(i) or meaning(bare) or ""
        if i in chosen:
            known, unit = chosen[i]
        elif known in named:
            known = ""
        found.append(Heading(text, known or text, factor_of(unit, known, f"{where}: '{text}'")))
    for name in KNOWN:
        same = [h.text for h in found if h.name == name and h.known]
        if len(same) > 1:
            raise CaseError(
                f"{where}: columns '{same[0]}' and '{same[1]}' could both be {name} choose: "
                f"--columns {name}=NAME"
            )
    return found


def in_si(found: list[Heading], where: str) -> bool:
    """Whether the units of the headings make them SI. Raises CaseError where some are in other
    units and others do not say.
    """
    measured = [h for h in found if h.known and h.name in KIND]
    silent = [h for h in measured if h.factor is None]
    other = [h for h in measured if h.factor not in (None, 1.0)]
    if other and silent:
        raise CaseError(
            f"{where}: '{other[0].text}' has a unit, '{silent[0].text}' has none say it: "
            f'--columns "{silent[0].name}={silent[0].text} [UNIT]"'
        )
    return any(h.factor is not None for h in measured)
