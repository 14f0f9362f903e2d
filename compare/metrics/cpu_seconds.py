from compare.metrics import metric
from compare.mapping.reductions import example_run


@metric(unit="s", source="the engine's own account")
def cpu_seconds(run):
    """Processor time of the run, all threads together."""
    return float(run.attributes["cpu_seconds"])


def example():
    return (example_run(),), 1.0, 0.0
