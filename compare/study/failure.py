"""Classes of failure, told from the line a program ends with."""

CLASSES = (  # class, words of the line
    ("not a number", ("not finite",)),
    ("energy growth", ("energy grew",)),
    ("ejected points", ("left the grid", "too fast")),
    ("inverted volume", ("volume inverted",)),
    ("lost grains", ("lost",)),
    ("refused", ("contact limit", "at least 10 resolve")),
)
DRIFT = "energy drift"  # a warning, of a run that ended well
TIMEOUT, OTHER = "timeout", "engine failure"


def classify(line: str) -> str:
    return next((name for name, words in CLASSES if any(word in line for word in words)), OTHER)
