"""Result files bit by bit: all that a run decides, without what it took and who asked for it."""

from pathlib import Path

import h5py
import numpy as np

TAKEN = ("cpu_seconds", "wall_seconds", "date", "machine", "command")


def bits(path: Path) -> dict[str, bytes]:
    """Every dataset and attribute of a file, by its place."""
    found: dict[str, bytes] = {}

    def note(place: str, one) -> None:
        for name, value in one.attrs.items():
            if not name.startswith(TAKEN):
                found[f"{place}@{name}"] = np.asarray(value).tobytes()
        if isinstance(one, h5py.Dataset):
            found[place] = str((one.dtype, one.shape)).encode() + one[()].tobytes()

    with h5py.File(path) as file:
        note("", file)
        file.visititems(note)
    return found


def differences(one: Path, other: Path) -> list[str]:
    """Places in which two files differ."""
    a, b = bits(one), bits(other)
    return sorted(place for place in a.keys() | b.keys() if a.get(place) != b.get(place))
