from matplotlib.colors import Normalize

from compare.report.charts import chart
from compare.report.charts.maps import draw_maps


@chart("Void ratio", order=2)
def map_void_ratio(comparison, narrow):
    e0 = comparison.dem[0].case["initial.void_ratio"]
    figure = draw_maps(
        comparison,
        narrow,
        lambda run, k: run.fields["void_ratio"][k],
        "void ratio $e$",
        Normalize(0.8 * e0, 2.0 * e0),
        "viridis",
    )
    return figure, (
        "Void ratio from the mapped solid fraction, the same kernel on both sides. At the free "
        "surface the kernel reaches into the air and the void ratio reads too high on either side; "
        "in the lowest row it reads low for grains that lie between those glued to the floor."
    )
