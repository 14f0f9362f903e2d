"""Compare the law with the grains in an element test, such as simple shear or cooling.

CASE is a folder of cases/ with an element test. Points that its reference lacks are measured first
(hours, if all do); then the grains and the law with each material card are drawn in one figure, and
the errors are tabulated with a verdict.
"""

import json
from pathlib import Path

from cases import command_line, results, workflow
from cases.errors import CaseError, EngineError
from cases.files import write_atomically, write_table
from cases.members import Members
from cases.programs import ROOT, short
from cases.lookup import find_case
from compare.element import campaign, library, records
from compare.element.blocks import every
from compare.element.case import Case
from compare.element.deviations import table, verdicts
from compare.element.card import Card
from compare.element.model import Law, Model
from compare.element.point import PointModel
from compare.element.records import Rows
from compare.element.tests import ComparedTest, compared_tests, test_of

CARDS = ("seed_table1", "dem_mu05")
PACKAGES = ["studies"]


def arguments(parser):
    parser.add_argument("case", metavar="CASE", help="such as cases/shear, or shear")
    parser.add_argument(
        "--quick", action="store_true", help="measure one small point in place of the reference's"
    )
    parser.add_argument(
        "--card",
        action="append",
        metavar="NAME",
        help="material card, may be repeated; a path that ends in .toml: the card of a law in a "
        f"shared library (default: {', '.join(CARDS)})",
    )
    parser.add_argument(
        "--cores",
        type=command_line.threads,
        default=1,
        metavar="N",
        help="points measured at a time (default: 1)",
    )
    parser.add_argument(
        "--closed-form", action="store_true", help="the law by its closed forms, not by mpm_point"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder of the results (default: runs/element/<test>)",
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")


def run(options) -> int:
    case = Case(find_case(options.case))
    test = test_of(case)
    if not isinstance(test, ComparedTest):
        raise CaseError(
            f"{case.path}: the law has no counterpart of a {case.test} test (it is a check of the "
            f"engines) use one of {', '.join(test.name for test in compared_tests())}"
        )
    models: dict[str, Law] = {}
    for name in options.card or CARDS:
        if name.endswith(".toml"):
            if options.closed_form:
                raise CaseError(f"{name}: --closed-form (a law of a shared library has none)")
            path = Path(name)
            label = path.parent.name if path.stem == "case" else path.stem
            models[label] = library.model_of(path, case.grains, case.test, **test.driven(case))
            continue
        card = Card.read(name)
        if options.closed_form:
            models[name] = Model(card, case.grains)
        else:
            models[name] = PointModel(card, case.grains, **test.driven(case))
    folder = case.test + ("_quick" if options.quick else "")
    out = options.out or ROOT / "runs" / "element" / folder
    with results.prepared(out) as work:
        sentences, files = measured_and_drawn(case, test, models, options, work)
    print("\n".join(sentences))
    print(*(out / file.name for file in files), sep="\n")
    return 0


def measured_and_drawn(
    case: Case, test: ComparedTest, models: dict[str, Law], options, out: Path
) -> tuple[list[str], list[Path]]:
    """What a test says, and the files that say it, in the folder `out`."""
    rows = (
        campaign.run_point(case, campaign.quick_point(case))
        if options.quick
        else reference(case, options.cores, options.quiet)
    )
    measured = [row for row in rows if row["status"] == "measured"]
    failed = sorted({row["status"] for row in rows} - {"measured"})
    if not measured:
        raise EngineError(f"{case.path}: no point could be measured ({'; '.join(failed)})")

    errors = table(test.blocks(measured, every), models)
    sentences = verdicts(errors) + [f"not measured: {reason}" for reason in failed]
    if not options.quick:
        sentences += test.remarks(case, measured)
    files = test.draw(measured, models, out / case.test)
    write_table(out / "errors.csv", [], errors, "%.5g")
    summary = {"title": case["title"], "verdicts": sentences, "errors": standard_json(errors)}
    write_atomically(out / "errors.json", json.dumps(summary, indent=1))
    return sentences, [*files, out / "errors.csv", out / "errors.json"]


def standard_json(rows: list[dict]) -> list[dict]:
    """JSON has no number that is none."""
    return [{key: None if value != value else value for key, value in row.items()} for row in rows]


def reference(case: Case, cores: int, quiet: bool) -> Rows:
    """The rows of the case's reference, after measuring the points it lacks, which is shown unless
    it is to be `quiet`.
    """
    if missing := campaign.missing(case):
        if not case.folder.resolve().is_relative_to(ROOT / "cases" / case.test):
            raise CaseError(
                f"{case.path}: {len(missing)} points are not measured (campaigns lie below "
                f"cases/{case.test} alone) use --quick for one point"
            )
        jobs = campaign.jobs(case, missing)
        files = {name: job.file for name, job in jobs.items()}
        workflow.run(
            jobs,
            campaign.place(case),
            workflow.Where(cores),
            Members(f"points of {case.test}", files, quiet=quiet),
            alone=True,
        )
        campaign.gather(case, f"./grainpair element {short(case.folder)}")
    return records.read(records.reference_file(case))
