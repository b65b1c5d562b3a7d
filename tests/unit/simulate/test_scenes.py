# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing._core import Scene
from bentwing.base.errors import UsageError
from bentwing.simulate.planner import follow_route, plan_tour
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.scenes import SCENES, World
from bentwing.simulate.scenes.mesh import ball, box, column, gable
from bentwing.simulate.scenes.parts import car, facade, table
from bentwing.simulate.scenes.spheres import RADIUS
from bentwing.simulate.simulation import prepare

# Walls and dam are flown along a line.
TOURED = sorted(set(SCENES) - {"walls", "dam"})


@pytest.mark.parametrize("name", TOURED)
def test_every_scene_has_a_tour_clear_of_its_surfaces(name):
    rng = np.random.default_rng(5)
    world = World(SCENES[name](rng))
    tour = plan_tour(world, rng, 40.0, 1.0)
    length = np.linalg.norm(np.diff(tour.way_points, axis=0), axis=1).sum()
    assert 20.0 < length < 120.0
    assert world.clearance(tour.way_points).min() > 1.0
    np.testing.assert_array_equal(tour.way_points[0], tour.way_points[-1])


@pytest.mark.parametrize("name", TOURED)
def test_surfaces_face_whoever_flies_along(name):
    rng = np.random.default_rng(6)
    world = World(SCENES[name](rng))
    start = plan_tour(world, rng, 20.0, 1.0).way_points[0]
    rays = rng.normal(size=(4000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    ranges, faces = world.scene.cast(np.tile(start, (4000, 1)), rays, 100.0)
    hit = np.isfinite(ranges)
    facing = np.einsum("ni,ni->n", world.normals[faces], rays)[hit] < 0
    # Leaves have no outside.
    assert facing.mean() > (0.8 if name == "forest" else 0.995)


@pytest.mark.parametrize("name", sorted(set(SCENES) - {"walls"}))
def test_seeds_change_the_geometry(name):
    one, other = (SCENES[name](np.random.default_rng(seed)).mesh for seed in (1, 2))
    assert one.vertices.shape != other.vertices.shape or (one.vertices != other.vertices).any()


@pytest.mark.parametrize(
    "body",
    [box((0, 0, 0), (1, 2, 3)), ball(1.0, 8), column((0.5, 0.3), 2.0, 8), car(), table(1.6, 0.8)],
    ids=["box", "ball", "column", "car", "table"],
)
def test_bodies_are_seen_from_outside(body):
    scene = Scene(np.ascontiguousarray(body.vertices), body.triangles)
    around = 10.0 * np.random.default_rng(0).normal(size=(200, 3)) + [0.0, 0.0, 40.0]
    assert (scene.distance(around)[0] > 0).all()


def test_a_house_has_its_ridge_above_the_eaves():
    house = gable((0, 0, 0), (8, 6, 3), 2.0, 0.3)
    assert house.vertices[:, 2].max() == 5.0


def test_a_window_is_set_back_by_its_reveal():
    wall = facade(4.0, 3.0, [(1.0, 2.0, 1.0, 2.0)], 0.2)
    scene = Scene(wall.vertices, wall.triangles)
    origins = np.array([[0.5, -1.0, 0.5], [1.5, -1.0, 1.5]])
    ranges, _ = scene.cast(origins, np.tile([0.0, 1.0, 0.0], (2, 1)), 10.0)
    np.testing.assert_allclose(ranges, [1.0, 1.2])


def test_another_flight_seed_flies_elsewhere_in_the_same_world():
    one, other = (
        prepare(Scenario(scene="office", seed=3, flight_seed=number, duration=25.0))
        for number in (None, 7)
    )
    np.testing.assert_array_equal(one.world.site.mesh.vertices, other.world.site.mesh.vertices)
    times = np.array([0.0, 12.0])
    apart = np.linalg.norm(one.rig.imu(times).p - other.rig.imu(times).p, axis=1)
    assert apart.min() > 0.5


@pytest.mark.parametrize("name", ["mocap", "carpark", "campus"])
@pytest.mark.parametrize(("share", "rounds"), [(0.3, 0), (0.9, 1), (3.1, 3)])
def test_a_route_is_followed_in_whole_rounds_or_there_and_back(name, share, rounds):
    site = SCENES[name](np.random.default_rng(2))
    corners = np.array(site.route)
    lap = np.linalg.norm(np.diff(np.vstack([corners, corners[:1]]), axis=0), axis=1).sum()
    tour = follow_route(World(site), share * lap)
    flown = np.linalg.norm(np.diff(tour.way_points, axis=0), axis=1).sum()
    assert flown == pytest.approx((rounds or share) * lap)
    np.testing.assert_allclose(tour.way_points[[0, -1]], corners[[0, 0]])
    assert tour.pad[2] < tour.way_points[0, 2] - 1.0


@pytest.mark.parametrize("name", ["mocap", "carpark", "campus"])
@pytest.mark.parametrize("seed", range(1, 7))
def test_a_route_can_be_flown_with_every_seed(name, seed):
    setup = prepare(Scenario(scene=name, head="vlp16-motor", duration=60.0, seed=seed))
    positions = setup.rig.imu(np.arange(0.0, 60.0, 0.5)).p
    assert np.ptp(positions[:, 0]) > 3.0
    assert positions[:, 2].max() < 6.0


def grounded(scene, **choices):
    return prepare(Scenario(scene=scene, seed=3, duration=25.0, **choices)).world.site.mesh


@pytest.mark.parametrize("scene", ["office", "courtyard", "mine", "forest"])
def test_boxes_stand_free_on_the_ground_and_elsewhere_in_another_flight(scene):
    empty = grounded(scene, flight_seed=7)
    one, other = (grounded(scene, flight_seed=number, boxes=4) for number in (7, 8))
    n = len(empty.vertices)
    for mesh in (one, other):
        np.testing.assert_array_equal(mesh.vertices[:n], empty.vertices)
    boxes = [mesh.vertices[n:].reshape(4, 8, 3) for mesh in (one, other)]
    edges = [np.ptp(box, axis=1)[:, 2] for box in boxes]
    np.testing.assert_allclose(*edges)  # the same boxes
    centres = [box.mean(axis=1) for box in boxes]
    assert np.linalg.norm(centres[0] - centres[1], axis=1).min() > 0.2
    world = Scene(empty.vertices, empty.triangles)
    tops = [box[box[:, 2] > box[:, 2].mean()] for box in np.concatenate(boxes)]
    assert abs(world.distance(np.concatenate(tops))[0]).min() > 0.05


def test_spheres_stand_free_and_are_the_same_in_another_flight():
    one, other = (
        prepare(
            Scenario(scene="office", seed=3, duration=25.0, spheres=4, flight_seed=number)
        ).world
        for number in (7, 8)
    )
    assert one.site.spheres == other.site.spheres
    empty = grounded("office", flight_seed=7)
    centres = np.array(one.site.spheres)
    assert abs(Scene(empty.vertices, empty.triangles).distance(centres)[0]).min() > 2 * RADIUS
    # Rays from all sides meet each sphere at its radius; from below, its post.
    units = np.random.default_rng(0).normal(size=(200, 3))
    units[:, 2] = abs(units[:, 2])
    units /= np.linalg.norm(units, axis=1)[:, None]
    for centre in centres:
        ranges, _ = one.scene.cast(centre + 1.9 * RADIUS * units, -units, 10.0)
        np.testing.assert_allclose(1.9 * RADIUS - ranges, RADIUS, atol=1e-3)


def test_boxes_leave_the_way_of_a_car_park_free():
    setup = prepare(Scenario(scene="carpark", seed=3, duration=30.0, boxes=6))
    flown = setup.rig.imu(np.arange(8.0, 22.0, 0.5)).p
    assert setup.world.clearance(flown).min() > 0.5


def test_more_boxes_than_a_scene_has_room_for_are_refused():
    with pytest.raises(UsageError, match="no room for 100 boxes"):
        grounded("office", boxes=100)


def test_things_of_another_seed_stand_between_the_same_walls():
    one, other = (grounded("office", things_seed=seed) for seed in (None, 5))
    same = (one.vertices == other.vertices).all(axis=1)
    n_walls = int(np.argmin(same))
    assert n_walls > 300
    assert not same[n_walls:].all()


def test_a_scene_without_furniture_takes_no_other():
    with pytest.raises(ValueError, match="things_seed"):
        Scenario(scene="forest", things_seed=5)


def test_no_boxes_are_stood_where_a_survey_cannot_see_them():
    with pytest.raises(ValueError, match="boxes: none are seen from a survey"):
        Scenario(scene="dam", boxes=2)
