from compare.report.charts import chart
from compare.report.charts.collapse.dissipation import draw_dissipation


@chart("Plastic dissipation", order=3)
def plastic_dissipation(run, narrow):
    return draw_dissipation(run, narrow, "plastic"), (
        "Energy dissipated by plastic flow since release, per unit mass of the points (compare "
        "[Ceccato2019], Figure 5); its scale is its own, not that of regime 4."
    )
