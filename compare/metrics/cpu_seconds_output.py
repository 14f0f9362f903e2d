from compare.mapping.reductions import example_run
from compare.mapping.runs import seconds_of
from compare.metrics import metric


@metric(unit="s", source="the engine's own account")
def cpu_seconds_output(run):
    """Processor time of frames and files. Not known of a file that was made before files told
    it.
    """
    return seconds_of(run, "cpu_seconds_output")


def example():
    return (example_run(),), 0.125, 0.0
