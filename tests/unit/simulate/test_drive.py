# SPDX-License-Identifier: MIT OR Apache-2.0
"""A car with a lidar of many beams drives through a street."""

import numpy as np
import pytest
from pydantic import ValidationError
from rosbags.highlevel import AnyReader

from bentwing.base.errors import UsageError
from bentwing.simulate import Scenario
from bentwing.simulate.drive import drive
from bentwing.simulate.lidars.hdl64 import hdl64
from bentwing.simulate.lidars.os1 import os1_64
from bentwing.simulate.records import CloudRecord
from bentwing.simulate.ros import BagWriter
from bentwing.simulate.scenes import SCENES, World
from bentwing.simulate.simulation import prepare


@pytest.fixture(scope="module")
def world():
    return World(SCENES["street"](np.random.default_rng(4)))


@pytest.fixture(scope="module")
def setup():
    return prepare(Scenario(scene="street", duration=20.0, seed=1, noiseless=True, speed=6.0))


def clouds(setup, first, last):
    records = [r for _, _, part in setup.sensors.stream(first, last) for r in part]
    return [r for r in records if isinstance(r, CloudRecord)]


def test_a_street_is_driven_with_a_hdl64_unless_asked_otherwise():
    scenario = Scenario(scene="street")
    assert (scenario.head, scenario.flight) == ("hdl64", "drive")
    for wrong in ({"head": "hokuyo-spin"}, {"flight": "tour"}):
        with pytest.raises(ValidationError, match="only in a street"):
            Scenario(scene="street", **wrong)
    with pytest.raises(ValidationError, match="only in a street"):
        Scenario(scene="office", head="hdl64")


def test_only_a_car_is_faster_than_5_m_per_s():
    assert Scenario(scene="street", speed=15.0).speed == 15.0
    with pytest.raises(ValidationError, match="at most 5 m/s"):
        Scenario(scene="courtyard", speed=6.0)


def test_the_car_drives_at_its_speed_on_the_road_and_ends_at_rest(world):
    car = drive(world, np.random.default_rng(2), 60.0)
    times = np.arange(0.0, 60.0, 0.05)
    motion = car.motion(times)
    speeds = np.linalg.norm(motion.v, axis=1)
    assert speeds[times < 1.0].max() < 1e-12
    assert speeds[times > 59.0].max() < 0.05
    assert 8.5 < np.median(speeds[(times > 12.0) & (times < 48.0)]) < 11.5
    assert 400.0 < np.linalg.norm(motion.p[-1] - motion.p[0]) < 600.0
    down = np.tile([0.0, 0.0, -1.0], (len(times), 1))
    heights = world.scene.cast(np.ascontiguousarray(motion.p), down, 10.0)[0]
    assert abs(heights - 0.55).max() < 0.06
    # A car does not slip: it looks where it goes.
    ahead = np.einsum("nij,ni->nj", motion.R, motion.v)[speeds > 3.0]
    assert abs(ahead[:, 1]).max() < 0.03 * speeds.max()


def test_nothing_stands_in_the_cars_way(world):
    road = np.array(world.site.road)
    road[:, 2] += 1.2
    assert world.clearance(road).min() > 1.0


def test_a_drive_beyond_the_end_of_the_road_is_refused(world):
    with pytest.raises(UsageError, match="choose a shorter duration"):
        drive(world, np.random.default_rng(2), 200.0)
    with pytest.raises(UsageError, match="takes at least 17 s"):
        drive(world, np.random.default_rng(2), 12.0)


@pytest.mark.parametrize("build", [hdl64, os1_64])
def test_a_revolution_goes_around_once_with_64_beams(build):
    lidar = build(100.0)
    beams = lidar.beams(0.0, 0.2)
    assert beams.times.shape == (2 * lidar.n_firings, 64)
    np.testing.assert_allclose(np.linalg.norm(beams.directions, axis=-1), 1.0)
    azimuths = np.unwrap(np.arctan2(beams.directions[:, 0, 1], beams.directions[:, 0, 0]))
    per_turn = azimuths[lidar.n_firings - 1] - azimuths[0]
    assert np.degrees(per_turn) == pytest.approx(-360.0, abs=1.0)
    assert sorted(lidar.rings) == list(range(64))


def test_noiseless_points_of_the_moving_car_lie_on_the_street(setup):
    (cloud,) = clouds(setup, 10.0, 10.1)
    points = np.column_stack([cloud.points[c] for c in "xyz"]).astype(np.float64)[::9]
    times = cloud.stamp + cloud.points["time"].astype(np.float64)[::9] - setup.sensors.clock.latency
    far = np.linalg.norm(points, axis=1) > 2.0
    motion = setup.rig.lidar(times[far])
    placed = motion.p + np.einsum("nij,nj->ni", motion.R, points[far])
    assert len(placed) > 2000
    assert np.linalg.norm(motion.v, axis=1).min() > 4.0
    assert abs(setup.world.scene.distance(placed)[0]).max() < 1e-4


def test_rings_count_from_below_and_look_there(setup):
    (cloud,) = clouds(setup, 10.0, 10.1)
    elevation = np.degrees(
        np.arctan2(cloud.points["z"], np.hypot(cloud.points["x"], cloud.points["y"]))
    )
    for ring, expected in ((0, -24.33), (31, -8.83), (32, -8.33)):
        np.testing.assert_allclose(elevation[cloud.points["ring"] == ring], expected, atol=0.01)


def test_an_ouster_sends_whole_revolutions_with_zeros_where_nothing_returned():
    setup = prepare(
        Scenario(scene="street", head="os1-64", duration=20.0, speed=6.0, noiseless=True)
    )
    (cloud,) = clouds(setup, 1.0, 1.1)
    assert cloud.points.shape == (64, 1024)
    assert (cloud.points["ring"] == np.arange(64)[:, None]).all()
    none = cloud.points["range"] == 0
    assert 0.05 < none.mean() < 0.6
    assert (cloud.points["x"][none] == 0.0).all()
    far = np.linalg.norm([cloud.points[c] for c in "xyz"], axis=0)
    np.testing.assert_allclose(far, cloud.points["range"] * 1e-3, atol=6e-4)
    assert cloud.points["t"].max() == pytest.approx(0.1e9 * 1023 / 1024, rel=1e-6)


def test_messages_describe_their_fields_as_the_drivers_do(tmp_path):
    setup = prepare(
        Scenario(scene="street", head="os1-64", duration=20.0, speed=6.0, noiseless=True)
    )
    (cloud,) = clouds(setup, 1.0, 1.1)
    with BagWriter(tmp_path / "one.bag", "bag") as bag:
        bag.write("/points", "lidar", cloud)
    with AnyReader([tmp_path / "one.bag"]) as reader:
        connection, _, raw = next(reader.messages())
        message = reader.deserialize(raw, connection.msgtype)
    assert (message.height, message.width, message.point_step) == (64, 1024, 48)
    assert {f.name: (f.offset, f.datatype) for f in message.fields} == {
        "x": (0, 7), "y": (4, 7), "z": (8, 7), "intensity": (16, 7), "t": (20, 6),
        "reflectivity": (24, 4), "ring": (26, 4), "ambient": (28, 4), "range": (32, 6),
    }  # fmt: skip
    assert message.data.tobytes() == cloud.points.tobytes()
