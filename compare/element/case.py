"""The case file of an element test, checked against cases/element_schema.toml."""
import difflib
import tomllib
from pathlib import Path

from cases.errors import CaseError
from dem_reference.grains import Grains

ROOT = Path(__file__).resolve().parents[2]
SCHEMA = ROOT / "cases" / "element_schema.toml"
KINDS = {"float": (float, int), "integer": int, "string": str, "choice": str}


class Case:
    """An element test's case: every key of its own tables, checked, with defaults.

    `case["shear.rates"]` is a value by dotted key, `case.grains` the grains, `case.test` the name of the test.
    """

    def __init__(self, path: Path):
        self.path = Path(path) / "case.toml" if Path(path).is_dir() else Path(path)
        try:
            written = flatten(tomllib.loads(self.path.read_text()))
        except OSError as error:
            raise CaseError(f"{self.path}: cannot be read ({error.strerror})") from None
        except tomllib.TOMLDecodeError as error:
            raise CaseError(f"{self.path}: not TOML ({error})") from None
        schema = keys_of(tomllib.loads(SCHEMA.read_text()))
        self.test = self._checked("element.test", schema["element.test"], written)
        others = set(schema["element.test"]["choices"]) - {self.test}
        schema = {key: entry for key, entry in schema.items() if key.split(".")[0] not in others}
        for key in written:
            if key not in schema:
                near = difflib.get_close_matches(key, schema, 1)
                hint = f" Did you mean '{near[0]}'?" if near else ""
                raise CaseError(
                    f"{self.path}: unknown key '{key}' (a {self.test} test has no such key){hint}"
                )
        self.values = {key: self._checked(key, entry, written) for key, entry in schema.items()}

    def __getitem__(self, key: str):
        return self.values[key]

    @property
    def folder(self) -> Path:
        return self.path.parent

    @property
    def grains(self) -> Grains:
        return Grains(**{name: self[f"grains.{name}"] for name in Grains.__dataclass_fields__})

    def _checked(self, key: str, entry: dict, written: dict):
        value = written.get(key, entry.get("default"))
        if value is None:
            raise CaseError(f"{self.path}: missing key '{key}' ({entry['doc']})")
        kind, values = entry["type"], [value]
        if kind.startswith("["):
            if not isinstance(value, list) or not value:
                raise CaseError(
                    f"{self.path}: '{key}' = {value!r} (a list of at least one value is expected)"
                )
            kind, values = kind[1:-1], value
        for item in values:
            if not isinstance(item, KINDS[kind]) or isinstance(item, bool):
                raise CaseError(f"{self.path}: '{key}' = {item!r} ({kind} expected)")
            if kind == "choice" and item not in entry["choices"]:
                raise CaseError(
                    f"{self.path}: '{key}' = {item!r} (one of {', '.join(entry['choices'])} expected)"
                )
            if "lower" in entry and not entry["lower"] <= item <= entry["upper"]:
                raise CaseError(
                    f"{self.path}: '{key}' = {item} (outside {entry['lower']:g} .. {entry['upper']:g} "
                    f"{entry.get('unit', '')})"
                )
        return (
            [float(item) for item in value]
            if kind == "float" and isinstance(value, list)
            else value
        )


def flatten(table: dict, prefix: str = "") -> dict:
    """Nested tables as one, by dotted key."""
    flat = {}
    for key, value in table.items():
        flat |= (
            flatten(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
        )
    return flat


def keys_of(schema: dict, prefix: str = "") -> dict:
    """The schema's entries (tables that hold a type) by dotted key."""
    entries = {}
    for name, entry in schema.items():
        entries |= {prefix + name: entry} if "type" in entry else keys_of(entry, f"{prefix}{name}.")
    return entries
