"""List the scenes: grains, cells, what each takes, its picture.

A scene is a folder of cases/ whose case.toml is one; `./grainpair run NAME` runs it. Time is that
of one processor to the longest end the case allows, as estimated (cases/rates.toml: within a factor
of two or three); memory is the engine's. A picture shows the scene before its release, drawn from
the case (python3 -m compare.pages.scenes).
"""

import json
import tomllib
from pathlib import Path

from cases import case, cost
from cases.errors import CaseError
from cases.lookup import cases_in
from cases.programs import ROOT, short
from compare.cost import size
from compare.pages import scenes as drawn
from dem_reference import cost as grains_cost
from dem_reference.packing import dict_of


def arguments(parser):
    parser.add_argument(
        "--json", action="store_true", help="the same as JSON, in SI units: seconds and bytes"
    )


def run(options) -> int:
    found = scenes()
    if options.json:
        print(json.dumps(found, indent=1, ensure_ascii=False))
    else:
        print("\n".join(lines(found)))
    return 0


def scenes() -> list[dict]:
    """Every scene, as `about` tells it."""
    return [about(ROOT / "cases" / name) for name in cases_in(ROOT / "cases") if is_scene(name)]


def is_scene(name: str) -> bool:
    """Whether a case is a scene; the others are element tests."""
    return "element" not in tomllib.loads((ROOT / "cases" / name / "case.toml").read_text())


def about(folder: Path) -> dict:
    """What there is to know of a scene: name, title, picture (a path or None), and for each engine
    counts, seconds [s], bytes of memory and disk.
    """
    scene = case.load(folder)
    return {
        "name": folder.name,
        "title": scene["title"],
        "picture": picture(folder),
        "continuum": engine(cost.continuum, scene),
        "grains": engine(lambda one: grains_cost.estimate(dict_of(one)), scene),
    }


def engine(estimate, scene: case.Case) -> dict | None:
    """What an engine takes; None where it refuses the scene."""
    try:
        found: cost.Cost = estimate(scene)
    except CaseError:
        return None
    figures = {"seconds": found.seconds, "bytes": found.bytes, "disk": found.disk}
    return found.counts | {name: round(value) for name, value in figures.items()}


def picture(folder: Path) -> str | None:
    """The scene's picture; None of one that has not been drawn."""
    file = drawn.picture(folder.name)
    return str(short(file)) if file.is_file() else None


def lines(scenes: list[dict]) -> list[str]:
    """A row of the table for each scene, below it its title and its picture."""
    out = [f"{'scene':<16}{'grains':>9}{'takes':>10}{'':>10}{'cells':>10}{'takes':>10}{'':>10}"]
    for one in scenes:
        row = f"{one['name']:<16}"
        for name, count in (("grains", "grains"), ("continuum", "nodes")):
            takes = one[name]
            row += (
                f"{takes[count]:>{9 if name == 'grains' else 10},}"
                f"{cost.duration(takes['seconds']):>10}{size(takes['bytes']):>10}"
                if takes
                else f"{'refused':>{29 if name == 'grains' else 30}}"
            )
        out.append(f"{row}\n    {one['title']}")
        if one["picture"]:
            out.append(f"    {one['picture']}")
    return out
