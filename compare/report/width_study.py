"""What the kernel's width does to each field of the grains: the plateau on which the width should
lie, measured.

Below the plateau single grains and layers show, above it the surface and the gradients of the flow
leak in.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cases.scratch import temporary
from compare.mapping.reductions import bulk_solid_fraction
from compare.mapping.runs import Run, map_fields, open_fields

FIELDS = (
    "solid_fraction",
    "granular_temperature_one_step",
    "granular_temperature_two_step",
    "granular_temperature",
    "pressure",
    "deviatoric_stress",
)


@dataclass(frozen=True)
class WidthStudy:
    """Means of fields over the same core of the flow for each width; `scatter` is the solid
    fraction's over the core.
    """

    widths: np.ndarray  # [d]
    tau: float  # of the frame, in sqrt(H/g)
    means: dict[str, np.ndarray]
    scatter: np.ndarray


def core(run: Run, frame: int, margin: int = 3) -> np.ndarray:
    """Cells (ny, nx) that the reference width calls dense, `margin` cells away from any that it
    does not.
    """
    dense = run.fields["solid_fraction"][frame] > 0.8 * bulk_solid_fraction(run)
    for _ in range(margin):
        padded = np.pad(dense, 1, constant_values=False)
        padded[0, :], padded[:, 0] = (
            padded[1, :],
            padded[:, 1],
        )  # the walls at y = 0 and x = 0 are no surface
        dense = dense & padded[2:, 1:-1] & padded[:-2, 1:-1] & padded[1:-1, 2:] & padded[1:-1, :-2]
    return dense


def study(run: Run, path: Path, widths, options=()) -> WidthStudy:
    """Maps the frame of the kinetic-energy peak with every width; `options` go to grain_map."""
    frame = int(np.argmin(abs(run.tau() - run.energy_tau()[np.argmax(run.joules("kinetic"))])))
    mask = core(run, frame)
    means: dict[str, list] = {name: [] for name in FIELDS}
    scatter = []
    with temporary() as scratch:
        for width in widths:
            output = scratch / f"{width}.h5"
            map_fields([path], output, *options, "--width", str(width), "--frame", str(frame))
            fields = open_fields(output, path.stem)
            # Wider kernels reach farther and so make larger grids, but cell (0, 0) is the corner of
            # the walls in all.
            ny, nx = (min(a, b) for a, b in zip(mask.shape, fields["solid_fraction"].shape[1:]))
            inside = mask[:ny, :nx]
            for name in FIELDS:
                if name in fields:
                    values = fields[name][0, :ny, :nx][inside]
                    means[name].append(
                        np.mean(values[np.isfinite(values)])
                        if np.isfinite(values).any()
                        else np.nan
                    )
            scatter.append(np.std(fields["solid_fraction"][0, :ny, :nx][inside]))
    return WidthStudy(
        np.array(widths),
        float(run.tau()[frame]),
        {k: np.array(v) for k, v in means.items() if v},
        np.array(scatter),
    )
