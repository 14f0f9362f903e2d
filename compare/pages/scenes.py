"""A picture of each scene as it stands before its release, and the table of scenes in the docs.

    python3 -m compare.pages.scenes

writes docs/pictures/scenes/<scene>.svg and the rows of docs/reference/cases.md. Everything is drawn
from the case: the column to scale between wall, floor and gate, filled with grains of their size.
"""

import sys
from pathlib import Path

from cases import case, cost
from cases.errors import exit_code
from cases.files import write_atomically
from cases.programs import ROOT
from cases.scenes import is_chute, is_silo

PICTURES = ROOT / "docs" / "pictures" / "scenes"
PAGE = ROOT / "docs" / "reference" / "cases.md"
START, END = "| scene | what it is | engines take |", "\n\n"
WIDE, HIGH, WALL, FLOOR = 300.0, 150.0, 60.0, 118.0  # of the picture, and where wall and floor are
ROOM = (96.0, 150.0)  # a column may be so high and so long

BEGIN = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 150" width="300" height="150" \
role="img" aria-label="{words}">
<rect width="300" height="150" fill="#fff"/>
<pattern id="grains" width="{pitch:.3f}" height="{pitch:.3f}" patternUnits="userSpaceOnUse" \
x="{x:.3f}" y="{y:.3f}"><circle cx="{half:.3f}" cy="{half:.3f}" r="{radius:.3f}" fill="#c8561b"/>
</pattern>
<rect x="{x:.3f}" y="{y:.3f}" width="{length:.3f}" height="{height:.3f}" fill="url(#grains)"/>
"""
CLOSE = """<text x="292" y="146" text-anchor="end">{about}</text>
</g></svg>
"""

SVG = (
    BEGIN
    + """\
<path d="M{x:.3f} 8V118H292" fill="none" stroke="#26292e" stroke-width="1.5"{left}/>
<path d="M{gate:.3f} 8V118" fill="none" stroke="#1f5fa8" stroke-width="1.2" \
stroke-dasharray="4 3"/>
<g font-family="DejaVu Sans, sans-serif" font-size="10" fill="#26292e">
<text x="{middle:.3f}" y="132" text-anchor="middle">{long}</text>
<text x="54" y="{beside:.3f}" text-anchor="end">{high}</text>
<text x="{after:.3f}" y="18" fill="#1f5fa8">gate</text>
"""
    + CLOSE
)

CHUTE = (
    BEGIN
    + """\
<path d="M{x:.3f} {floor:.3f}H{end:.3f}" fill="none" stroke="#26292e" stroke-width="1.5"/>
<path d="M{x:.3f} 8V118M{end:.3f} 8V118" fill="none" stroke="#1f5fa8" stroke-width="1.2" \
stroke-dasharray="4 3"/>
<g font-family="DejaVu Sans, sans-serif" font-size="10" fill="#26292e">
<text x="{middle:.3f}" y="132" text-anchor="middle">{long}, then again</text>
<text x="54" y="{beside:.3f}" text-anchor="end">{high}</text>
<text x="292" y="18" text-anchor="end" fill="#1f5fa8">inclined {angle:g}°</text>
"""
    + CLOSE
)


SILO = (
    BEGIN
    + """\
