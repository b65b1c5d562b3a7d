# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing view --with open3d` as a user runs it on a finished run."""

import numpy as np
import pytest
from PIL import Image

from support.known_points import write_run

THERE = np.array([640_500.0, 5_333_200.0, 200.0])


@pytest.fixture(scope="module")
def inside(tmp_path_factory):
    """A run in the middle of a sphere, far from the zero of its coordinates."""
    directions = np.random.default_rng(140).normal(size=(40_000, 3))
    points = 2.0 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    way = np.linspace(-0.2, 0.2, 50)[:, None] * [1.0, 1.0, 0.5] + THERE
    return write_run(tmp_path_factory.mktemp("ball") / "run", points + THERE, way=way)


def test_open3d_draws_a_run_without_a_screen(inside, tmp_path, bentwing):
    # its shared libraries may be missing, too, which is an ImportError
    pytest.importorskip("open3d", reason="Open3D is not installed", exc_type=ImportError)
    said = bentwing("view", inside, "--with", "open3d", "--save", tmp_path / "run.png")
    if "cannot draw here" in said.err:
        pytest.skip("Open3D finds no driver that draws without a screen")
    assert said.code == 0, said.err
    pixels = np.asarray(Image.open(tmp_path / "run.png").convert("RGB")).astype(int)
    assert pixels.shape == (1000, 1600, 3)
    is_drawn = (pixels < 250).any(axis=2)
    # the sphere around the middle of the picture, as points of two pixels, and nothing in its corners
    assert is_drawn[400:600, 700:900].mean() > 0.1
    assert not is_drawn[:50].any()
    assert not is_drawn[:, :50].any()


def test_open3d_draws_png_only(inside, tmp_path, bentwing):
    said = bentwing("view", inside, "--with", "open3d", "--save", tmp_path / "run.rrd")
    assert said.code == 2
    assert ".png" in said.err
