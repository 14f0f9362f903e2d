"""Where a layer begins to flow, from rest, and where one that flows stops: what it does at several
inclinations, begun either way.

A flowing layer begins faster than the steady flow of the angles near the threshold
(initial.velocity), so it comes down to that flow, or to rest. Between the angle at which it stops
and the one at which it starts both ends are there: hysteresis.
"""

import numpy as np
import pandas as pd

from cases import case
from compare.chute import sides
from compare.chute.flow import state_of
from compare.chute.plan import Task, of_law, result
from compare.study.recipe import Recipe

REST = (19.0, 20.0, 21.0, 22.0, 23.0, 23.5, 24.0)
FLOW = (18.0, 19.0, 20.0, 20.5, 21.0, 21.5, 22.0, 23.0)
LAW = "contact_share"  # the law that is asked too
LAW_ANGLES = {"rest": (19.0, 20.0, 21.0, 22.0, 23.0, 24.0), "flow": (19.0, 20.0, 21.0, 22.0, 23.0)}
# initial.velocity of flowing layers [m/s]: the mean of the grains' steady flow at 24 deg
FAST = 0.3
# sqrt(H/g), for grains 210 sqrt(d/g): by then a layer flows, or has come to rest
TIME = {"dem": 60.0, "mpm": 30.0}
SLOW = (21.5, 22.0)  # at which grains that flow take twice as long to come to an end
LAST = 10  # frames whose mean velocity is that at the end
BEGINS = {"rest": 0.0, "flow": FAST}
UNITS = (
    "begins: from rest, or with that initial.velocity; inclination [deg], end_time [sqrt(H/g)], "
    f"velocity_at_end [m/s], mean of {LAST} frames"
)


def plan(scene: case.Case) -> list[tuple[str, Task]]:
    """How each task begins, and the task."""
    out = []
    for begins, angles in (("rest", REST), ("flow", FLOW)):
        out += [(begins, task(scene, "dem", angle, begins)) for angle in angles]
    for begins, angles in LAW_ANGLES.items():
        out += [(begins, task(scene, "mpm", angle, begins)) for angle in angles]
    return out


def task(scene: case.Case, engine: str, angle: float, begins: str) -> Task:
    law = "" if engine == "dem" else LAW
    sets = [f"geometry.inclination={angle}", f"initial.velocity={BEGINS[begins]}"]
    time = TIME[engine] * (2.0 if engine == "dem" and begins == "flow" and angle in SLOW else 1.0)
    sets += [f"time.maximum={time}", "time.frame_interval=0.5"]
    sets += of_law(law) if law else ["output.contacts=false"]
    return Task(Recipe(engine, tuple(sets)), law, angle, scene["geometry.height"])


def row(scene: case.Case, begins: str, asked: Task) -> dict:
    """What a layer does: it is stopped, or flows on in one of the ways of compare/chute/flow.py."""
    found = {
        "engine": asked.recipe.engine,
        "law": asked.law,
        "begins": f"{BEGINS[begins]:g} m/s" if BEGINS[begins] else "rest",
        "inclination": asked.inclination,
    }
    run = sides.open_chute(result(scene, asked))
    velocity = np.array([sides.mean_velocity(cloud) for cloud in run.clouds])
    reason = str(run.attributes.get("end_reason", ""))
    state = state_of(sides.second_half(velocity)[1], run.height / run.time_scale)
    return found | {
        "end_reason": reason,
        "end_time": float(run.tau()[-1]),
        "state": "stopped" if reason == "rest" else state,
        "velocity_at_end": float(velocity[-LAST:].mean()) if reason != "rest" else velocity[-1],
        "cpu_seconds": run.attributes.get("cpu_seconds", np.nan),
    }


def table(scene: case.Case) -> pd.DataFrame:
    return pd.DataFrame([row(scene, *one) for one in plan(scene)])


def angles(found: pd.DataFrame, engine: str) -> dict[str, tuple[float, float]]:
    """Between which two of the inclinations that were tried a layer of an engine starts from rest,
    and one that flows stops: "start" and "stop", each the highest at which it stands (-inf: none)
    and the lowest above at which it flows (inf: none).
    """
    out = {}
    for name, begins in (("start", "rest"), ("stop", f"{FAST:g} m/s")):
        rows = found[(found["engine"] == engine) & (found["begins"] == begins)]
        stands = rows["state"] == "stopped"
        highest = float(rows["inclination"][stands].max()) if stands.any() else float("-inf")
        above = rows["inclination"][~stands & (rows["inclination"] > highest)]
        out[name] = (highest, float(above.min()) if len(above) else float("inf"))
    return out
