"""What runs beside what: all cores busy, and no more."""

import pytest

from cases import cores, memory

MANY = 1_000_000  # points


@pytest.mark.parametrize("count", [1, 2, 3, 4, 8, 64])
@pytest.mark.parametrize("seeds", [1, 5])
@pytest.mark.parametrize("waits", [False, True])
@pytest.mark.parametrize("siblings", [False, True])
@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_all_cores_are_busy_and_no_more(count, seeds, waits, siblings, ranks):
    """But for fewer than another rank of each would take."""
    plan = cores.plan(count, MANY, seeds, siblings=siblings, waits=waits, ranks=ranks)
    assert plan.busy <= max(count, ranks) and plan.busy > count - ranks
    assert plan.grains >= 1 and plan.threads >= 1


def test_ranks_take_a_core_each():
    plan = cores.plan(8, MANY, 2, siblings=True, waits=False, ranks=2)
    assert plan == cores.Plan(2, 1, beside=True, siblings_beside=True, ranks=2)
    plan = cores.plan(8, MANY, 9, siblings=False, waits=True, ranks=2)
    assert plan == cores.Plan(4, 4, beside=False, siblings_beside=False, ranks=2)
    plan = cores.plan(2, MANY, 3, siblings=True, waits=False, ranks=2)  # one after the other
    assert plan == cores.Plan(1, 1, beside=False, siblings_beside=False, ranks=2)
    plan = cores.plan(2, MANY, 3, siblings=True, waits=False, ranks=4)  # as the user wants
    assert plan == cores.Plan(1, 1, beside=False, siblings_beside=False, ranks=4)


def test_a_small_continuum_is_not_torn_into_threads():
    assert cores.plan(64, 1600, 1, siblings=True, waits=False).threads == 1
    assert cores.plan(64, 8000, 1, siblings=True, waits=False).threads == 2


def test_what_the_user_asks_for_wins():
    plan = cores.plan(2, 1600, 1, siblings=True, waits=False, threads=7)
    assert (plan.threads, plan.siblings_beside) == (7, False)


def test_one_core_does_one_thing_at_a_time():
    plan = cores.plan(1, MANY, 3, siblings=True, waits=False)
    assert plan == cores.Plan(1, 1, beside=False, siblings_beside=False)


def test_jobs_have_memory():
    assert cores.jobs(bytes_each=1.0, cores=8) == 8
    assert cores.jobs(bytes_each=memory.available() / 2.5, cores=8) == 2
    assert cores.jobs(bytes_each=1e18, cores=8) == 1


@pytest.mark.parametrize(
    ("line", "folder", "files", "worth"),
    [
        ("0::/a/b", "", {"a/cpu.max": "150000 100000", "a/b/cpu.max": "max 100000"}, 2),
        (
            "4:cpu,cpuacct:/a",
            "cpu,cpuacct",
            {"a/cpu.cfs_quota_us": "50000", "a/cpu.cfs_period_us": "100000"},
            1,
        ),
        (
            "4:cpu,cpuacct:/a",
            "cpu,cpuacct",
            {"a/cpu.cfs_quota_us": "-1", "a/cpu.cfs_period_us": "100000"},
            16,
        ),
        ("0::/", "", {}, 16),
    ],
)
def test_a_quota_of_processor_time_counts(tmp_path, monkeypatch, line, folder, files, worth):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(16)))
    (tmp_path / "proc/self").mkdir(parents=True)
    (tmp_path / "proc/self/cgroup").write_text(line + "\n")
    for name, text in files.items():
        file = tmp_path / "sys/fs/cgroup" / folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    assert cores.usable(tmp_path) == worth
