"""Every kind of page that grainpair writes, made of inputs that never vary: formulas, the tables
in cases/*/reference, and a few pages of a site in tests/data/faces/site.

No engine runs. `PAGES` holds for each page's name what writes it into a folder and returns its
path.
"""

import shutil
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from grains_file import SCENE, column, write_grains
from played import page_of
from synthetic import Motion, block, write_pair, write_run

from cases import case, openpmd
from cases.programs import ROOT
from compare.commands import frontier as frontier_command
from compare.judge import laws as judged_laws
from compare.judge import page as judge_page
from compare.judge import trial as judged
from compare.judge.flow import FRACTIONS, Cells
from compare.maps import page as map_page
from compare.maps import source
from compare.pages import site
from compare.report import collapse, player, report
from compare.study import atlas, frontier, page, recipe, redraw
from compare.study.charts import atlas as atlas_chart
from compare.study.charts import convergence as convergence_chart
from compare.study.charts import ladder as ladder_chart
from compare.verdict import comparison, equivalence

DATA = ROOT / "tests" / "data" / "faces"
ORIGIN = {
    "command": "./grainpair study column_small",
    "commit": "0123456789ab",
    "date": "2026-01-01",
    "machine": "x86_64, formula",
}
SMALL = {"height": 0.02, "length": 0.02, "frames": 6}
# Enough to see how a page is laid out, in few seconds.
ROWS, PLANES = 8, 6  # of a long table; of the atlas
SHOWN = {
    report: ("surface_profiles", "map_speed", "energy_budget"),
    collapse: ("deviatoric_strain", "internal_energies", "budget", "deposit"),
}


def a_report(folder: Path) -> Path:
    """Of a block that spreads, twice as far as one and 2.1 times as far as the other."""
    write_pair(folder, mpm=SMALL, dem=SMALL | {"stretch": 2.1})
    with few_charts(report):
        report.compare(folder)
    return folder / "report.html"


@contextmanager
def few_charts(module):
    """Lets a module that draws all charts draw those of SHOWN."""
    every = module.all_charts

    def few(*words):
        return [chart for chart in every(*words) if chart.name in SHOWN[module]]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "all_charts", few)
        yield


def a_player(folder: Path) -> Path:
    """Of the same pair, if the report has been made beside it; else of one that is made now."""
    pair = folder.with_name("report")
    if not (pair / "fields.h5").exists():
        a_report(pair)
    return page_of(player.build(comparison.load(pair)), folder / "player.html")


def a_collapse(folder: Path) -> Path:
    """Of a block of points whose state is told by formulas: what lies deep rests, what lies high
    flows, what is far out is thrown.
    """
    path = write_run(folder / "mpm.h5", "mpm", **SMALL, jitter=False, spacing=0.002)
    motion = Motion(block(0.02, 0.02, 0.008, 0.002), 2.0, 5.0, np.sqrt(0.02 / 9.81))
    with h5py.File(path, "a") as file:
        for k, frame in enumerate(file["data"].values()):
            x = motion.x0
            tau = k * 5.0 / (SMALL["frames"] - 1)
            moved = (motion.stretch_at(tau) - 1.0) * (x[:, 0] + x[:, 1]) / 0.04
            regime = np.select([moved < 0.05, moved < 0.3, moved < 0.7], [1, 2, 3], 4)
            cloud = frame["particles/cloud"]
            openpmd.record(cloud, "regime", regime, "-", np.uint8, "1 to 4")
            openpmd.record(cloud, "deviatoric_strain", 2.0 * moved, "-", np.float64)
            for name, share in (("plastic", 0.3), ("regime_4", 0.2), ("contact", 0.0)):
                values = share * moved * 9.81 * 0.02
                openpmd.record(cloud, f"{name}_dissipation", values, "J/kg", np.float64)
    with few_charts(collapse):
        collapse.make(path, folder)
    return folder / "collapse.html"


def a_frontier(folder: Path) -> Path:
    points, grains = frontier.committed("column_small")
    points["message"] = points["message"].fillna("")
    figures = frontier_command.figures_of("deposit", points, grains, True, folder)
    table = points[list(frontier_command.COLUMNS)].sort_values("cost").head(ROWS)
    return study(folder, "frontier", "Speed against accuracy", figures, {"Every point": table})


