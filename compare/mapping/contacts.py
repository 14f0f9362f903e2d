"""Contacts of the grains, as their frames hold them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import h5py
import numpy as np

from cases import reading
from cases.errors import CaseError
from compare.mapping.clouds import StoredClouds
from compare.mapping.runs import Run, about_axis

FLOOR = -3  # a contact's second, where that is a smooth base
MOVING = 0.02  # of sqrt(g H), along the base


@dataclass(frozen=True)
class Contacts:
    """Of one frame: ids of `first` and `second` (C,), and what reads a column of them, "force/x",
    and the record that was asked for of grains by their ids.
    """

    first: np.ndarray
    second: np.ndarray
    column: Callable[[str], np.ndarray]
    of: Callable[[np.ndarray], np.ndarray]


def frames(run: Run, record: str) -> Iterator[Contacts]:
    """The contacts of each frame that holds contacts and `record` of its grains. Raises CaseError
    where columns differ in length or a contact is of a grain that is not there.
    """
    clouds = run.clouds
    if not isinstance(clouds, StoredClouds):
        return
    with reading.result(clouds.path) as f:
        for step in clouds.steps:
            frame = reading.group(f, f"data/{step}")
            cloud = reading.group(frame, "particles/cloud")
            if "contacts" not in frame or record not in cloud:
                continue
            yield contacts_of(reading.group(frame, "contacts"), cloud, record)


def contacts_of(group: h5py.Group, cloud: h5py.Group, record: str) -> Contacts:
    ids = reading.whole(cloud, "id")
    values, order = reading.values(cloud, record, len(ids)), np.argsort(ids)
    ids, values = ids[order], values[order]
    first = reading.whole(group, "first")
    second = reading.whole(group, "second", len(first))
    unknown = np.setdiff1d(np.concatenate([first, second[second > 0]]), ids)
    if len(unknown):
        raise CaseError(f"{reading.where(group)}: of a grain {unknown[0]} that is not in its frame")
    return Contacts(
        first,
        second,
        lambda name: reading.values(group, name, len(first)),
        lambda of: values[np.searchsorted(ids, of)],
    )


def largest_overlap(run: Run) -> float:
    """Largest overlap of two grains over the frames [d]; zero where frames hold no contacts."""
    most = 0.0
    for contacts in frames(run, "radius"):
        grains = contacts.second > 0  # walls have negative numbers
        branch = np.stack([contacts.column(f"branch/{k}") for k in "xyz"], axis=-1)[grains]
        touching = contacts.of(contacts.first[grains]) + contacts.of(contacts.second[grains])
        overlap = touching - np.linalg.norm(branch, axis=1)
        most = max(most, float(overlap.max(initial=0.0)) / run.diameter)
    return most


def base_friction(run: Run) -> float:
    """Friction that a smooth base exerts where grains move along it: sums of tangential over normal
    forces of the contacts whose grain is faster than MOVING, all frames together. NaN where the
    frames hold no such contact, and about an axis.
    """
    if about_axis(run.case):
        return float("nan")  # forces are told along x, y, z
    least = MOVING * np.sqrt(run.case["geometry.gravity"] * run.height)
    along = across = 0.0
    for contacts in frames(run, "velocity/x"):
        floor = contacts.second == FLOOR
        speed = contacts.of(contacts.first[floor])
        x, y = (contacts.column(f"force/{k}")[floor] for k in "xy")
        moves = np.abs(speed) > least
        along -= float(np.sum((np.sign(speed) * x)[moves]))
        across += float(np.sum(y[moves]))
    return along / across if across > 0.0 else float("nan")
