"""What a reader sees: the report in plain words, figures with their data and texts, and pages that
fit a phone and paper.
"""

import base64
import html
import io
import json
import re
import shutil
import subprocess
import warnings
from copy import deepcopy

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import Normalize

from cases import case
from cases.programs import ROOT
from compare import __main__ as cli
from compare.report.charts import maps, seen
from compare.report.page import Picture
from compare.study import page, quantities
from compare.study.charts import atlas as atlas_chart
from compare.study.charts import frontier as frontier_chart
from compare.study.charts import save
from compare.verdict import plain

CHROMIUM = shutil.which("chromium") or ""
BROWSER = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--virtual-time-budget=10000",
]
PAGES = 8  # of A4, what a reader takes along
PHONE = 390  # pixels


def cut(pattern: str, text: str) -> str:
    """What the first group of the pattern holds."""
    found = re.search(pattern, text, re.S)
    assert found, pattern
    return found[1]


def entry(gap, margin=0.1, scatter=None, numerics=None, verdict="unresolved", dem=1.0):
    """A run-out as metrics.json has it: the continuum's less the grains' is `gap`."""
    return {
        "mpm": dem + gap,
        "dem": dem,
        "difference": gap,
        "relative_difference": gap / dem,
        "margin": margin,
        "half_width": scatter,
        "numerical_uncertainty": numerics,
        "verdict": verdict,
        "decides": True,
        "unit": "L0",
    }


def said(lead: dict, found=(), **others) -> str:
    valid = all(one["severity"] != "invalid" for one in found)
    metrics = {"run_out_95": lead, "findings": {"list": list(found)}, "verdict": {"valid": valid}}
    return plain.paragraph(metrics | others)


FURTHER = entry(0.5, scatter=0.1, numerics=0.2, verdict="differ")


@pytest.mark.parametrize(
    "lead, words, never",
    [
        (
            FURTHER,
            ["continuum runs further", "by 0.5 L0 (50 %)", "to 1.5 L0", "to 1 L0", "more than pack"]
            + [
                "± 0.1 L0",
                "± 0.2 L0",
                "Both together do not make it",
                "The one figure that decides the verdict differs by more",
            ],
            ["less far", "could make it", "shows nothing", "not valid"],
        ),
        (
            entry(-0.5, scatter=0.1, numerics=0.2, verdict="differ"),
            ["continuum runs less far", "by 0.5 L0 (50 %)", "to 0.5 L0 in the continuum"],
            ["further", "could make it"],
        ),
        (
            entry(0.05, scatter=0.02, numerics=0.01, verdict="agree"),
            ["run equally far", "margin of 0.1 L0", "0.05 L0 (5 %) apart", "verdict agrees."],
            ["continuum runs", "could make it", "what is left is the model"],
        ),
        (
            entry(0.2, scatter=0.3, numerics=0.1),
            ["not decided", "no more than packings scatter", "but more than the continuum's num"]
            + ["The packings' scatter alone could make it", "nothing of the law"],
            ["continuum runs", "what is left is the model", "numerics alone"],
        ),
        (
            entry(0.2, scatter=0.1, numerics=0.3),
            ["not decided", "more than packings scatter", "The numerics alone could make it"],
            ["continuum runs", "scatter alone"],
        ),
        (
            entry(0.2, scatter=0.15, numerics=0.15),
            ["not decided", "The two together could make it"],
            ["continuum runs", " alone "],
        ),
        (
            entry(0.2, verdict="outside margin"),
            ["runs further", "How far packings scatter and what the continuum's numerics are off"]
            + ["are not known", "cannot be told whether the law"],
            ["could make it", "what is left is the model", "no more than"],
        ),
        (
            entry(0.2, numerics=0.1, verdict="outside margin"),
            ["runs further", "How far packings scatter is not known", "cannot be told"],
            ["what is left is the model"],
        ),
    ],
)
def test_the_first_paragraph_says_what_the_figures_show_and_no_more(lead, words, never):
    text = said(lead)
    assert all(one in text for one in words), text
    assert not any(one in text for one in never), text
    assert "No check calls the result invalid." in text


