from compare.mapping.reductions import example_run
from compare.mapping.runs import seconds_of
from compare.metrics import metric


@metric(unit="s", source="the engine's own account")
def cpu_seconds_setup(run):
    """Processor time of the start of the program, of reading and of the first state, a packing not
    counted. Not known of a file that was made before files told it.
    """
    return seconds_of(run, "cpu_seconds_setup")


def example():
    return (example_run(),), 0.0625, 0.0
