# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.errors import InputError
from bentwing.closing.georeference.control_point_file import read_control_points
from bentwing.closing.georeference.control_points import ControlPoint
from bentwing.closing.georeference.marks import Marks, summary
from bentwing.closing.georeference.placement import Placement, Positions, place
from bentwing.closing.georeference.spheres import sphere_around
from bentwing.map.chunk import MapChunk

RADIUS = 0.1


def room(rng, centre, noise=0.015, n=800):
    """Return returns from a sphere on a post, the floor below, a wall behind, and between the two."""
    seen_from = centre + np.array([2.5, 0.6, 0.4])
    toward = (seen_from - centre) / np.linalg.norm(seen_from - centre)
    units = rng.normal(size=(4 * n, 3))
    units /= np.linalg.norm(units, axis=1)[:, None]
    ball = centre + RADIUS * units[units @ toward > 0.15][:n]
    post = np.column_stack([np.zeros((60, 2)), rng.uniform(-1.2, -RADIUS, 60)]) + centre
    floor = centre + rng.uniform([-0.8, -0.8, -1.2], [0.8, 0.8, -1.2], (3000, 3))
    wall = centre + rng.uniform([-0.45, -0.8, -0.8], [-0.45, 0.8, 0.8], (3000, 3))
    mixed = ball[:40] - toward * rng.uniform(0.02, 0.4, (40, 1))
    points = np.concatenate([ball, post, floor, wall, mixed])
    beams = points - seen_from
    beams /= np.linalg.norm(beams, axis=1)[:, None]
    return points + beams * rng.normal(0.0, noise, (len(points), 1))


@pytest.mark.parametrize("seed", range(110, 120))
def test_a_sphere_is_found_among_floor_wall_and_post(seed):
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-5, 5, 3)
    points = room(rng, centre)
    expected = centre + rng.uniform(-0.15, 0.15, 3)
    found = sphere_around(points, np.arange(len(points)), expected, RADIUS, 0.3)
    # With 15 mm of noise a shell is biased outwards by its square over the diameter, 1 mm.
    assert np.linalg.norm(found.middle - centre) < 0.005
    assert 0.003 <= found.sigmas.min() <= found.sigmas.max() < 0.006
    assert 0.005 < found.thickness < 0.02


@pytest.mark.parametrize("seed", range(110, 118))
def test_nothing_else_is_a_sphere(seed):
    rng = np.random.default_rng(seed)
    points = room(rng, np.zeros(3))
    bare = points[np.linalg.norm(points, axis=1) > 1.6 * RADIUS]
    assert sphere_around(bare, np.zeros(len(bare)), np.zeros(3), RADIUS, 0.3) is None
    # Nor is one of another size, or one that is farther away than it may be.
    assert sphere_around(points, np.zeros(len(points)), np.zeros(3), 0.25, 0.3) is None
    far = np.array([0.3, 0.0, 0.0])
    assert sphere_around(points, np.zeros(len(points)), far, RADIUS, 0.2) is None


def test_a_false_sphere_and_a_missing_one_are_named():
    rng = np.random.default_rng(120)
    centres = np.array([[0, 0, 1.2], [8, 1, 1.3], [7, 9, 1.0], [-1, 8, 1.4], [3, 4, 1.1]])
    cloud = np.concatenate([room(rng, centre) for centre in centres[:4]])
    placed = Placement(0.4, np.array([100.0, 200.0, 50.0]), np.zeros(4))
    targets = placed.to_level(centres)
    targets[1, 2] += 0.08
    listed = [
        ControlPoint(f"S{k}", target, RADIUS, "control", kind="sphere")
        for k, target in enumerate(targets)
    ]
    chunk = MapChunk(cloud, np.zeros(len(cloud)), np.zeros(len(cloud), np.float32))
    marks = Marks.collect(listed, targets, placed, 0.3, [chunk])
    marks.measure(placed, 0.3)
    none = Positions(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3, 3)))
    found, _ = place(none, marks.surfaces([0, 2, 3])[0], placed)
    rows = marks.table(found, marks.residuals(placed))
    residuals = [row["residual"] for row in rows]
    assert residuals[1] == pytest.approx(0.08, abs=0.01)
    assert max(residuals[0], *residuals[2:4]) < 0.005
    assert rows[4]["residual"] is None
    assert all(0.003 <= row["sigma"] < 0.006 for row in rows[:4])
    assert "S4" in " ".join(marks.warnings())
    assert summary(rows)["control"]["n"] == 4


def test_files_name_spheres_with_their_radius(tmp_path):
    path = tmp_path / "marks.csv"
    path.write_text("id,x,y,z,radius,kind\nA,1,2,3,0.0725,sphere\nB,1,2,3,,\n", encoding="utf-8")
    first, second = read_control_points(path).points
    assert (first.kind, first.radius, second.kind) == ("sphere", 0.0725, "surface")
    for row, what in (("A,1,2,3,,sphere", "without a radius"), ("A,1,2,3,1,cube", "'cube'")):
        path.write_text(f"id,x,y,z,radius,kind\n{row}\n", encoding="utf-8")
        with pytest.raises(InputError, match=what):
            read_control_points(path)
