# SPDX-License-Identifier: MIT OR Apache-2.0
import io

import pytest

from bentwing.base import progress
from bentwing.base.progress import (
    BarProgress,
    LineProgress,
    Progress,
    as_progress,
    create_progress,
)


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def lines_of(total, steps, seconds_per_step, unit="s"):
    stream, clock = io.StringIO(), Clock()
    with LineProgress(stream, clock).stage("map", total, unit) as stage:
        for step in steps:
            clock.now += seconds_per_step
            stage.advance(step)
    return stream.getvalue().splitlines()


def test_lines_come_at_most_every_few_seconds_and_every_tenth():
    assert len(lines_of(1000.0, [1.0] * 1000, 0.01)) <= 1 + 10.0 / progress.LINE_INTERVAL
    assert len(lines_of(1000.0, [1.0] * 1000, 10.0)) <= 1 + 10


def test_a_line_tells_share_rate_and_time_left():
    lines = lines_of(100.0, [50.0, 50.0], 10.0)
    assert lines[0] == "map: 50 %, 5.0 x real time, 10.0 s left"
    assert lines[-1] == "map: done in 20.0 s, 5.0 x real time"


def test_an_unknown_total_still_gives_signs_of_life():
    lines = lines_of(None, [1000] * 4, 6.0, unit="points")
    assert lines[0] == "map: 1,000 points, 167 points/s"
    assert len(lines) == 5


def test_more_than_the_total_is_not_more_than_everything():
    assert lines_of(10.0, [30.0], 10.0)[0].startswith("map: 100 %")


def test_quiet_says_nothing(capsys):
    with create_progress(quiet=True).stage("map", 1.0) as stage:
        stage.advance(1.0)
    assert capsys.readouterr() == ("", "")


def test_a_pipe_gets_lines_and_a_terminal_a_bar(monkeypatch):
    assert type(create_progress()) is LineProgress
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert type(create_progress()) is BarProgress


def test_a_bar_reaches_its_end_and_goes_to_standard_error(capsys):
    with BarProgress().stage("map", 10.0) as stage:
        stage.advance(4.0)
    out, err = capsys.readouterr()
    assert out == ""
    assert "map" in err


@pytest.mark.parametrize("kind", [Progress, LineProgress, BarProgress])
def test_errors_pass_through_a_stage(kind):
    with pytest.raises(KeyboardInterrupt), kind().stage("map", 1.0):
        raise KeyboardInterrupt


def test_no_progress_is_one_that_says_nothing_and_a_function_is_refused():
    given = LineProgress()
    assert as_progress(given) is given
    assert type(as_progress(None)) is Progress
    with pytest.raises(TypeError, match="progress: expected a Progress, got builtin_function"):
        as_progress(print)
