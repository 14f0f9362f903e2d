from matplotlib.colors import LogNorm

from compare.report.charts import chart
from compare.report.charts.collapse import colour_bar, draw_points


@chart("Deviatoric strain", order=1)
def deviatoric_strain(run, narrow):
    figure, axes, artist = draw_points(
        run,
        narrow,
        lambda frame: run.clouds[frame].state["deviatoric_strain"],
        "turbo",
        LogNorm(0.01, 10.0, clip=True),
    )
    colour_bar(
        figure,
        axes,
        artist,
        r"accumulated deviatoric strain $\int\sqrt{2/3\ \mathrm{dev}D:\mathrm{dev}D}\ dt$",
    )
    return figure, (
        "Deviatoric strain accumulated at the points since release, on a logarithmic scale "
        "(compare [Ceccato2019], Figure 3): the failure surface is where it falls from the "
        "mobilised mass to the static cone."
    )
