"""The two ways a run can fail, with the exit codes every program of grainpair uses."""


class InputError(Exception):
    """The case asks for something that cannot be run: exit code 2."""

    exit_code = 2


class EngineError(Exception):
    """LIGGGHTS is missing, failed, or lost grains: exit code 3."""

    exit_code = 3
