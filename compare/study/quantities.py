"""What a key of a case is called on an axis: its quantity and unit, in the schema's words."""

import functools
import re
import textwrap
import tomllib

from cases.programs import ROOT

WIDE = 44  # letters in a line of a label


@functools.cache
def schema() -> dict:
    return tomllib.loads((ROOT / "cases" / "schema.toml").read_text())


def label(key: str, width: int = WIDE) -> str:
    """The first clause of what the schema says of `table.key`, and the unit; a word that is no key
    stays as it is.
    """
    table, _, name = key.partition(".")
    entry = schema().get(table, {}).get(name, {})
    if "doc" not in entry:
        return key.replace("_", " ")
    said = re.split(r"[;:.](?:\s|$)", entry["doc"])[0]
    symbol, _, rest = said.partition(", ")
    if re.fullmatch(r"\w+", symbol) and "_" in symbol:  # a name of the literature, as eps_eff
        said = rest
    unit = "" if entry.get("unit", "-") == "-" else f" [{entry['unit']}]"
    text = said[:1].lower() + said[1:] + unit
    lines = len(textwrap.wrap(text, width))
    while len(textwrap.wrap(text, width - 1)) == lines:
        width -= 1  # lines of like length
    return textwrap.fill(text, width)