def test_the_first_paragraph_of_a_spoilt_result_says_that_first():
    spoilt = {"severity": "invalid", "name": "energy_lost"}
    text = said(FURTHER, [spoilt, {"severity": "caution", "name": "base_rolls"}])
    assert text.startswith("This result is not valid (checks: energy lost;")
    assert "what is left is the model" not in text and "No check calls" not in text
    assert "2 cautions, below" in said(FURTHER, [{"severity": "caution", "name": "a"}] * 2)


def test_unknown_run_outs_and_other_figures_are_told():
    unknown = FURTHER | {"mpm": None, "difference": None, "verdict": "unresolved"}
    assert said(unknown).startswith("How far either of the two runs is not known.")
    more = entry(0.0, verdict="agree")
    text = said(FURTHER, a=more, b=more, c=more | {"decides": False})
    assert "Of the 3 figures that decide the verdict, 2 agree and 1 differs" in text


def test_each_figure_outside_its_margin_is_told_with_by_how_much():
    away = {"value": 0.09, "unit": "L0", "margin": 0.03, "verdict": "outside margin"}
    told = plain.beyond({"run_out_95": FURTHER, "wasserstein_x": away, "mass": {"value": 1.0}})
    assert told == [
        "run-out by 95 % of the mass: continuum less grains +0.5 L0, 5 times the margin of 0.1 L0",
        "distance of the deposits along x: 0.09 L0, 3 times the margin of 0.03 L0",
    ]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages") / "column_ci"
    assert cli.main(["run", "column_ci", "--out", str(folder), "--quiet"]) == 0
    return folder


@pytest.fixture(scope="module")
def report(folder):
    return (folder / "report.html").read_text()


def test_the_report_starts_with_what_its_metrics_say(folder, report):
    metrics = json.loads((folder / "metrics.json").read_text())
    lead = html.unescape(cut(r'<p class="lead"[^>]*>(.*?)</p>', report))
    assert lead == plain.paragraph(metrics)
    assert report.index('class="lead"') < report.index('class="verdict')
    other = deepcopy(metrics)
    other["run_out_95"] |= {"difference": 2.0, "verdict": "differ", "half_width": 0.01}
    assert plain.paragraph(other) != lead and "runs further" in plain.paragraph(other)
    for one in plain.beyond(metrics):
        assert f"<li>{one}</li>" in html.unescape(report)


def figures(report: str) -> list[str]:
    return re.findall(r'<section class="figure".*?</section>', report, re.S)


def test_every_figure_has_its_data_and_a_text_with_its_numbers(report):
    found = figures(report)
    assert len(found) >= 8
    for figure in found:
        title = cut(r"<h2[^>]*>(.*?)</h2>", figure)
        link = cut(r'download="\w+\.csv" href="data:text/csv;base64,([^"]+)"', figure)
        table = pd.read_csv(io.BytesIO(base64.b64decode(link)))
        assert len(table) > 10 and {"panel", "series"} <= set(table), title
        assert table.drop(columns=["panel", "series"]).notna().any(axis=None)
        alts = set(re.findall(r'alt="([^"]*)"', figure))
        (alt,) = alts
        assert title not in alt and len(re.findall(r"\d+\.?\d*", alt)) >= 4, (title, alt)


def test_what_the_text_of_the_free_surface_says_is_in_its_data(report):
    figure = next(one for one in figures(report) if 'id="surface_profiles"' in one)
    alt = cut(r'alt="([^"]*)"', figure)
    told = [float(one) for one in re.findall(r"reaches to x = ([\d.]+) L0", alt)]
    link = cut(r"data:text/csv;base64,([^\"]+)", figure)
    table = pd.read_csv(io.BytesIO(base64.b64decode(link)))
    for side, far in zip(("MPM", "DEM"), told, strict=True):
        rows = table[table["series"].str.startswith(side)]
        last = rows["series"].iloc[-1]
        reach = rows[(rows["series"] == last) & (rows["y"] > 0.0)]["x"].max()
        assert reach == pytest.approx(far, abs=0.01), side