def a_ladder(folder: Path) -> Path:
    table = pd.read_csv(ROOT / "cases/column_tall/reference/ladder/ladder.csv", comment="#")
    table["message"] = table["message"].fillna("")
    tried = [
        {
            "rung": row["rung"],
            "recipe": recipe.Recipe("mpm" if "mpm_run" in row["command"] else "dem", ()),
            "word": row["verdict"],
            "verdict": None
            if np.isnan(row["error"])
            else equivalence.Verdict(row["verdict"], row["error"], row["half_width"], 0.05),
        }
        for _, row in table.iterrows()
    ]
    stop = int(np.flatnonzero(table["enough"])[0]) if table["enough"].any() else None
    drawn = ladder_chart.draw(tried, stop, "deposit", 0.05, folder / "ladder")
    words = ["The first rung that agrees is enough where the one above it agrees as well."]
    figures: list[page.Figure] = [("Rungs tried", words, drawn)]
    return study(folder, "ladder", "The least model that does", figures, {"Rungs": table})


def an_atlas(folder: Path) -> Path:
    kept = ROOT / "cases/column_ci/reference/atlas"
    scene = case.load(ROOT / "cases/column_ci")
    planes = recipe.study(scene, "atlas")["plane"][:PLANES]
    tables = {name: pd.read_csv(kept / f"{name}.csv", comment="#") for name in
              ("boundaries", "failures", "trends")}  # fmt: skip
    told = tables["boundaries"]
    rows = [list(redraw.rows_of(told[told["plane"] == plane["name"]])) for plane in planes]
    words = [
        f"{plane['name']}: {'; '.join(atlas.sentences(plane, found, scene))}"
        for plane, found in zip(planes, rows)
    ]
    drawn = atlas_chart.draw(planes, rows, scene, folder / "atlas")
    trend = atlas_chart.draw_trends(tables["trends"], folder / "damping")
    shown = {"Every run of the planes": told, "Failures known by name": tables["failures"]}
    figures = [("Planes", words, drawn), ("Damping as the step shrinks", [], trend)]
    few = {name: table.head(ROWS) for name, table in shown.items()}
    return study(folder, "atlas", "Stability", figures, few)


def a_convergence(folder: Path) -> Path:
    table = pd.read_csv(ROOT / "cases/column/reference/convergence.csv", comment="#")
    drawn = convergence_chart.draw(table, folder / "convergence")
    judged = table[table["verdict"].notna()].drop(columns=["settings", "runs"])
    return study(
        folder, "convergence", "Do the numerics decide the result?",
        [("Changes of the numerics", [drawn.alt], drawn)],
        {"Figures with a limit": judged.head(ROWS), "Every figure": table.head(ROWS)},
    )  # fmt: skip


def a_trial(folder: Path) -> Path:
    """Two laws in a wedge that flows by formulas, and the outcome that is kept."""
    scene = case.load(ROOT / "cases/column_ci")
    runs = [[wedge(seed, width) for width in (0.75, 1.5)] for seed in (1, 2)]
    candidates = [
        judged_laws.Candidate("mu_i", "mu_i", "dem_mu05"),
        judged_laws.Candidate("drucker_prager", "drucker_prager", "dem_mu05"),
    ]
    trial = judged.Trial(scene, "dem", [Path("1.h5"), Path("2.h5")], runs)
    trial.laws = [
        judged_laws.Answers(scene, one, [cells for run in runs for cells in run])
        for one in candidates
    ]
    trial.refused.append("width 0.25 d: cos(s, D) = 0.31 in what flows, below 0.67")
    trial.table = pd.DataFrame(
        [row for answers in trial.laws for row in judged.bias.rows(answers, runs)]
    )
    outcome = pd.read_csv(ROOT / "cases/column_small/reference/judge/outcome.csv", comment="#")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge_page.provenance, "about", lambda command: dict(ORIGIN))
        judge_page.write(trial, judged.controls(trial), outcome, folder, "./grainpair judge")
    return folder / "judge.html"


