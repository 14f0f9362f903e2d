"""The comparison of a chute: profiles of both sides, figures, what is published, and a page."""

import json
from pathlib import Path

import pandas as pd

from cases import provenance
from cases.errors import CaseError
from cases.files import write_atomically, write_table
from compare.chute import charts, published, sides
from compare.chute.sides import Side
from compare.chute.words import STATE as OF_ALL, WORDS
from compare.study import page

CLOSED = 0.01  # of a balance of momentum, over the stress at the base
# Of these a difference between two sides means something.
STATE = (*OF_ALL, "depth")
ENDS = {"maximum": "at time.maximum", "rest": "at rest"}


def compare(folder: Path, mpm: list[Path], dem: list[Path], words=(), tell=None) -> dict:
    """Writes profiles.csv, metrics.json, figures/ and report.html into `folder`; returns the
    metrics. Raises CaseError where the runs are not of one chute.
    """
    tell = tell or (lambda fraction, text: None)
    found = []
    for number, path in enumerate([*mpm, *dem]):
        tell(0.7 * number / len([*mpm, *dem]), f"profiles of {path.name}")
        found.append(sides.of(path, tuple(words)))
    refuse_unlike(found)
    continuum, grains = found[: len(mpm)], found[len(mpm) :]
    metrics = metrics_of(continuum, grains)
    write_atomically(folder / "metrics.json", json.dumps(metrics, indent=1) + "\n")
    origin = provenance.about("; ".join(made_by(side) for side in found))
    write_table(
        folder / "profiles.csv",
        provenance.head(origin, "SI units; y from the top of the base, averaged over time"),
        table(found),
        "%.6g",
    )
    (folder / "figures").mkdir(exist_ok=True)
    tell(0.8, "figures")
    picture = charts.draw(found, folder / "figures" / "profiles")
    start = charts.start(found, folder / "figures" / "start")
    page.write(
        folder / "report.html",
        found[0].run.case["title"],
        origin,
        [
            ("Profiles over the depth", sentences(metrics), picture),
            ("From rest to where it comes", states(found), start),
        ],
        {"Figures": figures_table(metrics), "What is published": facts_table(metrics)},
    )
    tell(1.0, "report written")
    return metrics


def made_by(side: Side) -> str:
    """The command that made a side, as a user of any folder could give it: the program and the
    result by their names alone.
    """
    words = str(side.run.attributes.get("command", "")).split()
    if not words:
        return side.path.name
    if "-o" in words[:-1]:
        place = words.index("-o") + 1
        words[place] = Path(words[place]).name
    return " ".join([Path(words[0]).name, *words[1:]])


def refuse_unlike(found: list[Side]):
    first = found[0].run
    for side in found[1:]:
        for key in ("inclination", "height", "length", "gravity"):
            here, there = side.run.case["geometry"][key], first.case["geometry"][key]
            if abs(here - there) > 1e-12 * abs(there):
                raise CaseError(
                    f"{side.path}: geometry.{key} = {here} but {there} in {found[0].path} (not "
                    "runs of one scene)"
                )


def metrics_of(continuum: list[Side], grains: list[Side]) -> dict:
    """metrics.json of a chute: each figure of both sides, of the grains the mean over packings,
    what is published, and the verdict.
    """
    (mpm, *_), (dem, *_) = continuum, grains
    out: dict = {"scene": "chute"}
    for name, (doc, unit) in WORDS.items():
        several = [side.flow.figures[name] for side in grains]
        a, b = mpm.flow.figures[name], sum(several) / len(several)  # NaN: unknown
        known = number(a) is not None and number(b) is not None and b != 0.0
        out[name] = {
            "mpm": number(a),
            "dem": number(b),
            "relative_difference": a / b - 1.0 if known and name in STATE else None,
            "unit": unit,
            "doc": doc,
        }
        if len(grains) > 1 and number(b) is not None:
            out[name]["dem_std"] = float(pd.Series(several).std())
    inclination = dem.run.case["geometry"]["inclination"]
    inertial = dem.flow.figures["inertial_number"]
    out["published"] = [
        {"figure": one.figure, "value": number(one.value), "name": one.name, "source": one.source}
        for one in published.at(inclination, inertial if number(inertial) is not None else 0.0)
    ]
    out["states"] = {"mpm": mpm.flow.state, "dem": dem.flow.state}
    told = findings([*continuum, *grains])
    out["findings"] = {"list": told}
    valid = all(one["severity"] != "invalid" for one in told)
    out["verdict"] = {"value": verdict(mpm, dem), "valid": valid, "scatter": scatter(grains)}
    return out


