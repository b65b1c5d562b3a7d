# SPDX-License-Identifier: MIT OR Apache-2.0
import threading

import numpy as np
import pytest

from bentwing._core import Scene

VERTICES = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
TRIANGLES = np.array([[0, 1, 2]], dtype=np.uint32)
DOWN = np.array([[0.0, 0.0, -1.0]])


@pytest.fixture
def scene():
    return Scene(VERTICES, TRIANGLES)


def test_a_miss_is_infinity_and_no_triangle(scene):
    ranges, triangles = scene.cast(np.array([[5.0, 5.0, 1.0]]), DOWN, 10.0)
    assert ranges[0] == np.inf
    assert triangles[0] == -1


def test_empty_arrays_give_empty_results(scene):
    nothing = np.empty((0, 3))
    assert scene.cast(nothing, nothing, 1.0)[0].shape == (0,)
    assert scene.distance(nothing)[1].dtype == np.int32


def test_read_only_arrays_are_accepted(scene):
    points = np.array([[0.2, 0.2, 1.0]])
    points.flags.writeable = False
    assert scene.distance(points)[0][0] == 1.0


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((4, 2)), r"points: expected shape \(N, 3\), got \(4, 2\)"),
        (np.zeros((8, 3))[::2], "points: expected a C-contiguous array"),
        (np.asfortranarray(np.zeros((4, 3))), "points: expected a C-contiguous array"),
        (np.array([[0.0, 0.0, 0.0], [0.0, np.nan, 0.0]]), "points: row 1 is not finite"),
    ],
)
def test_what_is_wrong_with_an_array_is_said(scene, points, message):
    with pytest.raises(ValueError, match=message):
        scene.distance(points)


def test_other_types_than_float64_are_refused(scene):
    with pytest.raises(TypeError):
        scene.distance(np.zeros((1, 3), dtype=np.float32))


def test_a_ray_without_origin_is_refused(scene):
    with pytest.raises(ValueError, match="directions: expected 2 rows"):
        scene.cast(np.zeros((2, 3)), DOWN, 1.0)


@pytest.mark.parametrize("max_range", [0.0, -1.0, np.nan])
def test_a_maximum_range_must_be_positive(scene, max_range):
    with pytest.raises(ValueError, match="max_range"):
        scene.cast(DOWN, DOWN, max_range)


def test_a_triangle_without_its_vertex_is_named():
    with pytest.raises(ValueError, match="triangle 0 refers to vertex 3"):
        Scene(VERTICES, np.array([[0, 1, 3]], dtype=np.uint32))


def test_other_threads_run_during_a_long_cast(scene):
    origins, directions = np.tile([[0.2, 0.2, 9.0]], (2_000_000, 1)), np.tile(DOWN, (2_000_000, 1))
    ticks = []
    done = threading.Event()

    def tick():
        while not done.wait(0.0005):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    thread.start()
    before = len(ticks)
    scene.cast(origins, directions, 20.0)
    during = len(ticks) - before
    done.set()
    thread.join()
    assert during >= 3
