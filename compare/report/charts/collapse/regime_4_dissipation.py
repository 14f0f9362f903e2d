from compare.report.charts import chart
from compare.report.charts.collapse.dissipation import draw_dissipation


@chart("Dissipation in regime 4", order=2)
def regime_4_dissipation(run, narrow):
    return draw_dissipation(run, narrow, "regime_4"), (
        "Energy dissipated in regime 4, by the collisions of the law, since release, per unit "
        "mass of the points (compare [Ceccato2019], Figure 4)."
    )
