from compare.report.charts import chart
from compare.report.charts.collapse.dissipation import draw_dissipation


@chart("Collisional dissipation", order=2)
def collisional_dissipation(run, narrow):
    return draw_dissipation(run, narrow, "collisional"), (
        "Energy dissipated by collisions since release, per unit mass of the points (compare "
        "[Ceccato2019], Figure 4)."
    )
