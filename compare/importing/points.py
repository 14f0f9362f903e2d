"""Material points of other programs, from arrays under their names."""

import math
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cases.errors import CaseError
from compare.importing import headings
from compare.importing.frame import VECTORS, Frame

# Names, in small letters, that headings.meaning does not know; of two that mean one the first is
# taken.
SCALARS = {
    "mass": ("mass", "mass_solid", "m", "particle_mass"),
    "volume": ("volume", "vol", "integration_weight", "particle_volume"),
    "id": ("id", "material_point_id", "particleid", "particle_id", "tag"),
    "density": ("density", "rho", "mass_density"),
    "void_ratio": ("void_ratio",),
    "porosity": ("porosity",),
    "temperature": ("granular_temperature",),
    "type": ("type", "material_id", "materialid", "bodyid"),
    "time": ("time", "t_current", "t"),
    "step": ("step",),
}
ARRAYS = {
    "position": ("position", "x", "pos", "positions", "x_p", "xp", "coord", "coords"),
    "velocity": ("velocity", "velocity_solid", "v", "vel", "velocities", "v_p", "vp"),
    "stress": ("stress", "total_stress_solid", "eff_stress_solid", "cauchy_stress", "sigma"),
}
OF_ANURA3D = ("total_stress_solid", "eff_stress_solid")  # tension is positive there
AXES = "xyz"
SIX = ("sxx", "syy", "szz", "sxy", "syz", "szx")


def frame_of(arrays: Mapping[str, np.ndarray], source: str) -> Frame:
    """A frame of arrays by name: (N,), (N, 2 or 3), stresses (N, 2, 2), (N, 3, 3) or (N, 4, 6 or
    9), of six in the order xx, yy, zz, xy, yz, zx. What is not known is left out.
    """
    frame = Frame(source)
    lower = {name.lower(): np.asarray(values) for name, values in arrays.items()}
    for name, forms in SCALARS.items():
        for form in forms:
            if form in lower and lower[form].ndim <= 1:
                frame.columns.setdefault(name, lower[form])
    for name, values in lower.items():
        meant = headings.meaning(name)
        if meant in headings.KNOWN and values.ndim == 1:
            frame.columns.setdefault(meant, values)
    for name, forms in ARRAYS.items():
        form = next((one for one in forms if one in lower and lower[one].ndim > 1), "")
        if form:
            frame.columns |= split(name, lower[form], f"{source}: {form}")
            if form in OF_ANURA3D:
                frame.compression = False
    return completed(frame)


def split(name: str, values: np.ndarray, where: str) -> dict[str, np.ndarray]:
    """The columns of a vector or of a stress."""
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    width = flat.shape[1]
    if name != "stress":
        if width not in (2, 3):
            raise CaseError(f"{where}: {width} components (a {name} has 2 or 3)")
        return {VECTORS[name][k]: flat[:, k] for k in range(width)}
    if values.ndim == 3 and width == 4:
        return {"sxx": flat[:, 0], "syy": flat[:, 3], "sxy": flat[:, 1]}
    if width == 9:
        return dict(zip(SIX, (flat[:, k] for k in (0, 4, 8, 1, 5, 2))))
    if width == 6:
        return dict(zip(SIX, flat.T))
    if width == 4:
        return dict(zip(("sxx", "syy", "szz", "sxy"), flat.T))
    raise CaseError(f"{where}: {width} components (a stress has 4, 6 or 9)")


def completed(frame: Frame) -> Frame:
    """The frame with numbers as they are to be: time and step apart, ids whole, plane files' third
    axis at rest, porosity as void ratio.
    """
    columns = frame.columns
    for name in ("time", "step"):
        if name in columns:
            value = np.ravel(columns.pop(name))
            if value.dtype.kind not in "iufb" or not np.isfinite(value).all():
                raise CaseError(f"{frame.source}: {name} is no number")
            if value.size and name == "time":
                frame.time = float(value[0])
            elif value.size:
                frame.step = int(value[0])
    missing = [axis for axis in "xy" if axis not in columns]
    if missing:
        raise CaseError(f"{frame.source}: no {', '.join(missing)} (not material points)")
    if np.ndim(columns["x"]) != 1:
        raise CaseError(f"{frame.source}: x has shape {np.shape(columns['x'])} (not a column)")
    count = len(columns["x"])
    for name, values in list(columns.items()):
        if np.shape(values) != (count,):
            raise CaseError(f"{frame.source}: {name} has shape {np.shape(values)}, x ({count},)")
        if np.asarray(values).dtype.kind not in "iufb":
            raise CaseError(f"{frame.source}: {name} holds no numbers ({values.dtype.name})")
        with np.errstate(invalid="ignore"):  # a signalling NaN is refused later, with its point
            columns[name] = values.astype(float)
        if name == "id":
            whole = (columns[name] == np.trunc(columns[name])) & (np.abs(columns[name]) < 2.0**53)
            if not whole.all():
                row = int(np.argmin(whole))
                raise CaseError(f"{frame.source}: id {values[row]:g} is no whole number")
            columns[name] = values.astype(np.int64)
    plane = "z" not in columns
    if plane:
        columns["z"] = np.zeros(count)
        for name in ("vz", "syz", "szx"):
            columns.setdefault(name, np.zeros(count))
        if "vx" not in columns:
            columns.pop("vz")
        if "sxx" not in columns:
            del columns["syz"], columns["szx"]
    if "porosity" in columns:
        porosity = columns.pop("porosity")
        with np.errstate(divide="ignore", invalid="ignore"):
            columns.setdefault("void_ratio", porosity / (1.0 - porosity))
    columns.setdefault("id", np.arange(1, count + 1))
    return frame


def step_of(path: Path) -> int | None:
    """The last number in a file's name, its extensions aside."""
    stem = re.sub(r"(\.[A-Za-z]\w*)+$", "", path.name)
    found = re.findall(r"\d+", stem)
    return int(found[-1]) if found else None
