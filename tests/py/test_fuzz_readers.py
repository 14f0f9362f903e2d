"""Some hundred broken files for each reader of Python; more: python3 -m tests.fuzz.counts."""

import csv
import random

import pytest

from cases.errors import CaseError
from compare.importing import registry
from tests.fuzz import counts, mutate, readers

RUNS = 250
SLOW = {
    "run": 25,
    "grains": 25,
    "cb_geo": 50,
    "reference": 50,
}  # [executions], of HDF5 or many numbers


@pytest.mark.parametrize("name", sorted(readers.targets()))
def test_broken_files_are_read_or_refused(tmp_path, name):
    runs, faults = readers.hunt(name, SLOW.get(name, RUNS), 11, tmp_path)
    assert not faults, "\n".join(fault.what for fault in faults)
    assert runs == SLOW.get(name, RUNS)


@pytest.mark.parametrize("name", sorted(readers.targets()))
def test_the_files_they_come_from_are_good(tmp_path, name):
    """So that what is mutated gets past the first line of its reader."""
    target = readers.targets()[name]
    for file, data in target.files.items():
        (tmp_path / file).write_bytes(data)
    for file in target.files:
        target.read(tmp_path / file)


def test_every_reader_of_the_importing_is_there():
    assert registry.readers().keys() <= readers.targets().keys()


def fail(path):
    raise {b"0": KeyError, b"1": CaseError}.get(path.read_bytes(), ZeroDivisionError)("why")


def wait(path):
    sum(range(30_000_000))


@pytest.mark.parametrize(
    "read, shown", [(fail, "KeyError"), (wait, "took"), (lambda path: bytearray(1 << 40), "Memory")]
)
def test_faults_are_found(tmp_path, monkeypatch, read, shown):
    """The negative control: another exception, too long, too large."""
    monkeypatch.setattr(readers, "SECOND", 0.02)
    (tmp_path / "a").write_bytes(b"0")
    with readers.bounded():
        assert shown in str(readers.fault_of(readers.Target(read, {}), tmp_path / "a"))
        (tmp_path / "a").write_bytes(b"1")
        assert readers.fault_of(readers.Target(fail, {}), tmp_path / "a") is None


def test_a_seed_decides_the_files():
    """Of text and of bytes; most differ from the file they come from, and stay small."""
    data = b"".join(readers.targets()["text_dump"].files.values())
    for text in (True, False):
        first = [mutate.mutated(data, random.Random(k), text) for k in range(300)]
        assert first == [mutate.mutated(data, random.Random(k), text) for k in range(300)]
        assert len(set(first)) > 250 and max(map(len, first)) <= mutate.LONGEST


def test_counts_are_kept_by_name(tmp_path):
    table = tmp_path / "counts.csv"
    for name, executions in (("b", 1), ("a", 2), ("b", 3)):
        counts.record(counts.row_of(name, executions, 1.0, 1, 0), table)
    with table.open() as file:
        rows = [(one["name"], one["executions"]) for one in csv.DictReader(file)]
    assert rows == [("a", "2"), ("b", "3")]
