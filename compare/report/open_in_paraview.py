"""Opens what ./grainpair export wrote beside this file: grains and continuum one above the other,
coloured alike, contacts as tubes as thick as their force.

    paraview --script=open_in_paraview.py      or, in ParaView, Macros > Import new macro
    pvbatch open_in_paraview.py picture.png [time in s] [what to colour by]
"""

import sys
from pathlib import Path

from paraview import simple as pv

COLOUR_BY = "velocity"  # its magnitude; or mapped_void_ratio, mapped_granular_temperature
# What export has seen: its folder, the sides, the ranges over all frames of both, the corners.
SCENE: dict = {}
LABELS = {
    "velocity": "speed [m/s]",
    "mapped_void_ratio": "void ratio",
    "mapped_granular_temperature": "T [m²/s²]",
}


def folder() -> Path:
    """This file's, where it knows its place (a macro does not), else that of the export."""
    place = Path(globals().get("__file__", "")).resolve().parent
    return place if (place / SCENE["sides"][0]["particles"]).exists() else Path(SCENE["folder"])


def show_particles(side: dict, view, colour: str):
    source = pv.PVDReader(registrationName=side["name"], FileName=str(folder() / side["particles"]))
    source.UpdatePipeline()
    shown = pv.Show(source, view)
    shown.SetRepresentationType("Point Gaussian")
    shown.ShaderPreset = "Plain circle" if side["radius"] else "Sphere"
    if side["radius"]:
        shown.GaussianRadius = side["radius"]
    else:  # of each grain its own
        shown.ScaleByArray = 1
        shown.SetScaleArray = ["POINTS", "radius"]
        shown.UseScaleFunction = 0
        shown.GaussianRadius = 1.0
    if colour in side["colours"]:
        vector = ("Magnitude",) if colour == "velocity" else ()
        pv.ColorBy(shown, ("POINTS", colour, *vector))
        low, high = SCENE["ranges"][colour]
        table = pv.GetColorTransferFunction(colour)
        table.AutomaticRescaleRangeMode = "Never"
        table.RescaleTransferFunction(low, high)
        table.NanColor = [0.7, 0.7, 0.7]
        shown.SetScalarBarVisibility(view, True)
        bar = pv.GetScalarBar(table, view)
        bar.Title, bar.ComponentTitle = LABELS[colour], ""
        bar.TitleFontSize, bar.LabelFontSize, bar.ScalarBarLength = 14, 12, 0.5
        bar.TitleColor = bar.LabelColor = [0.0, 0.0, 0.0]
    return shown


def show_contacts(side: dict, view):
    """Tubes whose radius is in proportion to the force; the strongest has a third of a grain's."""
    source = pv.PVDReader(
        registrationName=f"{side['name']} contacts", FileName=str(folder() / side["contacts"])
    )
    source.UpdatePipeline()
    ends = pv.CellDatatoPointData(registrationName=f"{side['name']} forces", Input=source)
    wires = pv.ExtractSurface(registrationName=f"{side['name']} lines", Input=ends)
    thick = pv.Calculator(registrationName=f"{side['name']} thickness", Input=wires)
    thick.ResultArrayName = "tube_radius"
    thick.Function = f"force_magnitude*{float(side['grain'] / 3.0 / side['force'])!r}"
    tubes = pv.Tube(registrationName=f"{side['name']} tubes", Input=thick)
    tubes.Scalars = ["POINTS", "tube_radius"]
    tubes.VaryRadius = "By Absolute Scalar"
    shown = pv.Show(tubes, view)
    shown.ColorArrayName = ["POINTS", ""]
    shown.DiffuseColor = shown.AmbientColor = [0.75, 0.1, 0.1]


def look_at(view, corners: list, wide: float):
    """From the front, all that is ever between two corners, on a picture `wide` times as wide as
    high.
    """
    lower, upper = corners
    view.InteractionMode = "2D"
    view.CameraParallelProjection = 1
    middle = [0.5 * (a + b) for a, b in zip(lower, upper)]
    size = max(upper[1] - lower[1], (upper[0] - lower[0]) / wide)
    view.CameraFocalPoint = middle
    view.CameraPosition = [middle[0], middle[1], upper[2] + 10.0 * size]
    view.CameraViewUp = [0.0, 1.0, 0.0]
    view.CameraParallelScale = 0.6 * size


def main(words: list):
    picture = next((word for word in words if word.endswith(".png")), None)
    rest = [word for word in words if word != picture] if picture else []
    colour = rest[1] if len(rest) > 1 else COLOUR_BY
    sides = SCENE["sides"]
    pv._DisableFirstRenderCameraReset()
    layout = pv.CreateLayout(name="grainpair")
    views = [pv.CreateView("RenderView") for _ in sides]
    cells = [0]
    if len(sides) == 2:
        first = layout.SplitVertical(0, 0.5)
        cells = [first, first + 1]
    for view, cell, side in zip(views, cells, sides):
        layout.AssignView(cell, view)
        view.UseColorPaletteForBackground = 0
        view.Background = [1.0, 1.0, 1.0]
        view.OrientationAxesVisibility = 0
        particles = show_particles(side, view, colour)
        if side["contacts"] and side["force"] > 0.0:
            particles.Opacity = 0.4
            show_contacts(side, view)
        title = pv.Text(registrationName=f"{side['name']} title", Text=side["name"])
        label = pv.Show(title, view)
        label.Color, label.FontSize = [0.0, 0.0, 0.0], 14
        label.WindowLocation = "Upper Left Corner"
        look_at(view, SCENE["corners"], 2.0 * len(sides))
    if len(views) == 2:
        pv.AddCameraLink(views[0], views[1], "both sides")
    times = pv.GetAnimationScene()
    times.UpdateAnimationUsingDataTimeSteps()
    if rest:
        times.AnimationTime = float(rest[0])
    if picture:
        layout.SetSize(1600, 800)
    pv.RenderAllViews()
    if picture:
        pv.SaveScreenshot(picture, layout)


main(sys.argv[1:])
