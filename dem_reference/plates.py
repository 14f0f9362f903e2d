"""Walls that end somewhere, as meshes: a gate that rises, and the bottom and wall of a silo."""

from pathlib import Path

import numpy as np

from . import scene
from .grains import Grains
from .scene import TYPES, Plane

# Puts a settled column into its silo, so many metres up. The engine moves no atoms before a run has
# handed out what the restart holds of each.
RAISE = "run 0\ndisplace_atoms all move 0 {:.17g} 0 units box"
REMOVE_LIFTED_GATE = "unfix rise\nunfix gate\nunfix plate"


def write_strip(path: Path, axis: int, position: float, ends: tuple[float, float], width: float):
    """A strip across `axis`, 0 or 1, at `position`, between two places along the other of the two
    and 0 and `width` along z [m], as STL.

    A mesh must span the periodic thickness exactly, or contacts count twice at the seam, and its
    triangles must be well shaped: so the strip is cut into near-squares of two triangles each.
    """
    low, high = ends
    edges = np.linspace(low, high, max(1, round((high - low) / width)) + 1)
    facets = [((a, 0), (b, 0), (b, width)) for a, b in zip(edges, edges[1:])] + [
        ((a, 0), (b, width), (a, width)) for a, b in zip(edges, edges[1:])
    ]
    place = "{x:.17g} {a:.17g} {b:.17g}" if axis == 0 else "{a:.17g} {x:.17g} {b:.17g}"
    lines = [f"solid {path.stem}"]
    for facet in facets:
        vertices = "\n".join(f"vertex {place.format(x=position, a=a, b=b)}" for a, b in facet)
        normal = "1 0 0" if axis == 0 else "0 1 0"
        lines.append(f"facet normal {normal}\nouter loop\n{vertices}\nendloop\nendfacet")
    path.write_text("\n".join([*lines, f"endsolid {path.stem}", ""]))


def lifted_gate(case: dict, grains: Grains, work: Path | None) -> str:
    """Commands for a smooth gate that rises at walls.gate_speed, from y = 0 and to two diameters
    above the column; its triangles go into the folder `work`, unless somebody else puts them there.
    """
    geometry = case["geometry"]
    ends = 0.0, geometry["height"] + 2 * grains.largest
    if work:
        write_strip(work / "gate.stl", 0, geometry["length"], ends, geometry["thickness"])
    return (
        f"fix plate all mesh/surface file gate.stl type {TYPES['smooth']}\n"
        f"fix gate {scene.wall(grains)} mesh n_meshes 1 meshes plate\n"
        f"fix rise all move/mesh mesh plate linear 0 {case['walls']['gate_speed']:.17g} 0"
    )


def silo(case: dict, grains: Grains, work: Path | None) -> str:
    """Commands for the bottom of a silo beside its orifice, a Coulomb plate, and for its smooth
    wall at x = L0 above it; their triangles go into the folder `work`, as of a gate. Where the
    bottom's lip meets the seam of the period, the engine lets both corners of the mesh push, and
    `force_error` tells.
    """
    geometry = case["geometry"]
    fall, length, thickness = (geometry[name] for name in ("fall", "length", "thickness"))
    top = fall + geometry["height"] + 2 * grains.largest
    if work:
        write_strip(work / "bottom.stl", 1, fall, (geometry["orifice"], length), thickness)
        write_strip(work / "side.stl", 0, length, (fall, top), thickness)
    meshes = [
        f"fix {name} all mesh/surface file {name}.stl type {TYPES[kind]}"
        for name, kind in (("bottom", "base"), ("side", "smooth"))
    ]
    both = f"fix silo {scene.wall(grains)} mesh n_meshes 2 meshes bottom side"
    return "\n".join([*meshes, both])


def standing(case: dict, grains: Grains) -> list[Plane]:
    """The walls that stay once the grains are released."""
    out = scene.planes(case, grains)
    if scene.silo(case):
        geometry, friction = case["geometry"], case["walls"]["base_friction"]
        fall, begin = geometry["fall"], geometry["orifice"]
        out.append(Plane(-2, 0, geometry["length"], lowest=fall))
        out.append(Plane(-6, 1, fall, friction, begin=begin))
    return out
