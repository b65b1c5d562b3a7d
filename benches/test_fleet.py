# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the scheduler's time is compared with."""

from __future__ import annotations

import pytest

from benches.cost.fleet import Work, at_best, jobs


def work(*seconds: float, dies: bool = False) -> list[Work]:
    return [Work(k, s, dies) for k, s in enumerate(seconds)]


def test_work_goes_to_whoever_is_free() -> None:
    assert at_best(work(4.0, 1.0, 1.0, 1.0), 2, []) == 4.0
    assert at_best(work(1.0, 1.0, 1.0, 4.0), 2, []) == 5.0


def test_a_worker_that_goes_begins_nothing_more() -> None:
    assert at_best(work(1.0, 1.0, 1.0, 1.0), 2, [0.5]) == 3.0


def test_what_dies_is_done_again_at_the_end() -> None:
    assert at_best(work(2.0, dies=True), 1, []) == 3.0


def test_the_mean_duration_is_as_asked_with_stragglers() -> None:
    made = jobs(5000, 3.0, 933)
    seconds = [one.seconds for one in made]
    assert sum(seconds) / len(made) == pytest.approx(3.0)
    assert max(seconds) > 5 * 3.0
    assert 20 < sum(one.dies for one in made) < 90
