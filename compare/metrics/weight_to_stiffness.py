import math

from compare.mapping.reductions import example_run
from compare.metrics import metric


@metric(unit="-", source="cases/stiffness.hpp")
def weight_to_stiffness(run):
    """rho g H/K: the column's weight over the bulk modulus that skeleton or packing have at its
    base, as computed, softened or not.
    """
    return float(run.attributes.get("weight_to_stiffness", math.nan))


def example():
    run = example_run()
    run.attributes["weight_to_stiffness"] = 5e-3
    return (run,), 5e-3, 0.0
