"""A folder while others work in it."""

from pathlib import Path


def seen(folder: Path, pattern: str) -> list[Path]:
    """What is there of a pattern. A folder may go between its name and its content, which
    Path.glob does not bear: it is looked at once more then.
    """
    while True:
        try:
            return list(folder.glob(pattern))
        except FileNotFoundError:
            continue
