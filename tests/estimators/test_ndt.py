# SPDX-License-Identifier: MIT OR Apache-2.0
"""NDT odometry: what it makes of flights, and what it refuses.

The bounds come from the sensor and the head. Ranges have σ = 20 mm and a scan of a tenth of a second
is bent by what the motion differs from a constant velocity, a few centimetres at the walls of a
courtyard; keyframes hold the drift to about as much. The motor's mount is wrong by 0.3°, which
moves a wall at 15 m by 8 cm from one side of the head to the other.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bentwing import odometry
from bentwing.base import geometry
from bentwing.base.errors import NotEnoughDataError, PayloadError
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.trajectory import absolute_error
from bentwing.odometry.ndt import NdtSettings
from bentwing.recording import ImuBatch, LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess
from bentwing.simulate import Scenario, simulate

MOST_TILT = 0.015  # rad; the bias of the accelerometer is 4 to 7 mrad of it


def flown(folder, until, *, keep=lambda _: True, payload=None, settings=None):
    """The estimate of a flight's first seconds, and its truth."""
    payload = payload or Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
        engine = odometry.create("ndt", payload, settings, 2)
        for batch in preprocess(recording.batches(0.0, until), payload, Counter()):
            if keep(batch):
                engine.feed(batch)
    return engine.result(), truth


@pytest.fixture(scope="module")
def fixed(simulated):
    return flown(simulated("courtyard", 22.0, head="vlp16-fixed"), 22.0)


@pytest.fixture(scope="module")
def turned(simulated):
    return flown(simulated("courtyard", 22.0, head="vlp16-motor"), 22.0)


def test_a_fixed_lidar_is_followed_to_centimetres(fixed):
    estimate, truth = fixed
    error = absolute_error(estimate.trajectory, truth)
    assert error.position.rmse < 0.05
    assert error.position.maximum < 0.15
    assert not any("fit nowhere" in w for w in estimate.warnings)


def test_a_motor_turned_lidar_is_followed_to_a_decimetre(turned):
    """A scan sees a band of 30°; the keyframes of half a turn make up the rest."""
    estimate, truth = turned
    error = absolute_error(estimate.trajectory, truth)
    assert error.position.rmse < 0.12
    assert error.position.maximum < 0.3


def test_scan_lines_bent_over_roofs_do_not_hold_a_slowly_turning_head_back(made_once):
    """From 30 m most voxels hold a single scan line; taken for surfaces they cost 0.9° of yaw here.

    The first attitude, from which the error counts, is extrapolated from the middle of a scan in
    motion and known to a tenth of a degree or two.
    """
    scenario = Scenario(
        scene="town", motor_rate=0.5, seed=4, flight="survey", calibrated=True, duration=6.0
    )
    folder = made_once("town-0.5-4-6", lambda out: simulate(scenario, out))
    estimate, truth = flown(folder, 6.0)
    times = truth.times[(truth.times > 0.05) & estimate.trajectory.covers(truth.times)]
    _, true = truth.interpolate(times)
    _, found = estimate.trajectory.interpolate(times)
    errors = geometry.multiply(geometry.inverse(true), found)
    yaw = geometry.log(geometry.multiply(geometry.inverse(errors[0]), errors))[:, 2]
    assert abs(np.degrees(yaw[times > 2.0].mean())) < 0.35


def test_the_map_is_level(fixed):
    estimate, truth = fixed
    aligned = absolute_error(estimate.trajectory, truth).alignment
    assert np.arccos(aligned.R[2, 2]) < MOST_TILT


def test_the_imu_is_asked_for_the_vertical_and_nothing_else(simulated):
    folder = simulated("courtyard", 22.0, head="vlp16-fixed")
    estimate, _ = flown(folder, 6.0)
    alone, _ = flown(folder, 6.0, keep=lambda b: not isinstance(b, ImuBatch))
    turn = geometry.multiply(
        estimate.trajectory.quats_xyzw, geometry.inverse(alone.trajectory.quats_xyzw)
    )
    assert np.abs(geometry.log(turn) - geometry.log(turn[:1])).max() < 1e-9
    moved = geometry.rotate(turn[:1], alone.trajectory.positions)
    assert estimate.trajectory.positions == pytest.approx(moved, abs=1e-9)


def test_every_scan_tells_its_registration_error(fixed):
    estimate, _ = fixed
    errors = [w.registration_rmse for w in estimate.windows]
    assert len(errors) == estimate.counts["ndt.scans"] - 1 >= 215
    assert 0.01 < np.mean(errors) < 0.1  # m, of ranges with 20 mm off surfaces that are not flat


def test_a_carrier_at_rest_makes_no_keyframes(simulated):
    """The rest at the start lasts for more than three seconds."""
    estimate, _ = flown(simulated("courtyard", 22.0, head="vlp16-fixed"), 3.0)
    assert estimate.counts["ndt.keyframes"] == 1
    assert np.abs(estimate.trajectory.positions).max() < 0.02


@pytest.mark.slow
def test_the_last_keyframe_alone_is_not_enough_for_a_head_that_turns(simulated, turned):
    """The paper's reference: after a turn by 30° nothing of it is seen any more but the nadir."""
    folder = simulated("courtyard", 22.0, head="vlp16-motor")
    estimate, truth = flown(folder, 22.0, settings=NdtSettings(reference="last"))
    alone = absolute_error(estimate.trajectory, truth).position.rmse
    assert alone > 2 * absolute_error(turned[0].trajectory, truth).position.rmse


def test_a_silence_in_which_the_place_is_lost_cuts_the_trajectory(simulated):
    """Five metres and a turn farther on nothing fits where it is expected, or it fits by itself."""
    estimate, _ = flown(
        simulated("courtyard", 22.0, head="vlp16-fixed"),
        22.0,
        keep=lambda b: not isinstance(b, LidarBatch) or not 9.0 < b.times[0] < 17.0,
    )
    assert np.isfinite(estimate.trajectory.positions).all()
    assert np.diff(estimate.trajectory.times) == pytest.approx(0.01)
    for start, stop in estimate.segments:
        assert start < stop


def test_a_2d_lidar_is_refused_by_its_kind():
    payload = Payload.model_validate({"lidar": {"kind": "hokuyo-utm30lx"}})
    with pytest.raises(PayloadError, match=r"single planes.*--estimator continuous"):
        odometry.create("ndt", payload)


def test_a_2d_lidar_of_unknown_kind_is_refused_by_its_points():
    angles = np.linspace(0.0, 6.0, 2000)
    points = np.stack([5 * np.cos(angles), 4 * np.sin(angles), 0 * angles], axis=1)
    engine = odometry.create("ndt", Payload.default())
    with pytest.raises(NotEnoughDataError, match="one plane"):
        engine.feed(LidarBatch(points, np.linspace(0.0, 0.3, 2000)))


def test_a_motor_without_angles_is_refused(simulated):
    payload = Payload.load(simulated("courtyard", 22.0, head="vlp16-motor") / "payload.yaml")
    engine = odometry.create("ndt", payload)
    points = np.random.default_rng(0).normal(size=(1000, 3))
    with pytest.raises(ValueError, match="angles: expected the motor's angle"):
        engine.feed(LidarBatch(points, np.linspace(0.0, 0.3, 1000)))
