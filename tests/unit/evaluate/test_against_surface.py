# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.against_surface import compare_with_map, read_reference
from bentwing.evaluate.alignment import Alignment
from bentwing.evaluate.clouds import Cloud
from bentwing.evaluate.placement import place
from bentwing.evaluate.surface import Surface
from bentwing.evaluate.surfels import Surfels, surfels_of_cloud, surfels_of_mesh
from bentwing.map.chunk import MapChunk
from bentwing.map.read_mesh import Mesh
from bentwing.map.writer import open_map

GEOGRAPHIC = np.array([512_345.0, 5_403_210.0, 230.0])


@pytest.fixture
def written(tmp_path):
    def write(points, name="map.ply", times=None):
        times = np.zeros(len(points)) if times is None else times
        with open_map(tmp_path / name, name.rpartition(".")[2], 10**18) as writer:
            writer.write(MapChunk(points, times, np.zeros(len(points), np.float32)))
        return tmp_path / name

    return write


def path_through(hall_point=(3.0, 2.5, 1.5)):
    positions = np.array(hall_point) + np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    return Trajectory(np.arange(3.0), positions, np.tile([0.0, 0, 0, 1], (3, 1)))


def square(edge=4.0, height=0.0):
    corners = np.array([[0, 0], [edge, 0], [edge, edge], [0, edge]], float)
    vertices = np.column_stack([corners, np.full(4, height)])
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))


def test_discs_of_a_mesh_cover_it_evenly_and_lie_on_it():
    found = surfels_of_mesh(square(), np.zeros(3), 0.1)
    assert 1600 <= len(found) <= 1800
    assert np.allclose(found.centres[:, 2], 0)
    assert np.allclose(np.abs(found.normals), [0, 0, 1])
    asked = np.random.default_rng(0).uniform(0, 4, (500, 2))
    distances, discs = Surface(found).distances(np.column_stack([asked, np.full(500, 0.07)]), 0.3)
    assert (discs >= 0).all()
    assert np.allclose(np.abs(distances), 0.07)


def test_discs_of_a_cloud_do_not_depend_on_how_it_is_cut(hall):
    points = hall(30_000, noise=0.002)
    whole = surfels_of_cloud([points], 0.3)
    parts = surfels_of_cloud(np.array_split(points, 7), 0.3)
    assert np.allclose(whole.centres, parts.centres, atol=1e-12)
    assert np.allclose(np.abs(np.sum(whole.normals * parts.normals, axis=1)), 1)


def test_the_sign_is_that_of_a_range_error():
    surface = Surface(surfels_of_mesh(square(), np.zeros(3), 0.1)).facing(np.array([[2.0, 2, 5]]))
    points = np.array([[2.0, 2, 0.1], [2, 2, -0.1], [2, 2, 0.5], [9, 9, 0]])
    distances, discs = surface.distances(points, 0.3)
    assert distances[:2] == pytest.approx([-0.1, 0.1])
    assert np.isnan(distances[2:]).all()
    assert discs[2:].tolist() == [-1, -1]


def test_where_two_walls_meet_a_point_belongs_to_the_nearer_one():
    floor = surfels_of_mesh(square(), np.zeros(3), 0.1)
    wall = surfels_of_mesh(
        Mesh(square().vertices[:, [2, 0, 1]], square().triangles), np.zeros(3), 0.1
    )
    both = Surfels(
        np.vstack([floor.centres, wall.centres]), np.vstack([floor.normals, wall.normals]), 0.1
    )
    distances, _ = Surface(both).distances(np.array([[0.01, 2.0, 0.04], [0.04, 2.0, 0.01]]), 0.3)
    assert np.abs(distances) == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize("origin", [np.zeros(3), GEOGRAPHIC], ids=["local", "geographic"])
def test_a_map_is_brought_to_its_reference_from_anywhere(hall, written, origin):
    reference = read_reference(written(hall(90_000, noise=0.002) + origin, "reference.ply"))
    R = geometry.to_matrices(geometry.exp(np.array([0.01, -0.02, 2.5])))
    moved = (hall(30_000, noise=0.01, seed=1) - [4.0, 3, 1]) @ R.T
    found = compare_with_map(Cloud(written(moved)), reference)
    assert np.abs(np.array(found.R_reference_map) - R.T).max() < 5e-4
    expected = np.array([4.0, 3, 1]) + origin
    assert np.allclose(found.t_reference_map, expected, atol=4e-3)
    # discs that hold a bit of both walls of a corner are tilted
    assert 0.0098 < found.std < 0.0125
    assert found.robust_std == pytest.approx(0.01, rel=0.06)
    assert abs(found.mean) < 5e-4
    assert found.completeness > 0.9


def test_known_offset_between_two_planes_is_the_mean_and_changed_things_are_left_out(hall, written):
    """All sides moved outwards by 2 cm, which no rigid motion can undo, and a new pillar."""
    reference = read_reference(written(hall(90_000), "reference.ply"))
    rng = np.random.default_rng(5)
    pillar = np.array([2.0, 6, 0.4]) + rng.uniform(0, 1, (1_500, 3)) * [0.5, 0.5, 2.2]
    points = np.vstack([hall(28_500, offset=0.02, noise=0.004, seed=2), pillar])
    found = compare_with_map(Cloud(written(points)), reference, path=path_through())
    assert found.front == "sensor"
    # the floor goes down and opposite walls apart: behind the reference as seen from inside;
    # the fit takes up what all floor points share
    walls = np.abs(found.points[:, 2] + found.origin[2]) > 0.2
    assert np.median(found.distances[walls]) == pytest.approx(0.02, abs=0.006)
    # the pillar is 5 %; the rim of the reference, where discs end, takes a little more
    assert 0.045 < found.n_left_out / found.n_points < 0.075
    assert np.abs(found.distances).max() <= 0.3


def test_completeness_is_the_share_that_was_mapped(hall, written):
    reference = read_reference(written(hall(90_000), "reference.ply"))
    half = hall(90_000, noise=0.003, seed=4)
    found = compare_with_map(Cloud(written(half[half[:, 0] < 4])), reference)
    whole = reference.surfels.centres + reference.origin
    assert found.completeness == pytest.approx(np.mean(whole[:, 0] < 4), abs=0.02)


def test_a_map_of_another_place_is_refused(hall, written):
    reference = read_reference(written(hall(60_000), "reference.ply"))
    elsewhere = np.random.default_rng(0).uniform(0, 60, (20_000, 3))
    with pytest.raises(InputError, match="wherever it is put"):
        compare_with_map(Cloud(written(elsewhere)), reference)


def test_a_reference_without_surfaces_is_refused(written):
    thin = np.random.default_rng(0).uniform(0, 100, (1_000, 3))
    with pytest.raises(InputError, match="flat pieces"):
        read_reference(written(thin, "reference.ply"))


def test_a_good_start_is_used(hall):
    surface = Surface(surfels_of_cloud([hall(150_000)], 0.2))
    R = geometry.to_matrices(geometry.exp(np.array([0.0, 0.3, 1.0])))  # not upright
    points = hall(20_000, noise=0.005, seed=1)
    found = place((points - 1.0) @ R, surface, [Alignment(R, np.full(3, 1.05))])
    assert np.abs(found.R - R).max() < 1e-3


def test_points_that_are_not_finite_are_counted_and_left_out(written, hall):
    points = hall(5_000)
    points[::10, 1] = np.nan
    cloud = Cloud(written(points))
    assert cloud.n_not_finite == len(points[::10])
    assert sum(len(part) for part in cloud.parts()) == len(points) - len(points[::10])
