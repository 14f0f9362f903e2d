"""How far an import is: on a terminal a bar with the time left, else nothing."""

import sys
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from compare.importing import compressed

FORM = "{desc} {percentage:3.0f} % |{bar:24}| {elapsed} (left {remaining}){postfix}"
READING_SHARE = 0.6  # of the time goes into reading, the rest into turning and writing


class Progress:
    """Of files whose bytes are read first; then of `frames` that are written."""

    def __init__(self, files: Sequence[Path], quiet: bool):
        self.sizes = {path: path.stat().st_size if path.is_file() else 0 for path in files}
        self.done: set[Path] = set()
        self.bar = tqdm(
            desc="import",
            total=1.0,
            disable=quiet or not sys.stderr.isatty(),
            bar_format=FORM,
            dynamic_ncols=True,
        )

    def reading(self, path: Path):
        """Another frame of a file has been read."""
        ended = sum(self.sizes[one] for one in self.done)
        at = compressed.READING.get(path, lambda: 0)()
        self.to(READING_SHARE * (ended + at) / max(sum(self.sizes.values()), 1), path.name)

    def read(self, path: Path):
        """A file has been read."""
        self.done.add(path)

    def written(self, frame: int, frames: int):
        self.to(READING_SHARE + (1.0 - READING_SHARE) * frame / frames, f"frame {frame}/{frames}")

    def to(self, fraction: float, text: str):
        self.bar.set_postfix_str(text, refresh=False)
        self.bar.update(max(0.0, min(fraction, 1.0) - self.bar.n))

    def close(self):
        self.bar.close()
