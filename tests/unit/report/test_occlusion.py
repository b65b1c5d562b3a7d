# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.report.occlusion import ambient


def test_a_plane_is_fully_lit_whether_or_not_it_leans():
    level = np.zeros((120, 150), np.float32)
    leaning = np.add.outer(0.6 * np.arange(120), np.zeros(150)).astype(np.float32)
    for plane in (level, leaning):
        light = ambient(plane)
        assert light.shape == plane.shape
        assert light[30:-30, 30:-30] == pytest.approx(1.0, abs=0.02)


def test_it_is_dark_at_the_foot_of_a_wall_and_bright_on_top():
    heights = np.zeros((150, 150), np.float32)
    heights[:, 75:] = 60.0
    light = ambient(heights)
    foot, away, top = light[75, 71], light[75, 12], light[75, 110]
    assert foot < 0.75 < away < 1.01
    assert top == pytest.approx(1.0, abs=0.01)
    # from the foot outwards it gets brighter all the way
    assert (np.diff(light[75, 71:10:-3]) > -1e-3).all()


def test_a_pit_gets_less_light_the_deeper_it_is():
    lights = []
    for depth in (5.0, 20.0, 80.0):
        heights = np.zeros((150, 150), np.float32)
        heights[66:84, 66:84] = -depth
        lights.append(ambient(heights)[75, 75])
    assert lights[0] > lights[1] > lights[2] > 0.0


def test_emptiness_takes_no_light_and_gives_no_nan():
    heights = np.full((60, 60), -np.inf, np.float32)
    assert np.isfinite(ambient(heights)).all()
    heights[20:40, 20:40] = 0.0
    light = ambient(heights)
    assert np.isfinite(light).all()
    assert light[24:36, 24:36] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("shape", [(1, 1), (2, 5), (4, 3)])
def test_tiny_pictures_are_no_error(shape):
    assert ambient(np.zeros(shape, np.float32)).shape == shape
