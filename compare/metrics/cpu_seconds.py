from compare.mapping.reductions import example_run
from compare.mapping.runs import seconds_of
from compare.metrics import metric


@metric(unit="s", source="the engine's own account")
def cpu_seconds(run):
    """Processor time of the whole run, all threads together: of the grains with their packing, the
    audit of their contacts and all output.
    """
    return seconds_of(run, "cpu_seconds")


def example():
    return (example_run(),), 1.0, 0.0
