"""What decides the grains: of the case, of the sources, of the engine; and the keys of what is kept
of them.

    python3 -m dem_reference.content FILE    # digest of the library's sources; the build calls it
"""

import sys
from functools import cache
from pathlib import Path

from cases import content
from cases.case import Case, parse
from cases.errors import EngineError
from cases.files import write_atomically
from cases.programs import ROOT, call, kept, name_of, plain, program

SCRIPTS, LEDGER = "dem_reference/scripts", "dem_reference/ledger"
# What a packing does not feel.
RELEASE = ("geometry.inclination", "initial.velocity", "walls.gate", "walls.gate_speed")
AUDIT = ("dem.audit_interval", "dem.lifetime_threshold")


def inputs(case: Case | dict) -> dict:
    """The keys of a case, such as "grains.friction", that decide a run of the grains, with their
    values.

    Of geometry.dimension the grains know only whether the column is a cylinder.
    """
    return told(case) | {
        "geometry.axisymmetric": case["geometry"]["dimension"] == "axisymmetric",
        "initial.void_ratio": case["initial"]["void_ratio"],
        "initial.velocity": case["initial"].get("velocity", 0.0),
    }


def told(case: Case | dict) -> dict:
    """The tables that decide grains whole, by "table.key", without geometry.dimension."""
    return {
        f"{table}.{key}": value
        for table in ("geometry", "grains", "walls", "dem", "time")
        for key, value in case[table].items()
        if (table, key) != ("geometry", "dimension")
    }


def completed(made_of: dict) -> dict:
    """Inputs as they were kept, with the defaults of the keys that the schema has gained since."""
    return told(parse("")) | {"initial.velocity": 0.0} | made_of


def differences(made_of: dict, asked: dict) -> list[str]:
    """Keys in which two tables of inputs differ."""
    keys = made_of.keys() | asked.keys()
    return sorted(key for key in keys if made_of.get(key) != asked.get(key))


@cache
def engine() -> str:
    """Versions of Debian's packages of LIGGGHTS, library and program."""
    packages = ("libliggghts3", "liggghts")
    form = "--showformat=${Package} ${Version}\\n"
    try:
        return call(["dpkg-query", "--show", form, *packages]).stdout.strip()
    except EngineError:
        return "not told"


def sources(*entries: str, root: Path = ROOT) -> str:
    """Digest of the modules `entries` with all they import, of the templates, and of the library
    that makes the accounts.
    """
    scripts = sorted((root / SCRIPTS).glob("*.in"))
    files = [*sorted(content.imported(*entries, root=root)), *scripts]
    return content.digest([content.of_files(files, root), ledger(root)])


def ledger(root: Path = ROOT) -> str:
    """Digest of the sources of grain_ledger: those it was built from, which the build records
    beside it, else those there are. So a library that is older than a source fills its own place.
    """
    record = program("grain_ledger.so.sources")
    if root == ROOT and record.exists():
        return record.read_text().strip()
    return content.of_files(sorted((root / LEDGER).glob("*.[ch]pp")), root)


def packing_key(case: Case | dict, seed: int, root: Path = ROOT) -> str:
    """Name of a packing."""
    felt = {
        key: value
        for key, value in inputs(case).items()
        if not key.startswith("time.") and key not in (*RELEASE, *AUDIT)
    }
    return content.digest([felt, seed, engine(), sources("dem_reference.packing", root=root)])


def ensemble_key(case: Case | dict, ranks: int = 1, root: Path = ROOT) -> str:
    """Name of the runs of a case that differ by their seeds only.

    More than one rank sums in another order. Whether contacts are kept changes no grain, but the
    file.
    """
    made = sources("dem_reference.run", root=root)
    return content.digest([inputs(case), case["output"]["contacts"], ranks, engine(), made])


def run_key(case: Case | dict, seed: int, script: bool, ranks: int, root: Path = ROOT) -> str:
    """What decides every bit of a run's result, and so which checkpoints are its own."""
    driver = "script" if script else "library"
    return content.digest([ensemble_key(case, ranks, root), seed, driver])


def ensemble_folder(case: Case, ranks: int = 1) -> Path:
    """Where the runs of a case are kept, as <seed>.h5; a name that a cluster's shell would read
    (cases/workflow.py) is not part of it.
    """
    name = name_of(case.path)
    return kept(
        "ensembles",
        name if plain(name) else content.digest(name),
        ensemble_key(case, ranks),
    )


if __name__ == "__main__":
    made = content.of_files(sorted((ROOT / LEDGER).glob("*.[ch]pp")))
    write_atomically(Path(sys.argv[1]), made + "\n")
