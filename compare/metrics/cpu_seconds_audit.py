from compare.mapping.reductions import example_run
from compare.mapping.runs import seconds_of
from compare.metrics import metric


@metric(unit="s", source="the engine's own account")
def cpu_seconds_audit(run):
    """Processor time of sampling the grains' contacts, with lifetimes and energies. Not known of
    the continuum, whose steps keep its energies, and of a file that was made before files told it.
    """
    return seconds_of(run, "cpu_seconds_audit")


def example():
    return (example_run(),), 0.25, 0.0