def verdict(mpm: Side, dem: Side) -> str:
    """What both sides come to, and how fast the continuum flows beside the grains."""
    if mpm.flow.state != dem.flow.state:
        return f"differ: the continuum {said(mpm.flow.state)}, the grains {said(dem.flow.state)}"
    both = f"both {said(mpm.flow.state, many=True)}"
    slow, fast = mpm.flow.figures["mean_velocity"], dem.flow.figures["mean_velocity"]
    if mpm.flow.state == "stopped" or not fast > 0.0:
        return both
    return f"{both}, the continuum at {slow / fast:.2f} of the grains' mean velocity"


def said(state: str, many: bool = False) -> str:
    words = {"steady": ("is steady", "are steady"), "stopped": ("stands", "stand")}
    words |= {"speeds up": ("speeds up", "speed up"), "slows down": ("slows down", "slow down")}
    words |= {"crowded": ("is crowded", "are crowded")}
    return words[state][many]


def scatter(grains: list[Side]) -> str:
    return f"{len(grains)} packings" if len(grains) > 1 else "one packing"


def findings(found: list[Side]) -> list[dict]:
    """What a reader must know before he believes a figure."""
    out = []
    for side in found:
        flow = side.flow
        if flow.state == "crowded":
            out.append(
                {
                    "severity": "invalid",
                    "sentence": f"{flow.name}: the points hold {flow.figures['crowding']:+.0%} "
                    "more solid than their own void ratios tell: they have left their "
                    "rows, and what they carry is no state of the law.",
                    "advice": "Set mpm.volume_relaxation to 1, and volumes follow the room; with "
                    "mpm.transfer apic and mpm.precision double, rows stay in order for longer.",
                }
            )
        if flow.state in ("speeds up", "slows down"):
            out.append(
                {
                    "severity": "warning",
                    "sentence": f"{flow.name}: not steady: it {flow.state} by "
                    f"{100 * abs(flow.figures['change']):.2g} % over the time averaged, so its "
                    "figures are those of no steady flow.",
                    "advice": "Set a longer time.maximum; a law without a steady state never "
                    "comes to one.",
                }
            )
        for name, what in (("normal_balance", "weight"), ("shear_balance", "pull")):
            off = flow.figures[name]
            if flow.state == "steady" and number(off) is not None and off > CLOSED:
                out.append(
                    {
                        "severity": "note",
                        "sentence": f"{flow.name}: the {name.split('_')[0]} stress differs from "
                        f"the {what} of what lies above by up to {100 * off:.2g} % of that at the "
                        "base.",
                        "advice": "More frames average it out.",
                    }
                )
    return out


def number(x: float) -> float | None:
    """JSON has no NaN."""
    return float(x) if x == x and abs(x) != float("inf") else None


def table(found: list[Side]) -> pd.DataFrame:
    """A row for each place of each side."""
    parts = []
    for side in found:
        part = pd.DataFrame(side.flow.columns).rename(columns={"place": "y"})
        part.insert(0, "source", side.flow.name)
        parts.append(part[part["solid_fraction"] > 0.0])
    return pd.concat(parts, ignore_index=True)


def sentences(metrics: dict) -> list[str]:
    out = [f"Verdict: {metrics['verdict']['value']}."]
    for name, (doc, unit) in WORDS.items():
        mpm, dem = metrics[name]["mpm"], metrics[name]["dem"]
        told = " and ".join(
            f"{'unknown' if x is None else format(x, '.4g')} of {who}"
            for x, who in ((mpm, "the continuum"), (dem, "the grains"))
        )
        out.append(f"{doc[0].upper() + doc[1:]}{'' if unit == '-' else f' [{unit}]'}: {told}.")
    out.append(
        "In the last panel: how far the stress at each height is from what it carries, over that "
        f"at the base; grey is {100 * CLOSED:g} %."
    )
    return [*out, *(one["sentence"] for one in metrics["findings"]["list"])]


def states(found: list[Side]) -> list[str]:
    return [
        f"{charts.WORDS[side.run.engine].capitalize()} ({side.flow.name}): what is averaged, the "
        f"second half of the run, {said(side.flow.state)}; the run ended "
        f"{ENDS.get(side.run.attributes.get('end_reason', ''), 'as nobody knows')}."
        for side in found
    ]


def figures_table(metrics: dict) -> pd.DataFrame:
    rows = [
        {
            "figure": doc,
            "mpm": metrics[name]["mpm"],
            "dem": metrics[name]["dem"],
            "packings": metrics[name].get("dem_std"),
            "difference": metrics[name]["relative_difference"],
            "unit": unit,
        }
        for name, (doc, unit) in WORDS.items()
    ]
    return pd.DataFrame(rows).astype(
        {"mpm": float, "dem": float, "packings": float, "difference": float}
    )


def facts_table(metrics: dict) -> pd.DataFrame:
    return pd.DataFrame(
        [
            {
                "figure": WORDS[one["figure"]][0],
                "published": one["value"],
                "grains": metrics[one["figure"]]["dem"],
                "by": one["name"],
                "source": one["source"],
            }
            for one in metrics["published"]
        ]
    )
