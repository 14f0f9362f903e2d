from compare.mapping.reductions import example_run
from compare.mapping.runs import seconds_of
from compare.metrics import metric


@metric(unit="s", source="the engine's own account")
def cpu_seconds_engine(run):
    """Processor time of the engine's own steps and nothing else, all threads together: what
    costs are compared by. Not known of a file that was made before files told it.
    """
    return seconds_of(run, "cpu_seconds_engine")


def example():
    return (example_run(),), 0.5, 0.0
