"""Maps of files alone: fields.h5, profiles.csv, figures and map.html."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from cases import provenance
from cases.files import write_table
from cases.programs import program
from cases.reading import attributes, opened
from cases.stages import Stage, run_stages
from compare.maps import charts, profiles
from compare.maps.source import Source
from compare.study import page

SHOWN = 4  # frames in the figures, at most
FINE = 1.0 / 16.0  # spacing over width, for difference quotients: their error is (h/w)^2/6, 0.07 %
UNITS = (
    "places and box [m], velocity [m/s], density [kg/m3], granular temperatures [m2/s2], stresses "
    "[Pa], compression positive, shear rate [1/s]; mass above zero only"
)


@dataclass(frozen=True)
class Request:
    """What is asked for. `words` of grain_map that hold for every mapping, `kernel` those of width,
    spacing, kernel and walls besides; `frames` to map, all where empty.
    """

    dimension: int
    along: str
    width: float  # [d]
    spacing: float | None  # [d]
    kernel: str | None
    walls: str
    average: bool
    frames: list[int]
    words: list[str] = field(default_factory=list)
    width_study: bool = False
    quiet: bool = False

    def mapping(self) -> list[str]:
        """Words of grain_map for frames, average, ranges and walls."""
        words = [*self.words, "--walls", self.walls, *(["--average"] if self.average else [])]
        return [*words, *frame_words(self.frames)]


def frame_words(frames: list[int]) -> list[str]:
    return [word for k in frames for word in ("--frame", str(k))]


def make(sources: list[Source], request: Request, folder: Path, command: str, say) -> list[str]:
    """Makes everything in `folder`; returns lines for the terminal."""
    width = ["--width", str(request.width)]
    kernel = ["--kernel", request.kernel] if request.kernel else []
    spacing = ["--spacing", str(request.spacing)] if request.spacing else []
    fields = folder / "fields.h5"
    chosen = [*request.mapping(), *width, *kernel]
    files = [source.path for source in sources]
    shape = ["--dimension", str(request.dimension)]
    if request.dimension == 1:
        shape += ["--along", request.along]
    mapping = [program("grain_map"), *files, "-o", fields, *shape, *chosen, *spacing, "--progress"]
    run_stages([Stage("fields", mapping)], quiet=request.quiet)
    say(0.3, "mapping profiles")
    scratch = folder / "profile.h5"
    along = request.along
    fine = spacing if request.dimension == 1 and spacing else ["--spacing", str(request.width / 4)]
    found = profiles.mapped(sources, scratch, along, *chosen, *fine)
    scratch.unlink()
    labels = {source.name: labels_of(source, fields, request) for source in sources}
    about = provenance.about(command, files=", ".join(str(source.path) for source in sources))
    table = profiles.table(found, labels, along)
    write_table(folder / "profiles.csv", provenance.head(about, UNITS), table, "%.6g")
    figures, lines = [], []
    (folder / "figures").mkdir()
    for number, source in enumerate(sources):
        say(0.5 + 0.4 * number / len(sources), f"figures of {source.name}")
        made, said = show(source, request, fields, found[source.name], labels[source.name], folder)
        figures += made
        lines += said
    tables = {"What the files do not tell": lacking(sources, fields)}
    notes = noted(sources, fields)
    if len(notes):
        tables["Notes"] = notes
    names = ", ".join(source.name for source in sources)
    page.write(folder / "map.html", f"Mapped fields: {names}", about, figures, tables)
    say(1.0, "page written")
    return lines


def labels_of(source: Source, fields: Path, request: Request) -> list[str]:
    """Of the mapped frames."""
    with opened(fields) as f:
        attributes = f[source.name].attrs
        if request.average:
            count = int(attributes["averaged_frames"])
            start, end = attributes["averaged_from"], attributes["averaged_to"]
            told = "" if np.isnan(start) else f", {start:.4g} to {end:.4g} s"
            return [f"mean of {count} frames{told}"]
    return [source.label(k) for k in request.frames or range(len(source.time))]


def few(count: int) -> list[int]:
    """At most SHOWN of `count` frames, the first and the last among them."""
    return sorted({int(round(k)) for k in np.linspace(0, count - 1, min(count, SHOWN))})


def show(source, request: Request, fields: Path, found, labels, folder: Path):
    """The figures of one source, and a line on its balance for the terminal."""
    shown, along = few(len(found)), request.along
    figures, lines = [], []
    place = folder / "figures"
    if request.dimension > 1:
        figures.append(
            charts.fields(source, fields, shown, labels, place / f"fields_{source.name}")
        )
    figures.append(
        charts.profiles(source, found, shown, labels, along, place / f"profiles_{source.name}")
    )
    balances = balanced(source, request, [labels[k] for k in shown], shown, folder)
    if balances:
        where = place / f"balance_{source.name}"
        drawn = [one for _, one in balances]
        names = [label for label, _ in balances]
        figures.append(charts.momentum(source, drawn, names, along, where))
        lines += [f"{source.name}: {charts.says(one, label, along)}" for label, one in balances]
    else:
        why = "no stress or no gravity in the file"
        figures.append((f"Momentum balance: {source.name}", [f"Not checked: {why}."], None))
    if request.width_study:
        last = [] if request.average else frame_words([frames_of(source, request)[shown[-1]]])
        words = [*request.words, "--walls", request.walls, *last]
        words += ["--average"] if request.average else []
        words += ["--kernel", request.kernel] if request.kernel else []
        words += ["--spacing", "0.25"]
        study = profiles.width_study(source, folder, along, request.width, words)
        if study is not None:
            figures.append(charts.widths(study, request.width, place / f"widths_{source.name}"))
        else:
            said = "No width study: the grains leave no core three diameters inside."
            figures.append((f"Width of the kernel: {source.name}", [said], None))
    return figures, lines


def frames_of(source: Source, request: Request) -> list[int]:
    return request.frames or list(range(len(source.time)))


def balanced(source, request: Request, labels, shown, folder: Path):
    """(label, Balance) of the shown frames: at a fine spacing and open at walls, where the balance
    is exact.
    """
    if not np.isfinite(source.gravity).all():
        return []
    frames = [] if request.average else [frames_of(source, request)[k] for k in shown]
    words = [*request.words, "--walls", "open", "--kernel", "lucy", *frame_words(frames)]
    words += ["--average"] if request.average else []
    words += ["--width", str(request.width), "--spacing", str(FINE * request.width)]
    scratch = folder / "balance.h5"
    found = profiles.mapped([source], scratch, request.along, *words)[source.name]
    scratch.unlink()
    balances = [profiles.balance(one, source.gravity, request.along) for one in found]
    return [(label, one) for label, one in zip(labels, balances) if one is not None]


def lacking(sources: list[Source], fields: Path) -> pd.DataFrame:
    """What is missing, and why; also where too few grains leave a temperature undefined."""
    rows = [(source.name, what, why) for source in sources for what, why in source.missing]
    with opened(fields) as f:
        for source in sources:
            group = f[source.name]
            density = group["density"][-1]
            held = density > 0.05 * density.max()
            lost = held & ~np.isfinite(group["granular_temperature"][-1])
            if lost.any():
                share = f"{100 * lost.sum() / held.sum():.0f} % of the cells of the last frame"
                why = "fewer independent grains under the kernel than the fit has constants"
                rows.append((source.name, f"granular temperature in {share}", why))
    return pd.DataFrame(rows, columns=["file", "not told", "why"])


def noted(sources: list[Source], fields: Path) -> pd.DataFrame:
    rows = [(source.name, note) for source in sources for note in source.notes]
    with opened(fields) as f:
        told = attributes(f)["notes"]
        if told != "none":
            rows += [("the grid", note) for note in told.split("; ") if note]
    return pd.DataFrame(rows, columns=["of", "note"])
