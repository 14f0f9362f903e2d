import numpy as np
from matplotlib.colors import Normalize

from compare.report.charts import chart
from compare.report.charts.maps import draw_maps, instants

REST = 0.02  # of the fastest: what is slower no reader tells from rest on a scale to the fastest


@chart("Speed", order=4)
def map_speed(comparison, narrow):
    dem = comparison.dem[0]
    scale = np.sqrt(dem.case["geometry.gravity"] * dem.height)

    def speed(run, frame):
        return np.linalg.norm(run.fields["velocity"][frame], axis=-1) / scale

    fastest = max(
        np.nanpercentile(speed(run, frame), 99.0)
        for pair in instants(comparison)
        for run, frame in zip(comparison.first, pair)
    )
    figure = draw_maps(
        comparison,
        narrow,
        speed,
        r"speed $|V|/\sqrt{gH}$",
        Normalize(REST * fastest, fastest),
        "cividis",
        still=True,
    )
    return (
        figure,
        "Speed of the mapped velocity (momentum over density), the same kernel on both sides. What "
        f"is slower than {100 * REST:.0f} % of the scale's upper end is grey.",
    )
