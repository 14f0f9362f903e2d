"""Stability maps: planes of what makes a method fail, their measured boundaries, and the failures
known by name.
"""

import math
from pathlib import Path

import pandas as pd

from cases.case import Case
from compare.mapping.reductions import integral
from compare.study import impact
from compare.study.failure import warnings_of
from compare.study.quantities import label
from compare.study.recipe import Recipe, assignment
from compare.study.signature import expand

POINT_ALONE = math.sqrt(2.0 / 3.0)  # share of the limit of the bulk that holds for a single point


def rows_of(plane: dict, timeout: float) -> list[tuple[float, dict]]:
    """A plane's rows: the value of its second key, and the task that finds the boundary there."""
    fixed = [assignment(key, value) for key, value in plane.get("set", {}).items()]
    out = []
    for value in plane["values"]:
        sets = fixed if plane["engine"] == "dem" else [*fixed, assignment(plane["across"], value)]
        recipe = Recipe(plane["engine"], tuple(sets), plane["name"], timeout)
        task = {"recipe": recipe.as_json(), "along": plane["along"], "between": plane["between"]}
        out.append(
            (
                value,
                task
                | (
                    {"speed": value, "tolerance": plane["tolerance"]}
                    if plane["engine"] == "dem"
                    else {}
                ),
            )
        )
    return out


def default_of(plane: dict, scene: Case) -> float:
    """What the plane's first key is when nobody says anything."""
    return float(plane.get("set", {}).get(plane["along"], scene[plane["along"]]))


def table(planes: list[dict], rows: list[list[tuple[float, dict]]], scene: Case) -> pd.DataFrame:
    """One line per run of every row, with the row's boundary and how far inside it the default and
    the claimed limit lie.
    """
    out = []
    for plane, found in zip(planes, rows):
        for value, row in found:
            for run in row["runs"]:
                out.append(
                    {
                        "plane": plane["name"],
                        "along": plane["along"],
                        "value": run["value"],
                        "across": plane["across"],
                        "across_value": value,
                        "status": run["status"],
                        "stable_to": row["good"],
                        "fails_from": row["bad"],
                        "times_default": row["good"] / default_of(plane, scene),
                        "times_limit": row["good"] / limit(plane, value, scene),
                        "warnings": run.get("warnings", "none"),
                        "message": run.get("message", ""),
                        "command": run.get("command", ""),
                    }
                )
    return pd.DataFrame(out)


def limit(plane: dict, value: float, scene: Case) -> float:
    """The claimed limit of a row: what holds for a point alone, the stiffest that scattered points
    make (mpm.time_step_fraction); of the grains, ten steps in a contact.
    """
    if plane["engine"] == "mpm":
        return POINT_ALONE
    sets = tuple(assignment(key, v) for key, v in plane.get("set", {}).items())
    return min(0.25, impact.least_steps_fraction(scene.path, sets, value))


def relaxation_limit(plane: dict, value: float, scene: Case) -> float:
    """Share of the bulk's limit at which an explicit step of granular temperature overshoots zero,
    where the plane takes one and its rows are cell sizes; NaN elsewhere. At e <= e_c, with L = d:
    (3/2) kap T_dot = -Q T, so dt = 3/2 kap/Q with kap = 24/(5 sqrt(pi)) sqrt(rho/E), Q = 12 (1 -
    ee^2)/(sqrt(pi) d) (mpm/materials/kinetic_theory.hpp); the bulk's limit there is that of the
    critical-state locus, h/(c sqrt(2)), c = sqrt(a_L E/rho).
    """
    if (
        plane.get("set", {}).get("material.temperature_update") != "explicit"
        or plane["across"] != "mpm.cell_size"
    ):
        return math.nan
    density, modulus = scene["grains.density"], (
        scene["mpm.young_modulus"] or scene["grains.young_modulus"]
    )
    softness = 24.0 / (5.0 * math.sqrt(math.pi)) * math.sqrt(density / modulus)
    loss = (
        12.0
        * (1.0 - scene["material.effective_restitution"] ** 2)
        / (math.sqrt(math.pi) * scene["grains.diameter"])
    )
    wave = math.sqrt(scene["material.critical_state_slope"] * modulus / density)
    return 1.5 * softness / loss * wave * math.sqrt(2.0) / value


