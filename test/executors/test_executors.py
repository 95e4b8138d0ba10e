"""Each item is answered once, whatever happens to the workers; and what a task says is heard."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from compass_ros.errors import DataError
from compass_ros.executors import Executor, Processes, Ray, Threads, executor
from test.executors.tasks import always_dies, dies_once, refuses, squared


@pytest.mark.parametrize("by", [Threads(2), Processes(2)])
def test_each_item_is_answered_once(by: Executor) -> None:
    assert sorted(by.each(squared, range(7))) == [(i, i * i) for i in range(7)]
    assert list(by.each(squared, [])) == []


@pytest.mark.parametrize("by", [Threads(1), Processes(1)])
def test_what_a_task_raises_is_the_callers(by: Executor) -> None:
    with pytest.raises(ValueError, match="not 5"):
        list(by.each(refuses, [5]))


def test_a_killed_worker_loses_nothing(tmp_path: Path) -> None:
    assert sorted(Processes(2).each(partial(dies_once, tmp_path), range(6))) == [(i, i * i) for i in range(6)]
    assert (tmp_path / "died").exists()


def test_what_kills_every_worker_is_given_up_and_the_rest_is_kept() -> None:
    answers = Processes(1).each(always_dies, [0, 1, 2])
    assert next(answers) == (0, 0)
    with pytest.raises(DataError, match="item 2: its worker died 3 times"):
        next(answers)


def test_a_caller_that_has_enough_leaves_nothing_running() -> None:
    answers = Threads(1).each(squared, range(1000))
    next(answers)
    answers.close()  # type: ignore[attr-defined]  # a generator's


def test_the_options_of_a_command_line() -> None:
    assert executor(3, "", 1, computes=True) == Processes(3)
    assert executor(3, "", 1, computes=False) == Threads(3)
    assert executor(3, "auto", 2, computes=False) == Ray("auto", 2)
