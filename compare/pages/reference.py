"""Pages of reference that are written by the build: keys, metrics, commands, warnings and failures.

Each is made from what the program itself goes by, so that it cannot say anything else.
"""

import argparse
import csv
import re
import tomllib
from collections.abc import Callable, Iterator

from cases.programs import ROOT, call, program
from compare.parsers import all_commands
from compare.metrics import all_metrics

SCHEMAS = {  # of each kind of input file: its schema, and what the file is
    "scene": ("schema.toml", "Scenes: `case.toml`, and `--set` of most commands."),
    "element": ("element_schema.toml", "Element tests of the grains."),
    "point": ("point_schema.toml", "Paths of one material point, for `mpm_point`."),
    "study": ("study_schema.toml", "Recipes of studies: `study.toml`."),
}
FIRST_STEP = ROOT / "docs" / "reference" / "first_step.csv"
PACKAGES = "packages: "  # what the rows of packages begin with
LEFT_OUT = {"former"}  # names that are no more


def cell(text: object) -> str:
    """Text in a cell of a Markdown table, its own signs taken as they are."""
    return re.sub(r"([|*_<>\[\]`])", r"\\\1", " ".join(str(text).split()))


def code(text: object) -> str:
    """Text as code in a cell; none of no text."""
    return f"`` {str(text).replace('|', chr(92) + '|')} ``" if str(text) else ""


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def entries(schema: dict, above: str = "") -> Iterator[tuple[str, dict]]:
    """Every key of a schema with its entry, those inside a table after it."""
    for name, entry in schema.items():
        if name == "when":  # of a whole table: where it exists
            continue
        if not isinstance(entry.get("type"), str):
            yield from entries(entry, f"{above}{name}.")
            continue
        yield above + entry.get("key", name), entry
        yield from entries(entry.get("keys", {}), f"{above}{name}.")


def bounds(entry: dict) -> str:
    """What values a key may have."""
    if "choices" in entry:
        return ", ".join(map(str, entry["choices"]))
    if entry.get("positive"):
        return "> 0"
    lower, upper = (f"{entry[one]:g}" if one in entry else None for one in ("lower", "upper"))
    told = {
        (True, True): f"{lower} to {upper}",
        (True, False): f"≥ {lower}",
        (False, True): f"≤ {upper}",
        (False, False): "",
    }[lower is not None, upper is not None]
    return "; ".join(
        [told] * bool(told) + [f"{k} {entry[k]}" for k in ("length", "least") if k in entry]
    )


def default(entry: dict) -> str:
    """The value of a key that a file does not give, as TOML has it."""
    if "default" not in entry:
        return "none" if entry.get("optional") else "**required**"
    value = entry["default"]
    if isinstance(value, bool):
        return code(str(value).lower())
    return code(f'"{value}"' if isinstance(value, str) else value)


def row(name: str, entry: dict) -> list[str]:
    when = ", ".join(
        f"{key} is {' or '.join([value] if isinstance(value, str) else map(str, value))}"
        for key, value in entry.get("when", {}).items()
    )
    doc = cell(entry.get("doc", "")) + (f" *Where {cell(when)}.*" if when else "")
    return [
        code(name),
        cell(entry["type"]),
        cell(entry.get("unit", "")),
        cell(bounds(entry)),
        default(entry),
        doc,
    ]


def keys() -> str:
    """Every key of every input file."""
    out = ["# Keys of input files\n", "`./grainpair describe` says the same in a terminal.\n"]
    for kind, (file, what) in SCHEMAS.items():
        schema = tomllib.loads((ROOT / "cases" / file).read_text())
        out += [f"## Kind `{kind}`\n", f"{what} (`cases/{file}`)\n"]
        tables: dict[str, list[list[str]]] = {}
        for name, entry in entries({k: v for k, v in schema.items() if k not in LEFT_OUT}):
            tables.setdefault(name.partition(".")[0] if "." in name else "", []).append(
                row(name, entry)
            )
        for above, rows in tables.items():
            out += [f"### {kind}: `[{above}]`\n"] if above else []
            out.append(table(["key", "type", "unit", "values", "default", "meaning"], rows))
    return "\n".join(out)


