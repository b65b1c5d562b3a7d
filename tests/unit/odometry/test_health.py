# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a surveyor is told where the surroundings leave a direction unseen."""

from __future__ import annotations

import re

import pytest

from bentwing.base.window_record import WindowRecord
from bentwing.odometry.health import unseen_sentence, unseen_sentences

JARGON = re.compile(r"window|sweep|degenerate|eigen|estimate", re.IGNORECASE)


def window(time, direction=None, *, turn=1.0):
    return WindowRecord(
        time=time, n_surfels=9, n_matches=9, inlier_share=1.0, residual_rms=0.3, iterations=1,
        converged=True, degenerate=direction is not None, weakest_direction=direction,
        translation_eigenvalues=[0.001, 0.3, 0.7], rotation_eigenvalues=[turn, 1.0, 1.0],
    )  # fmt: skip


def flight(direction, **values):
    """Windows each half second, those from 31 to 33.5 s without structure along a direction."""
    times = [0.5 * n for n in range(1, 100)]
    return [window(t, direction if 31.0 < t <= 33.5 else None, **values) for t in times]


@pytest.mark.parametrize(
    ("direction", "where"),
    [
        ([1.0, 0.1, 0.0], "along a horizontal direction"),
        ([0.0, -0.1, -0.99], "to tell the height"),
        ([0.7, 0.0, 0.7], "in some direction"),
    ],
)
def test_the_sentence_says_from_when_to_when_and_where(direction, where):
    (sentence,) = unseen_sentences(flight(direction), has_imu=True)
    assert sentence.startswith(
        f"from 31.0 to 33.5 s the surroundings show too little structure {where}: the IMU alone"
    )
    assert not JARGON.search(sentence)


def test_only_what_is_unseen_after_the_start_counts():
    windows = [window(0.1, [1.0, 0.0, 0.0]), *flight([1.0, 0.0, 0.0])]
    (sentence,) = unseen_sentences(windows, has_imu=True, since=0.4)
    assert sentence.startswith("from 31.0 to 33.5 s the surroundings")
    assert unseen_sentences(windows, has_imu=True, since=40.0) == []


def test_a_turn_that_is_not_seen_is_no_direction_of_the_position():
    (sentence,) = unseen_sentences(flight([1.0, 0.0, 0.0], turn=1e-5), has_imu=True)
    assert "structure in some direction" in sentence


def test_without_an_imu_no_sentence_names_one():
    assert "IMU" in unseen_sentence([(1.0, 2.0)], has_imu=True)
    (sentence,) = unseen_sentences(flight([1.0, 0.0, 0.0]), has_imu=False)
    assert "IMU" not in sentence


def test_a_flight_that_sees_everything_is_told_nothing():
    assert unseen_sentences([window(0.5), window(1.0)], has_imu=True) == []
