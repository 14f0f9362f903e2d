"""Small members of the element tests, run for real."""
from dataclasses import replace

import numpy as np
import pytest

from cases.errors import EngineError
from cases.programs import ROOT
from compare.element import campaign, records
from compare.element.case import Case
from compare.element.tests import cooling, reversal, shear, triaxial


def case(test):
    return Case(ROOT / "cases" / test)


def test_frictionless_cooling_follows_haff(tmp_path):
    """d(T^-1/2)/dt of a dilute frictionless gas is that of kinetic theory within 10 %.

    Five seeds scatter by 3 %.
    """
    this = case("cooling")
    point = campaign.points(this)[0] | {
        "friction": 0.0,
        "solid_fraction": 0.3,
        "seed": 5,
        "cooling_times": 3.0,
        "grains": 400,
    }
    rows = cooling.run(this.grains, point, tmp_path)
    time = np.array([row["time"] for row in rows])
    inverse = np.array([row["temperature"] for row in rows]) ** -0.5
    assert rows[0]["temperature"] == pytest.approx(point["granular_temperature"], rel=1e-12)
    slope, offset = np.polyfit(time, inverse, 1)
    grains = this.grains
    theory = cooling.haff_rate(0.3, grains.restitution, 0.01, grains.diameter) / np.sqrt(0.01)
    assert slope == pytest.approx(theory, rel=0.10)
    # A straight line, as Haff has it.
    assert np.abs(slope * time + offset - inverse).max() < 0.05 * inverse.max()
    # The control: elastic grains would not cool, grains of e = 0.7 cool more than twice as fast.
    assert theory < 0.6 * cooling.haff_rate(0.3, 0.7, 0.01, grains.diameter) / np.sqrt(0.01)


def test_a_shear_point_reproduces_the_reference(tmp_path):
    """A seed the reference does not hold falls into its scatter.

    That is, 4 standard deviations of one run (p = 6e-5 for a Gaussian).
    """
    this = case("shear")
    reference = records.read(records.reference_file(this))

    def at(solid_fraction):
        return [
            row
            for row in reference
            if (row["solid_fraction"], row["shear_rate"]) == (solid_fraction, 500.0)
        ]

    known = at(0.5)
    point = campaign.points(this)[0] | {"solid_fraction": 0.5, "shear_rate": 500.0, "seed": 7}
    (measured,) = shear.run(this.grains, point, tmp_path)
    for name in shear.MEASURED:
        mean = np.mean([row[name] for row in known])
        one_run = np.sqrt(np.mean([row[f"{name}_error"] ** 2 for row in known]))
        assert abs(measured[name] - mean) < 4 * one_run * np.sqrt(1 + 1 / len(known)), name
    # A neighbouring void ratio is told apart.
    other = np.mean([row["pressure"] for row in at(0.4)])
    assert abs(measured["pressure"] - other) > 20 * measured["pressure_error"]


def test_grains_that_resist_rolling_jam_sooner(tmp_path):
    """Dense, 200 grains: five times the pressure of plain ones (190 against 39 kPa, which scatter
    by a sixth), and a higher stress ratio. Contacts keep a history of one size from the first run
    on: with the spring added after growth LAMMPS tells less pressure than of plain grains.
    """
    this = case("shear")
    point = campaign.quick_point(this) | {"solid_fraction": 0.58, "shear_rate": 200.0}
    point |= {"strain": 3.0, "strain_discarded": 1.0}
    found = {}
    for rolling in (0.0, 0.1):
        grains = replace(this.grains, rolling_friction=rolling)
        words = shear.GROWN.format(**shear.grown(grains, point, 1.0, 1.0))
        assert words.count("rolling sds") == (2 if rolling else 0)
        folder = tmp_path / str(rolling)
        folder.mkdir()
        (found[rolling],) = shear.run(grains, point, folder)
    assert found[0.1]["pressure"] > 2.0 * found[0.0]["pressure"]
    ratio = {mu: row["shear_stress"] / row["pressure"] for mu, row in found.items()}
    assert ratio[0.1] > 1.05 * ratio[0.0]


def test_the_servo_holds_the_lateral_stress(tmp_path):
    this = case("triaxial")
    point = campaign.points(this)[0] | {
        "pressure": 50e3,
        "preparation_friction": 0.0,
        "grains": 150,
        "axial_strain": 0.1,
        "samples": 10,
        "inertial_number": 2e-3,
    }
    rows = triaxial.run(this.grains, point, tmp_path)
    assert rows[-1]["axial_strain"] == pytest.approx(0.1, rel=0.15)
    # Each stress drop of 150 grains takes a tenth, so the mean after the start is held to;
    # proportional control is 27 % off.
    assert np.mean([row["lateral_stress"] for row in rows[5:]]) == pytest.approx(50e3, rel=0.05)
    ratio = [
        3
        * (row["axial_stress"] - row["lateral_stress"])
        / (row["axial_stress"] + 2 * row["lateral_stress"])
        for row in rows
    ]
    assert abs(ratio[0]) < 0.2 and max(ratio) > 0.7  # from isotropic to sheared
    # The frictionless preparation is dense: it dilates.
    assert rows[-1]["void_ratio"] > rows[0]["void_ratio"]


def test_an_engine_that_stops_says_why(tmp_path):
    this = case("shear")
    point = campaign.points(this)[0] | {
        "shear_rate": 500.0,
        "grains": 50,
        "strain": 1.0,
        "strain_discarded": 0.9,
    }
    with pytest.raises(EngineError, match="no steady state was averaged"):
        shear.run(this.grains, point, tmp_path)
    rows = campaign.run_point(this, point)
    assert rows[0]["status"].startswith("failed: ") and rows[0]["seed"] == point["seed"]


def test_a_reversal_takes_the_structure_of_the_grains_apart(tmp_path):
    """Of a few grains, fast: pressure builds up with strain, falls when the flow turns, comes back.

    The shear stress is that of the flow's new sense, and is behind. Factors of 2 where ten times
    as many grains show 10.
    """
    this = case("reversal")
    point = campaign.points(this)[0] | {
        "solid_fraction": 0.59,
        "shear_rate": 200.0,
        "grains": 300,
        "seed": 7,
    }
    rows = reversal.run(this.grains, point, tmp_path)
    (_, pressure, ratio), (_, turned, turned_ratio) = (reversal.curve(rows, i) for i in (0, 1))
    assert pressure[0] < 0.5 * pressure[-1]
    assert turned[3:6].min() < 0.5 * min(pressure[-1], turned[-1])
    assert turned_ratio[0] < 0.5 * ratio[-1] < turned_ratio[-1]