def test_definitions_are_folded_and_tables_have_heads(report):
    folded = cut(r'<details id="definitions">(.*?)</details>', report)
    assert "run_out_95" in folded and "<dd>" in folded
    assert report.count("<dd>") == folded.count("<dd>")
    assert report.count("<table") == report.count("<caption") >= 3
    assert all('scope="' in head for head in re.findall(r"<th\b[^>]*>", report))
    assert "<th" in report and not re.search(r"<th[^>]*></th>", report)
    for mark in ('<html lang="en">', 'class="skip" href="#main"', "<main", "<nav", "<header"):
        assert report.count(mark) == 1, mark


def browser(*words) -> subprocess.CompletedProcess:
    return subprocess.run(
        [CHROMIUM, *BROWSER, *map(str, words)], capture_output=True, text=True, timeout=180
    )


def width_on_a_phone(path, work) -> int:
    """How wide the page is in a window of PHONE pixels: more where something hangs over."""
    frame = work / "frame.html"
    frame.write_text(
        f'<body><iframe id="f" src="file://{path}" style="width:{PHONE}px;height:900px;border:0">'
        '</iframe><p id="o"></p><script>f.onload = () => {o.textContent = "width " + '
        "f.contentDocument.documentElement.scrollWidth}</script>"
    )
    dom = browser("--allow-file-access-from-files", "--dump-dom", f"file://{frame}").stdout
    return int(cut(r'<p id="o">width (\d+)</p>', dom))


def printed(path, work) -> int:
    """How many sheets a page takes."""
    pdf = work / "printed.pdf"
    browser(f"--print-to-pdf={pdf}", f"file://{path}")
    return len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes()))


needs_browser = pytest.mark.skipif(not CHROMIUM, reason="no chromium to look with")


@needs_browser
def test_the_report_prints_on_few_sheets(folder, tmp_path):
    assert 3 <= printed(folder / "report.html", tmp_path) <= PAGES
    long = tmp_path / "long.html"
    long.write_text("<p style='height:297mm'>" * 12)
    assert printed(long, tmp_path) > PAGES  # the count can say so


@needs_browser
def test_no_page_is_wider_than_a_phone(folder, tmp_path):
    assert width_on_a_phone(folder / "report.html", tmp_path) == PHONE
    study = study_page(tmp_path)
    assert width_on_a_phone(study, tmp_path) == PHONE
    wide = tmp_path / "wide.html"
    wide.write_text("<p style='width:600px'>wide</p>")
    assert width_on_a_phone(wide, tmp_path) > PHONE


def study_page(work):
    """A page of a study with a figure and a table with a long command."""
    figure, ax = plt.subplots()
    ax.plot([1.0, 2.0], [3.0, 5.0], label="one")
    ax.set_title("a panel")
    picture = save(figure, work / "one", {})
    assert isinstance(picture, Picture) and "one from 3 at 1 to 5 at 2" in picture.alt
    table = pd.DataFrame({"rung": ["a"], "cost": [1.5], "command": ["word=" * 80]})
    out = work / "study.html"
    page.write(out, "A <study>", {"commit": "abc"}, [("Figure", ["says"], picture)], {"All": table})
    return out


def test_a_page_of_a_study_tells_its_data_and_shows_whole_commands(tmp_path):
    text = study_page(tmp_path).read_text()
    assert "A &lt;study&gt;" in text and "word=" * 80 in text
    assert 'role="img"' in text and 'aria-label="a panel: one from 3 at 1 to 5 at 2."' in text
    link = cut(r'download="one.csv" href="data:text/csv;base64,([^"]+)"', text)
    assert base64.b64decode(link).decode().splitlines()[1] == "a panel,one,1,3"
    assert '<td class="long"><code>word=' in text  # such cells break in place of being cut


