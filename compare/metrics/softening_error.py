import math

from compare.mapping.reductions import example_run
from compare.metrics import metric


@metric(unit="-", source="cases/softening.toml")
def softening_error(run):
    """Largest relative error of run-out, centre of mass, height and kinetic-energy peak to be
    expected of grains or a skeleton softer than their own; 0 where nothing is softened.
    """
    return float(run.attributes.get("softening_error", math.nan))


def example():
    run = example_run()
    run.attributes["softening_error"] = 0.0115
    return (run,), 0.0115, 0.0
