"""What the grains of a case will take, their packing included, before anything is poured."""

from math import pi, sqrt

from cases import cost
from cases.cost import Cost
from cases.scenes import floor_length

from . import packing, scene
from .base import rough_count
from .plan import Plan
from .grains import Grains


def estimate(case: dict) -> Cost:
    """Of the tables of a case; a packing that is kept costs less. Raises CaseError where no step
    resolves the contacts.
    """
    rate, grains, plan = cost.rates()["grains"], Grains.of(case), Plan.of(case)
    moving = packing.nominal_count(case, grains)
    count = moving + glued_count(case, grains)
    contacts = rate["contacts"] * moving
    poured = packing_steps(case, grains, plan, rate)
    samples = plan.last / plan.sample
    seconds = (
        1e-9
        * count
        * (
            poured * rate["packing_step"]
            + plan.last * rate["collapse_step"]
            + samples * rate["sample"]
        )
    )
    frames = plan.last / plan.frame + 1
    kept = rate["disk_per_contact"] * contacts if case["output"]["contacts"] else 0.0
    frame = rate["disk_per_frame"] + rate["disk_per_grain"] * count + kept
    return Cost(
        {"grains": round(count), "contacts": round(contacts)},
        plan.dt,
        poured + plan.last,
        rate["bytes"] + rate["bytes_per_grain"] * count,
        seconds + samples * rate["seconds_per_sample"],
        frames * frame,
    )


def glued_count(case: dict, grains: Grains) -> float:
    """Of the base, without placing them (scene.glued_base)."""
    if case["walls"]["base"] != "glued":
        return 0.0
    d, length = grains.diameter, floor_length(case["geometry"])
    if scene.chute(case):
        return rough_count(length, scene.width(case), d)
    area = scene.width(case) * length * (pi / 4 if scene.axisymmetric(case) else 1.0)
    return area / (scene.BASE_SPACING * d * d)


def packing_steps(case: dict, grains: Grains, plan: Plan, rate: dict) -> float:
    """Of as many attempts as a packing usually takes: softer grains that fall, and then rest."""
    gravity, dem = case["geometry"]["gravity"], case["dem"]
    softer = Grains.of(case, min(dem["packing_young_modulus"], grains.young_modulus))
    count = packing.POUR_SURPLUS * packing.nominal_count(case, grains)
    _, top = scene.pouring(case, grains, round(count), 1)
    terminal = (
        grains.mass * gravity / max(packing.drag(case, grains, dem["packing_damping"]), 1e-300)
    )
    settling = sqrt(2 * top / gravity) + top / terminal
    softer_step = dem["time_step_fraction"] * softer.rayleigh_time()
    one = rate["settling"] * settling / softer_step + rate["resting"] * plan.scale / plan.dt
    return min(rate["packing_attempts"], dem["packing_attempts"]) * one


def refuse_more_than_there_is(case: dict):
    """Raises CaseError where the grains take more memory than there is."""
    cost.refuse_more_than_there_is(
        f"grains.diameter: {Grains.of(case).diameter:g} m", estimate(case), "choose larger grains"
    )
