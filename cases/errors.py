"""The two ways a command fails; the launcher prints the line and exits with the code."""


class CaseError(Exception):
    """Bad input, said in one line: `file:line: problem (why) hint`. Exit code 2."""


class EngineError(Exception):
    """A program of a run failed or is missing, said in one line. Exit code 3."""