def wedge(seed: int, width: float) -> Cells:
    """Cells below a slope at eight instants, sheared more the higher they lie; the friction grows
    with the inertial number, with some noise of `seed`.
    """
    random, h = np.random.default_rng(seed), 0.002
    x, y, tau = (one.ravel() for one in np.meshgrid(
        h * (np.arange(20) + 0.5), h * (np.arange(10) + 0.5), np.linspace(0.4, 2.5, 8),
        indexing="ij",
    ))  # fmt: skip
    depth = 0.02 - 0.5 * x - y
    x, y, tau, depth = (one[depth > h] for one in (x, y, tau, depth))
    pressure = 1500.0 * 9.81 * depth
    rate = 60.0 * (y + h) / 0.02 / tau * random.uniform(0.9, 1.1, len(x))
    number = rate * 0.002 * np.sqrt(2500.0 / pressure)
    fraction = 0.6 - 0.1 * np.minimum(number, 1.0)
    friction = (0.35 + 0.3 * number / (number + 0.3)) * random.uniform(0.95, 1.05, len(x))
    temperature = 0.1 * (rate * 0.002) ** 2
    power = 0.9 * friction * pressure * rate
    zone = np.select([rate < 4.0, rate < 20.0, *(fraction > one for one in FRACTIONS)], range(5), 5)
    return Cells(
        width, tau, x, y, zone, fraction, pressure, rate, friction, 1.05 * friction, number,
        temperature, power, np.full(len(x), h**2),
    )  # fmt: skip


def a_map(folder: Path) -> Path:
    grains = write_grains(folder / "heap.h5", [column(n=(6, 14, 6), force=1e-4)], **SCENE)
    request = map_page.Request(2, "y", 0.75, None, None, "mirror", False, [], quiet=True)
    with pytest.MonkeyPatch.context() as patch:
        told = ORIGIN | {"files": "heap.h5"}
        patch.setattr(map_page.provenance, "about", lambda command, **more: dict(told))
        map_page.make([source.read(grains)], request, folder, "map", lambda share, text: None)
    return folder / "map.html"


def study(folder: Path, name: str, title: str, figures: list, tables: dict) -> Path:
    page.write(folder / f"{name}.html", title, ORIGIN, figures, tables)
    return folder / f"{name}.html"


def built(folder: Path) -> Path:
    """The site of tests/data/faces/site, made once beside the pages."""
    out = folder.with_name("site")
    if not out.exists():
        clone = folder.with_name("clone")
        shutil.copytree(DATA / "site", clone)
        for text in list(clone.rglob("*.txt")):  # no pages of ours, whose links tests follow
            text.rename(text.with_suffix(".md"))
        (clone / "docs" / "pictures").mkdir()
        picture(clone / "docs" / "pictures" / "surface.png")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(site, "ROOT", clone)
            patch.setattr(site.reference, "PAGES", {})
            site.build(out)
    return out / "docs"


def picture(path: Path):
    figure, ax = plt.subplots(figsize=(6.0, 2.4))
    ax.plot([0.0, 1.0, 1.0], [1.0, 1.0, 0.0], label="start")
    ax.fill([0.0, 0.0, 2.5], [0.0, 0.6, 0.0], alpha=0.5, label="end")
    ax.legend()
    figure.savefig(path, dpi=100)
    plt.close(figure)


STUDIES: dict[str, Callable[[Path], Path]] = {
    "frontier": a_frontier,
    "ladder": a_ladder,
    "atlas": an_atlas,
    "convergence": a_convergence,
    "collapse": a_collapse,
    "judge": a_trial,
    "map": a_map,
}
SITE: dict[str, Callable[[Path], Path]] = {
    "docs": lambda folder: built(folder) / "index.html",
    "docs_theory": lambda folder: built(folder) / "theory" / "index.html",
    "docs_tutorial": lambda folder: built(folder) / "tutorials" / "pair.html",
}
PAGES = {"report": a_report, "player": a_player, **STUDIES, **SITE}


def make(name: str, folder: Path) -> Path:
    """Writes a page into a folder of its name below `folder`."""
    place = folder / name
    place.mkdir(exist_ok=True)
    return PAGES[name](place)
