"""What the engines themselves warn of."""

import re

from compare.verdict.findings import SIDE, Finding, Severity, check, sides

# Bounds of the watch (mpm/step/watch.cpp) by the warning's word, and what they are shares of.
BOUNDS = {
    "drift": (0.05, "of the energy held at release"),
    "noise": (0.02, "of the kinetic energy"),
    "locking": (0.5, "of the pressure's mean"),
    "crowding": (0.1, "of the volume that points claim"),
    "loss": (1.0 / 3.0, "of the energy released"),
    "tension": (0.01, "of the column's pressure"),
    "end": (1e-3, "of the mass"),
}
FIGURE = re.compile(r"(\d+(?:\.\d+)?(?:e[-+]?\d+)?)( %)?")


@check(order=10)
def warned(c, metrics):
    """Every line of the attribute `warnings` of either engine. The watch speaks when a figure is
    above its bound, so a warning it is known for makes the result invalid; of what the engine has
    mended, and of one that nobody here knows, the user is to judge.
    """
    for engine, runs in sides(c):
        for run in runs:
            for line in str(run.attributes.get("warnings", "none")).splitlines():
                if line.strip() not in ("", "none"):
                    yield told(line.strip(), engine, run.name, len(runs))


def told(line: str, engine: str, name: str, count: int) -> Finding:
    word, _, text = line.partition(": ")
    known = word in BOUNDS
    text = text or line
    advice = re.search(r" \(([^()]*)\)$", text)
    number = FIGURE.search(text) if known else None
    bound, reason = BOUNDS.get(word, (None, ""))
    where = f"{name}.h5" if count > 1 else SIDE[engine]
    return Finding(
        Severity.INVALID if known else Severity.CAUTION,
        f"The {where} warns, {word}: {text[: advice.start()] if advice else text}.",
        advice[1] if advice else "Read what the engine means before the verdict is used.",
        float(number[1]) / (100.0 if number[2] else 1.0) if number else None,
        bound,
        reason=f"the watch's own, {reason}" if reason else "",
        of=engine,
    )