<path d="M{x:.3f} 8V118H292M{lip:.3f} {foot:.3f}H{end:.3f}V8" fill="none" stroke="#26292e" \
stroke-width="1.5"/>
<path d="M{x:.3f} {foot:.3f}H{lip:.3f}" fill="none" stroke="#1f5fa8" stroke-width="1.2" \
stroke-dasharray="4 3"/>
<g font-family="DejaVu Sans, sans-serif" font-size="10" fill="#26292e">
<text x="{middle:.3f}" y="132" text-anchor="middle">{long}</text>
<text x="54" y="{beside:.3f}" text-anchor="end">{high}</text>
<text x="292" y="112" text-anchor="end" fill="#1f5fa8">half a slot of {slot}</text>
"""
    + CLOSE
)


def millimetres(value: float) -> str:
    return f"{1000.0 * value:.4g} mm"


def words(scene: case.Case) -> str:
    """What a picture shows, in words."""
    round_one = scene["geometry.dimension"] == "axisymmetric"
    form = "cylinder of radius" if round_one else "column of length"
    high, long = (millimetres(scene[f"geometry.{name}"]) for name in ("height", "length"))
    grains = millimetres(scene["grains.diameter"])
    if is_chute(scene["geometry"]):
        angle = scene["geometry.inclination"]
        return (
            f"A layer {high} deep, of grains of {grains}, on a plane of {angle:g} degrees; it "
            f"repeats after {long}"
        )
    if is_silo(scene["geometry"]):
        slot = millimetres(2.0 * scene["geometry.orifice"])
        return (
            f"One half of a silo, {long} long and filled {high} high with grains of {grains}, "
            f"above a floor; it leaves by a slot of {slot}"
        )
    return f"A {form} {long} and height {high}, of grains of {grains}, behind a gate"


def draw(scene: case.Case) -> str:
    """The picture as SVG."""
    height, length = scene["geometry.height"], scene["geometry.length"]
    scale = min(ROOM[0] / height, ROOM[1] / length)
    pitch = scale * scene["grains.diameter"]
    round_one = scene["geometry.dimension"] == "axisymmetric"
    if is_chute(scene["geometry"]):
        return draw_chute(scene, scale)
    if is_silo(scene["geometry"]):
        return draw_silo(scene)
    thick = "" if round_one else f", {millimetres(scene['geometry.thickness'])} thick"
    return SVG.format(
        words=words(scene),
        pitch=pitch,
        half=0.5 * pitch,
        radius=0.46 * pitch,
        x=WALL,
        y=FLOOR - scale * height,
        length=scale * length,
        height=scale * height,
        gate=WALL + scale * length,
        middle=WALL + 0.5 * scale * length,
        long=millimetres(length),
        beside=FLOOR - 0.5 * scale * height + 4.0,
        high=millimetres(height),
        after=WALL + scale * length + 5.0,
        about=f"grains of {millimetres(scene['grains.diameter'])}{thick}",
        left=' stroke-dasharray="7 3 1.5 3"' if round_one else "",
    )


def draw_chute(scene: case.Case, scale: float) -> str:
    """A layer between the ends of its period, on its slope."""
    height, length = scene["geometry.height"], scene["geometry.length"]
    pitch = scale * scene["grains.diameter"]
    return CHUTE.format(
        words=words(scene),
        pitch=pitch,
        half=0.5 * pitch,
        radius=0.46 * pitch,
        x=WALL,
        y=FLOOR - scale * height,
        length=scale * length,
        height=scale * height,
        end=WALL + scale * length,
        angle=scene["geometry.inclination"],
        middle=WALL + 0.5 * scale * length,
        floor=FLOOR,
        long=millimetres(length),
        high=millimetres(height),
        beside=FLOOR - 0.5 * scale * height + 4.0,
        about=f"grains of {millimetres(scene['grains.diameter'])}, "
        f"{millimetres(scene['geometry.thickness'])} thick",
    )


def picture(name: str) -> Path:
    return PICTURES / f"{name}.svg"


def row(about: dict) -> str:
    """A line of the docs' table; `about` as `compare.commands.cases.about` has it."""
    name = about["name"]
    takes = " and ".join(
        f"{cost.duration(about[one]['seconds'])} ({words})" if about[one] else f"{words} refuse it"
        for one, words in (("continuum", "continuum"), ("grains", "grains"))
    )
    alt = words_of(name)
    shown = f"![{alt}](../pictures/scenes/{name}.svg)"
    return f"| `{name}` {shown} | {about['title']} | {takes} |"


def draw_silo(scene: case.Case) -> str:
    """The same of a silo, above the floor that it empties onto."""
    geometry = scene["geometry"]
    height, length, fall = (geometry[name] for name in ("height", "length", "fall"))
    scale = min(ROOM[0] / (height + fall), ROOM[1] / length)
    pitch, foot = scale * scene["grains.diameter"], FLOOR - scale * fall
    return SILO.format(
        words=words(scene),
        pitch=pitch,
        half=0.5 * pitch,
        radius=0.46 * pitch,
        x=WALL,
        y=foot - scale * height,
        foot=foot,
        length=scale * length,
        height=scale * height,
        lip=WALL + scale * geometry["orifice"],
        end=WALL + scale * length,
        middle=WALL + 0.5 * scale * length,
        long=millimetres(length),
        beside=foot - 0.5 * scale * height + 4.0,
        high=millimetres(height),
        slot=millimetres(2.0 * geometry["orifice"]),
        about=f"grains of {millimetres(scene['grains.diameter'])}, "
        f"{millimetres(geometry['thickness'])} thick",
    )


def words_of(name: str) -> str:
    return words(case.load(ROOT / "cases" / name))


def page(text: str, scenes: list[dict]) -> str:
    """The page with the rows of its table anew."""
    before, _, rest = text.partition(START)
    _, _, after = rest.partition(END)
    rows = "\n".join([START, "|---|---|---|", *map(row, scenes)])
    return before + rows + END + after


def main() -> int:
    from compare.commands.cases import scenes  # which looks for what is drawn here

    found = scenes()
    PICTURES.mkdir(parents=True, exist_ok=True)
    for one in found:
        write_atomically(picture(one["name"]), draw(case.load(ROOT / "cases" / one["name"])))
    write_atomically(PAGE, page(PAGE.read_text(), found))
    return 0


if __name__ == "__main__":
    sys.exit(exit_code(main))
