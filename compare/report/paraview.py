"""The script that opens an export in ParaView: open_in_paraview.py, with what it is to show."""

import json
import re
from pathlib import Path

import numpy as np

from cases.files import write_atomically
from compare.report.vtk import RANGED, Exported, Seen

NAME = "open_in_paraview.py"
SHOWN = 2  # files, the first of either engine


def write(exported: list[Exported], engines: list[str], folder: Path, place: Path) -> Path:
    """Writes the script for files that were exported to `folder` and will stand in `place`."""
    kinds = list(dict.fromkeys(engines))
    chosen = [exported[engines.index(kind)] for kind in kinds][:SHOWN]
    every = [one.seen.ranges for one in chosen]
    ranges = {
        name: [
            float(min(ranges[name][0] for ranges in every if name in ranges)),
            float(max(ranges[name][1] for ranges in every if name in ranges)),
        ]
        for name in RANGED
        if any(name in ranges for ranges in every)
    }
    if "velocity" in ranges:
        ranges["velocity"][0] = 0.0
    lowest, highest = zip(*(ranges["position"] for ranges in every if "position" in ranges))
    scene = {
        "folder": str(place.resolve()),
        "sides": [side(one) for one in chosen],
        "ranges": ranges,
        "corners": [np.min(lowest, axis=0).tolist(), np.max(highest, axis=0).tolist()],
    }
    text = Path(__file__).with_name(NAME).read_text()
    told = f"SCENE: dict = {literal(scene)}"
    write_atomically(folder / NAME, re.sub(r"^SCENE: dict = .*$", lambda _: told, text, flags=re.M))
    return folder / NAME


def literal(scene: dict) -> str:
    """As Python reads it: JSON, but for None."""
    return json.dumps(scene, indent=4).replace(": null", ": None")


def side(one: Exported) -> dict:
    seen: Seen = one.seen
    return {
        "name": one.particles.stem,
        "particles": one.particles.name,
        "contacts": one.contacts.name if one.contacts else None,
        "radius": seen.radius or None,
        "grain": float(seen.ranges["radius"][1]) if "radius" in seen.ranges else seen.radius,
        "force": seen.force,
        "colours": [name for name in RANGED if name in seen.ranges],
    }
