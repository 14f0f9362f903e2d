"""The launcher's side of the progress protocol. The programs here are one-line shell scripts that
speak it.
"""

import time

import pytest

from cases import stages as engines
from cases.stages import Stage, run_chains, run_stages
from cases.errors import CaseError, EngineError


def shell(script: str, name: str = "stage") -> Stage:
    return Stage(name, ["sh", "-c", script])


def test_stages_that_end_well_raise_nothing_and_progress_is_said(capfd):
    run_stages([shell("echo progress 0.5 halfway; echo noise; echo progress 1 done")])
    lines = capfd.readouterr().err.splitlines()
    assert [line.split(" after")[0] for line in lines] == ["stage: 50 %", "stage: 100 %"]


def test_quiet_says_nothing(capfd):
    run_stages([shell("echo progress 0.5 halfway")], quiet=True)
    assert capfd.readouterr() == ("", "")


def test_code_2_is_bad_input_in_the_programs_own_words():
    with pytest.raises(CaseError, match="^case.toml:3: wrong$"):
        run_stages([shell("echo case.toml:3: wrong >&2; exit 2")], quiet=True)


def test_any_other_code_is_a_failed_engine_in_its_last_words():
    with pytest.raises(EngineError, match="^ERROR: lost atoms$"):
        run_stages([shell("echo first >&2; echo ERROR: lost atoms >&2; exit 3")], quiet=True)


def test_a_killed_engine_is_named_with_its_signal():
    with pytest.raises(EngineError, match="^stage: sh was killed by SIGSEGV$"):
        run_stages([shell("kill -SEGV $$")], quiet=True)


def test_a_missing_engine_is_named():
    with pytest.raises(EngineError, match="^/no/such/engine: no such program"):
        run_stages([Stage("stage", ["/no/such/engine"])], quiet=True)


def test_a_failure_ends_the_other_engine_and_what_it_started(tmp_path):
    alive = tmp_path / "alive"
    start = time.monotonic()
    with pytest.raises(EngineError, match="^gone$"):
        run_stages(
            [
                shell(f"(sleep 3; touch {alive}) & wait", "long"),
                shell("sleep 0.2; echo gone >&2; exit 3"),
            ],
            together=True,
            quiet=True,
        )
    assert time.monotonic() - start < 2
    time.sleep(3.2 - (time.monotonic() - start))
    assert not alive.exists()


def test_a_chain_runs_in_order_beside_the_others(tmp_path):
    order = tmp_path / "order"
    run_chains(
        [
            [shell(f"sleep 0.3; echo a >> {order}", "a"), shell(f"echo b >> {order}", "b")],
            [shell(f"echo c >> {order}", "c")],
        ],
        quiet=True,
    )
    assert order.read_text().split() == ["c", "a", "b"]


def test_a_dispensable_stage_ends_its_own_chain_alone(tmp_path):
    order = tmp_path / "order"
    failed = run_chains(
        [
            [
                Stage("first", ["sh", "-c", "echo too fast >&2; exit 3"], dispensable=True),
                shell(f"echo after >> {order}", "after"),
            ],
            [shell(f"sleep 0.3; echo other >> {order}", "other")],
        ],
        quiet=True,
    )
    assert failed == {"first": "too fast"} and order.read_text() == "other\n"


def test_much_output_blocks_nobody():
    run_stages(
        [shell("yes progress 0.5 x | head -n 50000; yes warning | head -n 50000 >&2")], quiet=True
    )


def test_plain_lines_say_the_time_left(monkeypatch, capsys):
    clock = iter([0.0, 10.0])
    monkeypatch.setattr(engines.time, "monotonic", lambda: next(clock))
    lines = engines.Lines([shell("")])
    lines.update("stage", 0.0, "pouring")  # a stage's time begins with its first word
    lines.update("stage", 0.25, "settling")
    assert capsys.readouterr().err.splitlines() == [
        "stage: 0 % after 0 s: pouring",
        "stage: 25 % after 10 s, 30 s left: settling",
    ]
