"""Classes of failure as studies store them, told by the code that a run ends with."""

from cases.errors import Failure, Warned

CLASSES = {
    Failure.NOT_FINITE: "not a number",
    Failure.ENERGY_GROWTH: "energy growth",
    Failure.EJECTED: "ejected points",
    Failure.INVERTED: "inverted volume",
    Failure.LOST_GRAINS: "lost grains",
    Failure.REFUSED: "refused",
    Failure.CPU_LIMIT: "timeout",
}
OTHER = "engine failure"
DRIFT = "energy drift"  # a warning, of a run that ended well


def classify(code: Failure | None) -> str:
    """The class of a code; `engine failure` where there is none that a study tells apart."""
    return CLASSES.get(code, OTHER) if code else OTHER


def warnings_of(lines: str) -> set[Warned]:
    """What a run warned of, by the word before the colon of each line."""
    words = {line.split(":")[0] for line in lines.splitlines()}
    return {warning for warning in Warned if warning in words}
