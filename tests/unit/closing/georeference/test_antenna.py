# SPDX-License-Identifier: MIT OR Apache-2.0
"""An antenna that is not where the payload has it."""

from collections import Counter

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.geodesy import LevelFrame
from bentwing.base.trajectory import Trajectory
from bentwing.closing.georeference.georeference import georeference
from bentwing.closing.georeference.placement import Placement
from bentwing.closing.georeference.receivers import Receivers
from bentwing.closing.georeference.settings import GeoreferenceSettings
from bentwing.recording.fixes import Fixes

FRAME = LevelFrame(11.3, 47.5, 700.0)
TRUE = Placement(1.2, np.array([4.0, -7.0, 2.0]), np.zeros(4))
LEVER = np.array([0.1, -0.2, 0.3])
STATED = LEVER + np.array([0.3, 0.0, -0.1])
SIGMA = 0.01  # m, white, and as much that stays


def flight(*, turns=True):
    times = np.arange(0, 60.0, 0.01)
    a = 2 * np.pi * times / 40
    positions = np.stack([12 * np.cos(a), 9 * np.sin(a), 0.5 * np.sin(3 * a)], axis=1)
    ways = (
        np.c_[0.1 * np.sin(5 * a), 0.1 * np.cos(3 * a), 4 * a]
        if turns
        else np.c_[0 * a, 0 * a, 0 * a]
    )
    return Trajectory(times, positions, geometry.exp(ways))


def placed(way, *, stated=STATED, std=0.0, seed=100):
    rng = np.random.default_rng(seed)
    times = np.arange(0.3, 59.0, 0.2)
    p, q = way.interpolate(times)
    level = TRUE.to_level(p + geometry.rotate(q, np.tile(LEVER, (len(p), 1))))
    level += SIGMA * (rng.normal(size=level.shape) + rng.normal(size=3))
    level[rng.random(len(times)) < 0.05] += 8.0
    covariances = np.tile(2 * SIGMA**2 * np.eye(3), (len(times), 1, 1))
    fixes = Fixes(times, FRAME.to_geodetic(level), covariances, Counter(messages=len(times)))
    return georeference(way, Receivers.one(fixes, stated, "", std), GeoreferenceSettings())


@pytest.mark.parametrize("seed", range(100, 105))
def test_an_antenna_that_may_be_elsewhere_is_found(seed):
    found = placed(flight(), std=0.3, seed=seed)
    (antenna,) = found.record["antennas"]
    assert antenna["used"]
    assert (np.abs(antenna["lever_arm"] - LEVER) < 4 * antenna["std"]).all()
    assert antenna["std"].max() < 0.03
    assert found.record["fixes"]["rms_horizontal"] < 0.03
    assert found.warnings == []


def test_one_that_is_said_to_be_known_and_is_not_is_a_warning():
    found = placed(flight())
    assert not found.record["antennas"][0]["used"]
    (said,) = [text for text in found.warnings if "antenna" in text]
    assert "0.32 m from where the payload" in said
    assert "gnss.lever_arm_std" in said


@pytest.mark.parametrize("seed", range(100, 110))
def test_one_that_is_where_it_is_said_to_be_is_not_doubted(seed):
    assert placed(flight(), stated=LEVER, seed=seed).warnings == []


def test_a_carrier_that_never_turns_shows_nothing_of_its_antenna():
    found = placed(flight(turns=False), std=0.3)
    (antenna,) = found.record["antennas"]
    np.testing.assert_allclose(antenna["lever_arm"], STATED, atol=1e-6)
    np.testing.assert_allclose(antenna["std"], 0.3, atol=1e-3)
