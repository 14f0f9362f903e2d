"""What a comparison comes to: metrics, controls and findings together, in words and as the exit
code of `run` and `compare`.
"""

import difflib
import textwrap

from cases.errors import CaseError
from compare.metrics import all_metrics
from compare.verdict import controls
from compare.verdict.comparison import Comparison, evaluate
from compare.verdict.equivalence import AGREE, WITHIN
from compare.verdict.findings import Severity, entry, findings

INVALID, NOT_MET = 4, 5  # exit codes
EXIT_CODES = f"""exit codes:
  0  compared, whether the two agree or differ
  2  bad input
  3  an engine failed
  {INVALID}  the result is invalid: a finding says why
  {NOT_MET}  a verdict that --require names does not hold"""


def conclude(c: Comparison, judged: list[controls.Control]) -> dict[str, dict]:
    """metrics.json: every metric, the controls, and what spoils them."""
    metrics = evaluate(c) | controls.entries(judged)
    found = findings(c, metrics)
    metrics["verdict"]["valid"] = all(one.severity != Severity.INVALID for one in found)
    return metrics | {"findings": entry(found)}


def headline(metrics: dict) -> str:
    """The verdict in a few words."""
    verdict = metrics["verdict"]
    word = verdict["value"]
    return word if verdict["valid"] else f"INVALID, whatever the figures say ({word})"


def verdict_words(one: dict) -> str:
    """The verdict of one metric, with why where it is not decidable; "" where there is none."""
    words = one.get("verdict", "")
    return f"{words}: {one['because']}" if "because" in one else words


def lines(metrics: dict) -> list[str]:
    """The verdict and every finding, for a terminal."""
    texts = [f"verdict: {headline(metrics)}; {metrics['verdict']['scatter']}"]
    for one in metrics["findings"]["list"]:
        texts.append(f"{one['severity']}: {one['sentence']} {one['advice']}")
    return [
        line
        for text in texts
        for line in textwrap.wrap(
            text, 100, subsequent_indent="    ", break_on_hyphens=False, break_long_words=False
        )
    ]


def judged_metrics() -> list[str]:
    """Metrics that get a verdict."""
    return sorted(name for name, one in all_metrics().items() if one.margin)


def required(words: str) -> list[str]:
    """Names of `--require`; raises CaseError where one gets no verdict."""
    known = judged_metrics()
    names = [word.strip() for word in words.split(",") if word.strip()]
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]}?" if near else "choose one of them"
            raise CaseError(
                f"--require: '{name}' gets no verdict (those that do: {', '.join(known)}) {hint}"
            )
    return names


def not_met(metrics: dict, names: list[str]) -> list[str]:
    """One line for each of the metrics whose verdict does not hold."""
    return [
        f"--require: {name} does not hold ({verdict_words(metrics[name])})"
        for name in names
        if metrics[name]["verdict"] not in (AGREE, WITHIN)
    ]


def exit_code(metrics: dict, names: list[str]) -> int:
    """An invalid result meets no requirement, and its code says so first."""
    if not metrics["verdict"]["valid"]:
        return INVALID
    return NOT_MET if not_met(metrics, names) else 0


def require_argument(parser):
    """The option `--require` and the exit codes in the help of a command that compares."""
    parser.add_argument(
        "--require",
        default="",
        metavar="METRIC,…",
        help="exit with 5 unless the verdicts of these metrics are agree or within margin",
    )
    parser.epilog = EXIT_CODES