def test_the_table_of_a_figure_is_what_is_drawn():
    figure, (left, right) = plt.subplots(1, 2)
    left.plot([0.0, 1.0], [2.0, 4.0], label="_hidden, $x_{95}$")
    left.axhline(9.0)
    left.stackplot([0.0, 1.0, 2.0], [[1.0, 1.0, 1.0], [2.0, 3.0, 4.0]], labels=["low", "high"])
    mesh = np.ma.masked_less([[1.0, 2.0], [3.0, -1.0]], 0.0)
    right.pcolormesh([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], mesh)
    figure.colorbar(right.collections[0], ax=right)
    table = seen.table(figure)
    plt.close(figure)
    line = table[table["series"] == "hidden, x95"]
    assert line[["x", "y"]].to_numpy().tolist() == [[0.0, 2.0], [1.0, 4.0]]
    high = table[table["series"] == "high"]
    assert high["value"].tolist() == [2.0, 3.0, 4.0] and high["low"].tolist() == [1.0] * 3
    assert 9.0 not in table["y"].tolist()  # a mark across the panel is no number of a series
    assert sorted(table[table["series"] == "series 1"]["value"].dropna()) == [1.0, 2.0, 3.0]


def test_a_panel_without_colour_says_why():
    norm = Normalize(0.1, 1.0)
    assert maps.empty(np.ma.masked_invalid([np.nan, np.nan]), norm) == "no value anywhere"
    assert maps.empty(np.ma.array([0.0, 0.05]), norm) == "all below the scale: at rest"
    assert maps.empty(np.ma.array([0.0, 0.5]), norm) == ""
    assert maps.empty(np.ma.array([0.0, 0.05]), None) == ""


def test_what_rests_is_grey_not_the_darkest_colour(folder):
    """The last frame of the speeds: a colour map's own lower end would make a black panel."""
    image = plt.imread(folder / "figures" / "map_speed.png")[..., :3]
    grey = np.array([int(maps.STILL[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    rest = (abs(image - grey).max(axis=-1) < 0.02).sum()
    dark = (abs(image - plt.get_cmap("cividis")(0.0)[:3]).max(axis=-1) < 0.02).sum()
    assert rest > 10 * dark


def test_no_two_series_of_the_frontiers_share_a_marker():
    for name in ("column", "column_small"):
        points = pd.read_csv(ROOT / f"cases/{name}/reference/frontier/points.csv", comment="#")
        found = frontier_chart.markers(points)
        assert len(set(found.values())) == len(found) == points["series"].nunique() > 10


def test_an_error_of_none_stands_on_the_lower_edge(tmp_path):
    """Which a logarithm does not have; the words keep it."""
    folder = ROOT / "cases/column_small/reference"
    points = pd.read_csv(folder / "frontier/points.csv", comment="#")
    grains = json.loads((folder / "grains.json").read_text())
    cheapest = points.loc[(points["status"] == "ok") & ~points["fine"], "cost"].idxmin()
    points.loc[cheapest, "error_run_out"] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn = frontier_chart.draw(points, grains, "run_out", tmp_path / "chart")
    assert f"{points.loc[cheapest, 'label']} 0.0% off" in drawn.alt
    assert frontier_chart.lower_edge(pd.Series([0.0, 0.02, np.nan]), 0.1) == pytest.approx(0.014)


def test_axes_are_named_by_quantities_with_units():
    named = quantities.label("mpm.cell_size").replace("\n", " ")
    assert named == "side h of the square cells of the background grid [m]"
    assert quantities.label("impact speed [m/s]") == "impact speed [m/s]"
    for plane in case.load(ROOT / "cases/column_ci/study.toml", kind="study")["atlas"]["plane"]:
        assert plane["along"] not in quantities.label(plane["along"])


@pytest.mark.parametrize("low, high, least", [(0.8, 5.0, 4), (0.05, 5.0, 6)])
def test_logarithmic_axes_have_several_plain_marks(low, high, least):
    figure, ax = plt.subplots()
    ax.semilogx([low, high], [0.0, 1.0])
    atlas_chart.ticks(ax.xaxis, low, high)
    figure.canvas.draw()
    shown = [
        text.get_text()
        for text, place in zip(ax.get_xticklabels(), ax.get_xticks())
        if low <= place <= high and text.get_text()
    ]
    plt.close(figure)
    assert len(shown) >= least and all(re.fullmatch(r"[\d.]+", text) for text in shown)
