"""A run of both engines, and what came out of comparing them."""

import json
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from cases import reading
from cases.errors import CaseError, EngineError
from compare.mapping.runs import Fields, open_fields
from compare.verdict import comparison, conclusion, controls, verdict_table
from grainpair.result import Result

AXES = "zyx"  # the order of a field's dimensions


class Pair:
    """The folder of a paired run: `mpm` and `dem` are the Results that the report shows, `all_mpm`
    and `all_dem` every one, an ensemble's other packings too.
    """

    def __init__(self, folder: Path):
        """Raises CaseError where the folder lacks a side."""
        self.folder = folder
        mpm, dem = comparison.run_files(folder)
        self.all_mpm, self.all_dem = [Result(one) for one in mpm], [Result(one) for one in dem]
        self.mpm, self.dem = self.all_mpm[0], self.all_dem[0]

    def __repr__(self) -> str:
        return f"<grainpair.Pair {self.folder}: {len(self.all_mpm)} mpm, {len(self.all_dem)} dem>"

    @cached_property
    def metrics(self) -> dict[str, dict]:
        """metrics.json: for each metric its unit, definition and figures, with the verdict where it
        has a margin; beside them "verdict" and "findings". Raises CaseError where it is not there.
        """
        path = self._made("metrics.json")
        try:
            return json.loads(path.read_text())
        except (OSError, ValueError) as error:
            raise CaseError(f"{path}: cannot be read ({error})") from error

    @property
    def verdict(self) -> str:
        """The verdict in a few words, as the report has it."""
        return conclusion.headline(self.metrics)

    @property
    def verdicts(self) -> pd.DataFrame:
        """A row for each metric that has a margin, under its name: unit, both sides, their
        difference, what it is uncertain by, margin, verdict, and the negative controls'.
        """
        return verdict_table.table(self.metrics).set_index("metric")

    @property
    def findings(self) -> list[dict]:
        """What spoils the result or is to be known of it: severity, sentence, advice."""
        return self.metrics["findings"]["list"]

    def recomputed(self) -> dict[str, dict]:
        """What `metrics` holds, computed anew from frames, energies and fields.h5 by the functions
        that the report uses; seconds. Nothing is written.
        """
        self._made("fields.h5")
        both = comparison.load(self.folder)
        return conclusion.conclude(both, controls.judge_all(both, self.folder))

    def arrays(self, name: str = "dem") -> Fields:
        """The fields mapped from a run, as numpy: arrays("mpm")["density"] is (frames, ny, nx), a
        vector (frames, ny, nx, 3), a tensor (frames, ny, nx, 3, 3); NaN where it is undefined.
        `time` (frames,) [s]; grid.x, grid.y: centres of the cells [m]. `name` is a result file's.
        """
        path = self._of(name)
        return open_fields(path, name)

    def fields(self, name: str = "dem"):
        """The same as an xarray.Dataset over time, y and x, with units and what is meant in the
        attributes of each field. Raises EngineError where xarray is not installed.
        """
        try:
            import xarray
        except ModuleNotFoundError as error:
            raise EngineError(
                "xarray: no such module (not installed) install the package python3-xarray, or "
                "take arrays(…), which needs none"
            ) from error
        path = self._of(name)
        with reading.result(path) as file:
            grid, told = reading.group(file, "grid"), reading.group(file, name)
            axes = [axis for axis in AXES if axis in grid]
            coordinates = {axis: ([axis], grid[axis][:], {"units": "m"}) for axis in axes}
            coordinates["time"] = (["time"], told["time"][:], {"units": "s"})
            parts = ["r", "y", "angle"] if "angle" in grid.attrs else list("xyz")
            coordinates["component"] = (["component"], np.array(parts), {})
            data = {}
            for field in (one for one in told if one != "time"):
                values = told[field][()]
                more = ["component", "along"][: values.ndim - 1 - len(axes)]
                about = reading.attributes(told[field])
                attrs = {"units": about.get("unit", ""), "long_name": about.get("doc", "")}
                data[field] = (["time", *axes, *more], values, attrs)
            return xarray.Dataset(data, coordinates, reading.attributes(file))

    def _of(self, name: str) -> Path:
        """fields.h5, which must hold fields of the run `name`."""
        path = self._made("fields.h5")
        with reading.result(path) as file:
            known = [one for one in file if one != "grid"]
        if name not in known:
            raise CaseError(f"{path}: no fields of {name} (there are those of {', '.join(known)})")
        return path

    def _made(self, name: str) -> Path:
        path = self.folder / name
        if not path.exists():
            raise CaseError(
                f"{path}: not there (not compared yet) make it with: ./grainpair compare "
                f"{self.folder}"
            )
        return path
