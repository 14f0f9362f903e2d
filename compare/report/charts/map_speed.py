import numpy as np
from matplotlib.colors import Normalize

from compare.report.charts import chart
from compare.report.charts.maps import draw_maps, instants


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
        comparison, narrow, speed, r"speed $|V|/\sqrt{gH}$", Normalize(0.0, fastest), "cividis"
    )
    return (
        figure,
        "Speed of the mapped velocity (momentum over density), the same kernel on both sides.",
    )
