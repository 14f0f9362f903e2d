"""What a comparison says, in plain words: made of the entries of metrics.json and nothing else, and
no more than they show.
"""

from compare.verdict.equivalence import AGREE, DIFFER, OUTSIDE, UNDECIDABLE, UNRESOLVED, WITHIN

# Metrics that get a verdict, as a sentence calls them.
WORDS = {
    "run_out_95": "run-out by 95 % of the mass",
    "run_out": "run-out by 99.5 % of the mass",
    "run_out_t50": "time of half the run-out",
    "centre_of_mass_x": "centre of mass along x",
    "final_height": "final height",
    "kinetic_energy_peak": "kinetic-energy peak",
    "kinetic_energy_peak_time": "time of the kinetic-energy peak",
    "dissipated_energy": "energy dissipated",
    "wasserstein_x": "distance of the deposits along x",
    "wasserstein_plane": "distance of the deposits in the plane",
}
LEAD = "run_out_95"
COUNTED = {
    AGREE: ("agrees", "agree"),
    WITHIN: ("lies within its margin", "lie within their margins"),
    DIFFER: ("differs by more than its margin", "differ by more than their margins"),
    OUTSIDE: ("lies outside its margin", "lie outside their margins"),
    UNRESOLVED: ("is unresolved", "are unresolved"),
    UNDECIDABLE: ("is not decidable", "are not decidable"),
}


def shown(value: float, unit: str = "") -> str:
    return f"{value:.3g} {unit}".rstrip(" -")


def paragraph(metrics: dict) -> str:
    """Whether the result is valid, who runs further and by how much, whether packings or numerics
    could make that, and what the other figures come to.
    """
    lead, found = metrics[LEAD], metrics["findings"]["list"]
    valid = metrics["verdict"]["valid"]
    said = [] if valid else [not_valid(found)]
    if lead["mpm"] is None or lead["dem"] is None:
        said.append("How far either of the two runs is not known.")
    else:
        said += [who(lead), against_errors(lead)]
        if valid and lead["verdict"] not in (AGREE, WITHIN):
            said.append(cause(lead))
    said.append(counts(metrics))
    if valid:
        cautions = sum(one["severity"] == "caution" for one in found)
        told = {0: "", 1: "; one caution, below, weakens it"}
        more = told.get(cautions, f"; {cautions} cautions, below, weaken it")
        said.append(f"No check calls the result invalid{more}.")
    return " ".join(said)


def not_valid(found: list[dict]) -> str:
    """The checks that spoil a result, by their names."""
    names = dict.fromkeys(
        one["name"].replace("_", " ") for one in found if one["severity"] == "invalid"
    )
    return (
        f"This result is not valid (checks: {', '.join(names)}; see the findings), so the figures "
        "say nothing about the law."
    )


def widths(entry: dict) -> tuple[float | None, float | None]:
    """Half-widths of what packings scatter by (90 % interval) and of the numerics' error; None
    where it is not known.
    """
    return entry.get("half_width"), entry.get("numerical_uncertainty")


def who(entry: dict) -> str:
    """Which side runs further and by how much."""
    gap, unit = entry["difference"], entry["unit"]
    share = entry["relative_difference"]
    by = shown(abs(gap), unit) + (f" ({100 * abs(share):.2g} %)" if share is not None else "")
    way = "further" if gap > 0.0 else "less far"
    places = (
        f"the front, behind which 95 % of the mass lies, runs out to {shown(entry['mpm'], unit)} "
        f"in the continuum and to {shown(entry['dem'], unit)} in the grains "
        "(L0 is the column's length)"
    )
    if entry["verdict"] in (AGREE, WITHIN):
        return (
            "Continuum and grains run equally far, within the case's margin of "
            f"{shown(entry['margin'], unit)}: {places}, {by} apart."
        )
    if abs(gap) <= sum(one or 0.0 for one in widths(entry)):
        return f"Which of the two runs further is not decided: {places}, {by} apart."
    return f"The continuum runs {way} than the grains, by {by}: {places}."


def against_errors(entry: dict) -> str:
    """The difference beside the scatter of the packings and the error of the numerics."""
    gap, known, unknown = abs(entry["difference"]), [], []
    about = (
        ("packings scatter by", "how far packings scatter"),
        ("the continuum's numerics may be off by", "what the continuum's numerics are off by"),
    )
    for width, (what, lacking) in zip(widths(entry), about):
        if width is None:
            unknown.append(lacking)
        else:
            known.append((gap > width, f"{what} (± {shown(width, entry['unit'])})"))
    said = []
    if known:
        words = [f"{'more' if more else 'no more'} than {what}" for more, what in known]
        unlike = len({more for more, _ in known}) > 1
        said.append(f"That is {(', but ' if unlike else ' and ').join(words)}.")
    if unknown:
        lacking = " and ".join(unknown)
        verb = "are" if len(unknown) > 1 else "is"
        said.append(f"{lacking[0].upper()}{lacking[1:]} {verb} not known.")
    return " ".join(said)


def cause(entry: dict) -> str:
    """What the difference may stem from: of those that are left, no more than is shown."""
    gap = abs(entry["difference"])
    scatter, numerics = widths(entry)
    alone = [
        word
        for word, width in (("the packings' scatter", scatter), ("the numerics", numerics))
        if width is not None and gap <= width
    ]
    if alone:
        verb = "each alone" if len(alone) > 1 else "alone"
        made = f"{' and '.join(alone)} {verb} could make it"
        return f"{made[0].upper()}{made[1:]}: it shows nothing of the law."
    if scatter is None or numerics is None:
        return "Without that it cannot be told whether the law makes the difference."
    if gap <= scatter + numerics:
        return "The two together could make it: it shows nothing of the law."
    return (
        "Both together do not make it: what is left is the model, that is the law, its constants "
        "or the state it starts from, and what the findings name."
    )


def counts(metrics: dict) -> str:
    """How many of the figures that decide the verdict have which."""
    words = [e["verdict"] for e in metrics.values() if "verdict" in e and e.get("decides")]
    told = [
        f"{words.count(word)} {many if words.count(word) > 1 else one}"
        for word, (one, many) in COUNTED.items()
        if word in words
    ]
    if not told:
        return "No figure could be judged."
    listed = told[0] if len(told) == 1 else f"{', '.join(told[:-1])} and {told[-1]}"
    if len(words) == 1:
        return f"The one figure that decides the verdict {told[0].removeprefix('1 ')}."
    return f"Of the {len(words)} figures that decide the verdict, {listed}."


def beyond(metrics: dict) -> list[str]:
    """Each figure that differs or lies outside its margin, with by how much."""
    return [
        f"{WORDS.get(name, name)}: {apart(entry)}"
        for name, entry in metrics.items()
        if entry.get("verdict") in (DIFFER, OUTSIDE)
    ]


def apart(entry: dict) -> str:
    """The difference of the means, or the distance, beside the margin."""
    gap, unit, margin = entry.get("difference", entry.get("value")), entry["unit"], entry["margin"]
    told = shown(gap, unit)
    if "value" not in entry:
        told = f"continuum less grains {gap:+.3g} {unit}"
    times = f", {abs(gap) / margin:.2g} times the margin of {shown(margin, unit)}"
    return told + (times if margin > 0.0 else ", the margin is none")
