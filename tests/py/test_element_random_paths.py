"""Random paths of strain and rest: energies balance and nothing is created.

Shrunk by hypothesis where one fails.
"""
import json
import subprocess

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases.programs import ROOT, program

pytestmark = pytest.mark.skipif(not program("mpm_point").exists(), reason="mpm_point is not built")

number = st.floats(-1.0, 1.0, allow_nan=False)
leg = st.fixed_dictionaries(
    {
        "strain": st.lists(number, min_size=6, max_size=6),
        "decade": st.integers(-6, -1),  # of the strain's size
        "rate": st.sampled_from([0.1, 10.0, 1000.0]),  # largest component of D [1/s]
        "steps": st.integers(1, 40),
        "rest": st.booleans(),
    }
)
path = st.fixed_dictionaries(
    {
        "law": st.sampled_from(
            [
                "linear_elastic",
                "drucker_prager",
                "mu_i",
                "lade_duncan",
                "critical_state",
                "solid_fluid",
                "contact_share",
            ]
        ),
        "correlation_length": st.sampled_from(["berzi", "softened"]),
        "card": st.sampled_from(["seed_table1", "dem_mu05"]),
        "void_ratio": st.floats(0.6, 0.8),
        "pressure": st.sampled_from([10.0, 1e3, 1e5]),
        "legs": st.lists(leg, min_size=1, max_size=4),
    }
)


def drive(given_path: dict, folder, *extra: str) -> dict:
    named = ("law", "card", "correlation_length")
    settings_ = [f"material.{key}={given_path[key]}" for key in named] + [*extra]
    text = [
        f"case = {json.dumps(str(ROOT / 'cases' / 'column'))}",
        f"set = {json.dumps(settings_)}",
        "[start]",
        f"void_ratio = {given_path['void_ratio']!r}",
        f"pressure = {given_path['pressure']!r}",
    ]
    for one in given_path["legs"]:
        size = 10.0 ** one["decade"]
        duration = max(size / one["rate"], 1e-9)
        text += [
            "[[leg]]",
            'path = "strain"',
            f"duration = {duration!r}",
            f"steps = {one['steps']}",
            f"rate = {[x * size / duration for x in one['strain']]}",
        ]
        if one["rest"]:
            text += ["[[leg]]", 'path = "rest"', "duration = 1e-3", "steps = 5"]
    (folder / "path.toml").write_text("\n".join(text) + "\n")
    done = subprocess.run(
        [program("mpm_point"), folder / "path.toml", "-o", folder / "point.h5"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    with h5py.File(folder / "point.h5") as file:
        return {
            name: file[name][:]
            for name in (
                "work",
                "stored",
                "fluctuation",
                "plastic_dissipation",
                "regime_4_dissipation",
                "contact_dissipation",
                "granular_temperature",
                "regime",
                "p_q",
            )
        }


def dissipated(r: dict) -> np.ndarray:
    return sum(r[f"{kind}_dissipation"] for kind in ("plastic", "regime_4", "contact"))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(path)
def test_random_paths_balance_and_dissipate(tmp_path_factory, given_path):
    """Work = change of the energies held + dissipated, to round-off of what passed through.

    Dissipations never fall.
    """
    r = drive(given_path, tmp_path_factory.getbasetemp())
    held, gone = r["stored"] + r["fluctuation"], dissipated(r)
    turnover = held[0] + np.cumsum(np.abs(np.diff(r["work"], prepend=0.0))) + held + gone
    assert np.all(np.abs(r["work"] - (held - held[0]) - gone) <= 1e-12 * turnover)
    assert np.all(np.diff(r["plastic_dissipation"]) >= -1e-14 * turnover[1:])
    assert np.all(np.diff(r["regime_4_dissipation"]) >= 0.0)
    assert np.all(np.diff(r["contact_dissipation"]) >= 0.0)
    assert np.all(r["granular_temperature"] >= 0.0) and np.all(held >= 0.0)
    if given_path["law"] not in ("linear_elastic",):
        assert np.all(r["p_q"] >= 0.0)  # no cohesion


def test_a_path_that_creates_energy_is_seen(tmp_path):
    """The check above can fail: an explicit temperature with long steps does not balance."""
    shear = {
        "strain": [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        "decade": -1,
        "rate": 10.0,
        "steps": 40,
        "rest": False,
    }
    r = drive(
        {
            "law": "solid_fluid",
            "card": "seed_table1",
            "correlation_length": "berzi",
            "void_ratio": 0.8,
            "pressure": 0.0,
            "legs": [shear],
        },
        tmp_path,
        "material.temperature_update=explicit",
    )
    held, gone = r["stored"] + r["fluctuation"], dissipated(r)
    turnover = held[0] + np.cumsum(np.abs(np.diff(r["work"], prepend=0.0))) + held + gone
    assert not np.all(np.abs(r["work"] - (held - held[0]) - gone) <= 1e-12 * turnover)
