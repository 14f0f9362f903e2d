import numpy as np
from matplotlib.colors import LogNorm

from compare.mapping.reductions import has_temperature
from compare.report.charts import chart
from compare.report.charts.maps import draw_maps


@chart("Granular temperature", order=3)
def map_granular_temperature(comparison, narrow):
    dem = comparison.dem[0]
    scale = dem.case["geometry.gravity"] * dem.diameter

    def temperature(run, frame):
        own = "granular_temperature_state" if run.engine == "mpm" else "granular_temperature"
        return np.maximum(run.fields[own][frame], 1e-12 * scale) / scale

    both = has_temperature(comparison.mpm[0])
    figure = draw_maps(
        comparison,
        narrow,
        temperature,
        "granular temperature $T/(g d)$",
        LogNorm(1e-4, 10.0),
        "magma",
        ("mpm", "dem") if both else ("dem",),
        still=True,
    )
    continuum = (
        "the continuum's is its state variable"
        if both
        else "the continuum's law has none, so the grains stand alone"
    )
    return figure, (
        "Granular temperature: the grains' is measured, the mean square velocity about the local "
        f"affine flow, corrected for the few grains under the kernel; {continuum}. What lies below "
        "the scale, at rest to the eye, is grey."
    )
