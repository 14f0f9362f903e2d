"""A run in one line: the scalars an ensemble is made of."""

from pathlib import Path

import numpy as np

from cases import reading
from cases.case import parse
from cases.scenes import refuse_chute

# name -> unit; energies are relative to the potential energy released, times to sqrt(H/g), lengths
# to L0 or H
SCALARS = {
    "seed": "-",
    "run_out": "L0",
    "run_out_99": "L0",
    "highest_grain_at_wall": "H",
    "kinetic_energy_peak": "E0",
    "kinetic_energy_peak_time": "sqrt(H/g)",
    "released": "J",
    "dissipated_normal": "released",
    "dissipated_tangential": "released",
    "dissipated_wall": "released",
    "dissipated_short": "released",
    "dissipated_enduring": "released",
    "enduring_half_threshold": "released",
    "enduring_double_threshold": "released",
    "unaccounted": "released",
    "rotational_peak": "released",
    "fluctuation_peak": "released",
    "void_ratio": "-",
    "lateral_stress_ratio": "-",
    "coordination": "-",
    "grains": "-",
    "end_time": "sqrt(H/g)",
    "kinetic_energy_end": "peak",
    "cpu_seconds": "s",
    "cpu_seconds_engine": "s",
}

# Those of scenes that have them alone: rolling resistance, a gate that rises.
OWN = {"dissipated_rolling": "released", "gate_work": "released"}
SHARES = (  # accounts of the history that are told by their last value, over the energy released
    "dissipated_normal",
    "dissipated_tangential",
    "dissipated_wall",
    "dissipated_short",
    "dissipated_enduring",
    "unaccounted",
)


def quantile(x: np.ndarray, mass: np.ndarray, share: float) -> float:
    """Where `share` of the mass (n,) has been passed, of grains at x (n,), sorted.

    Grains that are alike are counted, so that no round-off of their sum decides.
    """
    if np.ptp(mass) == 0.0:
        return float(x[int(np.ceil(share * x.size)) - 1])
    passed = np.cumsum(mass)
    return float(x[np.searchsorted(passed, share * passed[-1])])


def scalars(path: Path) -> dict[str, float]:
    """SCALARS of a dem.h5, and those of OWN that its scene has.

    E0 is the initial potential energy; run-outs are mass percentiles, 99.5 and 99. One grain
    decides highest_grain_at_wall, the top of the grains within 1.5 d of it; the height of a deposit
    is compare's `final_height`. Of an axisymmetric column x is the distance from the axis.
    """
    with reading.result(path) as file:
        told = reading.attributes(file)
        case = parse(told["case_resolved"], path)
        refuse_chute(case, "this table is one")
        length, height = case["geometry.length"], case["geometry.height"]
        scale = reading.number(file, "time_scale")
        accounts = reading.group(file, "energy")
        energy = reading.columns(accounts, ("time", "kinetic", *accounts), ("unaccounted",))
        frame = reading.group(file, f"data/{max(map(int, file['data']))}/particles/cloud")
        grains = reading.values(frame, "kind") == 1
        reach, y, z = reading.vectors(frame, "position", len(grains))[grains].T
        radius = reading.values(frame, "radius", len(grains))[grains]
        nominal = 0.5 * case["grains.diameter"] * case["dem.coarsening"]
        if case["geometry.dimension"] == "axisymmetric":
            reach = np.hypot(reach, z)
        near_wall = reach < 3 * nominal
        order = np.argsort(reach, kind="stable")
        x, mass = reach[order], radius[order] ** 3
        released = energy["potential"][0] - energy["potential"][-1]
        peak = int(energy["kinetic"].argmax())
        out = {
            "seed": told["seed"],
            "run_out": quantile(x, mass, 0.995) / length - 1,
            "run_out_99": quantile(x, mass, 0.99) / length - 1,
            "highest_grain_at_wall": (y + radius)[near_wall].max() / height,
            "kinetic_energy_peak": energy["kinetic"][peak] / energy["potential"][0],
            "kinetic_energy_peak_time": energy["time"][peak] / scale,
            "released": released,
            "rotational_peak": energy["rotational"].max() / released,
            "fluctuation_peak": energy["fluctuation"].max() / released,
            "kinetic_energy_end": energy["kinetic"][-1] / energy["kinetic"][peak],
            "end_time": energy["time"][-1] / scale,
            "cpu_seconds": told["cpu_seconds"],
            "cpu_seconds_engine": told.get("cpu_seconds_engine", np.nan),
            **{
                name: file["packing"].attrs[name]
                for name in ("void_ratio", "lateral_stress_ratio", "coordination", "grains")
            },
        }
        for name in SHARES:
            out[name] = energy[name][-1] / released if name in energy else np.nan
        own = {name: energy[name][-1] / released for name in OWN if name in energy}
        for k, name in ((0, "enduring_half_threshold"), (2, "enduring_double_threshold")):
            out[name] = (
                file["lifetime/dissipated_enduring"][-1, k] / released
                if "lifetime" in file
                else np.nan
            )
    return {name: float(out[name]) for name in SCALARS} | {k: float(v) for k, v in own.items()}