def damping(point: dict, scene: Case) -> float:
    """Rate at which numerics eat kinetic energy: energy lost over the time integral of kinetic
    energy [1/sqrt(H/g)].
    """
    run = expand(point, scene)
    return float(run.energy["unaccounted"][-1] / integral(run.energy["kinetic"], run.energy_tau()))


def recipes_of(failure: dict, timeout: float) -> tuple[Recipe, Recipe]:
    """The recipe that shows a named failure and the same with the defaults in place of what it
    changes.
    """
    where = [assignment(key, value) for key, value in failure.get("where", {}).items()]
    cause = [assignment(key, value) for key, value in failure["set"].items()]
    return (
        Recipe("mpm", tuple(where + cause), failure["name"], timeout),
        Recipe("mpm", tuple(where), failure["name"], timeout),
    )


def trend_recipes(trend: dict, timeout: float) -> list[Recipe]:
    """A trend's recipes: one for each value of the key that it goes along."""
    fixed = [assignment(key, value) for key, value in trend["set"].items()]
    return [
        Recipe("mpm", (*fixed, assignment(trend["along"], value)), trend["name"], timeout)
        for value in trend["values"]
    ]


def detected(point: dict) -> str:
    """What a run was found to suffer from, in the solver's own words; empty when from nothing."""
    return (
        point["message"].split(": ", 1)[-1]
        if point["status"] != "ok"
        else ""
        if point["warnings"] == "none"
        else point["warnings"]
    )


def shows(point: dict, expected: str) -> bool:
    """Whether a run suffers from the class of failure or the warning named."""
    return point["status"] == expected or (
        point["status"] == "ok" and expected in warnings_of(point["warnings"])
    )


def failure_table(
    failures: list[dict], points: list[tuple[dict, dict]], scene: Case
) -> pd.DataFrame:
    """Each named failure: whether its recipe shows it and the default does not."""
    out = []
    for failure, (caused, default) in zip(failures, points):
        recipe = Recipe.of(caused["recipe"])
        out.append(
            {
                "failure": failure["name"],
                "expected": failure["expect"],
                "recipe": recipe.label,
                "reproduced": shows(caused, failure["expect"]),
                "detected": detected(caused),
                "absent_at_defaults": default["status"] == "ok"
                and not shows(default, failure["expect"]),
                "defaults_say": detected(default),
                "command": recipe.command(Path(scene.path.parent)),
            }
        )
    return pd.DataFrame(out)


def trend_table(trends: list[dict], points: list[list[dict]], scene: Case) -> pd.DataFrame:
    """Damping by the numerics as the step shrinks, for each transfer; NaN where the run failed."""
    out = []
    for trend, found in zip(trends, points):
        for value, point in zip(trend["values"], found):
            out.append(
                {
                    "trend": trend["name"],
                    "key": trend["along"],
                    "value": value,
                    "status": point["status"],
                    "damping": damping(point, scene) if point["status"] == "ok" else math.nan,
                    "command": Recipe.of(point["recipe"]).command(Path(scene.path.parent)),
                }
            )
    return pd.DataFrame(out)


def sentences(plane: dict, rows: list[tuple[float, dict]], scene: Case) -> list[str]:
    """What a plane says: the least margin of the claimed limit and of the default."""
    quantity = label(plane["along"]).replace("\n", " ")
    good = [row["good"] for _, row in rows]
    limits = [row["good"] / limit(plane, value, scene) for value, row in rows]
    beyond = " or more" if any(math.isinf(row["bad"]) for _, row in rows) else ""
    failures = sorted({run["status"] for _, row in rows for run in row["runs"]} - {"ok"})
    if any(math.isnan(value) for value in good):
        return [
            f"unstable already at {plane['between'][0]:g} in {sum(map(math.isnan, good))} of "
            f"{len(good)} rows ({', '.join(failures)})"
        ]
    return [
        f"stable to {min(good):.2g}–{max(good):.2g}{beyond} ({quantity}): "
        f"at least {min(limits):.2g} times the claimed limit, "
        f"{min(good) / default_of(plane, scene):.2g} times the default",
        f"beyond it: {', '.join(failures)}" if failures else "no failure within the range",
    ]
