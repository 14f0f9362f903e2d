"""When a run looks at its grains: steps, rows, frames."""

from dataclasses import dataclass
from math import sqrt

from .grains import Grains, time_step


@dataclass(frozen=True)
class Plan:
    """Steps of a run: every interval is a whole multiple of the shorter one.

    So pieces of the run always end alike.
    """

    dt: float  # [s]
    sample: int  # steps between samples of the contacts
    row: int  # between rows of the energy history
    frame: int  # between frames
    last: int  # at most
    scale: float  # sqrt(H/g) [s]

    @classmethod
    def of(cls, case: dict) -> "Plan":
        geometry, t = case["geometry"], case["time"]
        grains = Grains.of(case)
        dt = time_step(
            grains, case["dem"]["time_step_fraction"], geometry["height"], geometry["gravity"]
        )
        scale = sqrt(geometry["height"] / geometry["gravity"])
        wanted = max(1, round(t["energy_interval"] * scale / dt))
        sample = min(case["dem"]["audit_interval"] or wanted, wanted)
        row = sample * max(1, round(wanted / sample))
        frame = row * max(1, round(t["frame_interval"] * scale / dt / row))
        last = frame * max(1, round(t["maximum"] * scale / dt / frame))
        return cls(dt, sample, row, frame, last, scale)