def metrics() -> str:
    """Every metric of a comparison."""
    rows = [
        [
            code(one.name),
            cell(one.unit),
            "of the pair" if one.of_pair else "of either side",
            code(one.margin) if one.margin else "",
            cell(one.definition),
            cell(one.source),
        ]
        for one in sorted(all_metrics().values(), key=lambda m: m.name)
    ]
    return "\n".join(
        [
            "# Metrics\n",
            "What `metrics.json` and the report hold. A metric with a margin has a verdict.\n",
            table(["metric", "unit", "of", "margin", "definition", "source"], rows),
        ]
    )


def option(parser: argparse.ArgumentParser, action: argparse.Action) -> list[str]:
    """A row of an option or an argument: how it is written, and its help with the default in it."""
    formatter = parser._get_formatter()
    if action.option_strings:
        takes = (
            "" if action.nargs == 0 else " " + formatter._format_args(action, action.dest.upper())
        )
        written = ", ".join(action.option_strings) + takes
    else:
        written = formatter._format_args(action, action.dest)
    return [code(written), cell(formatter._expand_help(action) if action.help else "")]


def commands() -> str:
    """Every command with its options."""
    out = ["# Commands\n", "`./grainpair COMMAND --help` says the same in a terminal.\n"]
    for name, parser in all_commands().items():
        first, *rest = (parser.description or "").split("\n\n")
        rows = [option(parser, a) for a in parser._actions if a.help != argparse.SUPPRESS]
        usage = " ".join(parser.format_usage().split()).removeprefix("usage: ")
        out += [f"## {name}\n", f"**{cell(first)}**\n", *(f"{cell(text)}\n" for text in rest)]
        out += [f"```text\n{usage}\n```\n", table(["option", "meaning"], rows)]
    return "\n".join(out)


def failures() -> str:
    """Codes of failures and words of warnings, as the engine tells them."""
    told = call([program("mpm_case"), "--failures"]).stdout
    rows: dict[str, list[list[str]]] = {"failure": [], "warning": []}
    for kind, word, text in re.findall(r"^(\w+) ([\w-]+): (.*)$", told, flags=re.M):
        rows[kind].append([code(word), cell(text)])
    return "\n".join(
        [
            "# Failures and warnings\n",
            "A line of an engine that fails ends in its code, in brackets; the exit code is 3.\n",
            table(["code", "meaning"], rows["failure"]),
            "A warning of the continuum starts with its word; the findings of a report say what to "
            "do.\n",
            table(["word", "meaning"], rows["warning"]),
        ]
    )


def first_step() -> str:
    """What installing, building and a first report take on a bare Debian, as measured."""
    with FIRST_STEP.open(newline="") as file:
        found = list(csv.DictReader(line for line in file if not line.startswith("#")))
    rows = [
        [cell(one["what"]), cell(one["system"]), f"{one['value']} {one['unit']}", cell(one["why"])]
        for one in found
    ]
    head = ["what", "system", "measured", "why"]
    return "\n".join(
        [
            "# The first step",
            "",
            "A bare system (mmdebstrap's minbase), git, a fresh clone, `./grainpair run`: "
            "`tests/first_step.sh`.",
            "",
            table(head, [one for one in rows if not one[0].startswith(PACKAGES)]),
            "",
            "Of the packages, each with what it needs that those above it have not brought:",
            "",
            table(head, [one for one in rows if one[0].startswith(PACKAGES)]),
        ]
    )


PAGES: dict[str, Callable[[], str]] = {
    "keys": keys,
    "metrics": metrics,
    "commands": commands,
    "failures": failures,
    "first_step": first_step,
}
