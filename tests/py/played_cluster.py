"""A cluster that is played by sh: Snakemake writes shell scripts for it as for any."""

from pathlib import Path

CONFIG = """
cluster: "sh"
jobs: 2
latency-wait: 1
max-jobs-per-second: 100
max-status-checks-per-second: 100
"""


def profile(folder: Path) -> Path:
    """Its profile, a new folder in `folder`."""
    made = folder / "profile"
    made.mkdir()
    (made / "config.yaml").write_text(CONFIG)
    return made
