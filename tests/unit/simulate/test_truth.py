# SPDX-License-Identifier: MIT OR Apache-2.0
"""The physics of a recording: frames, signs and clocks, each sharp enough to catch a slip."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bentwing.simulate.imu import GRAVITY, specific_force
from bentwing.simulate.kinematics import apply
from bentwing.simulate.records import CloudRecord, EncoderRecord, ImuRecord, ScanRecord

from .conftest import WINDOW, lidar_points, recorded

HEADS = ["hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-motor"]
OWN_BODY = 0.9
"""m; what is nearer may be the carrier."""


def place(setup, points, stamps, latency):
    """Points in the map, by the exact motion of the lidar."""
    motion = setup.rig.lidar(stamps - latency)
    return motion.p + apply(motion.R, points), motion.p


def range_residuals(setup, records):
    """Measured less true range (N,), by the distance to the mesh along the beam."""
    points, stamps = lidar_points(records)
    points, stamps = points[::5], stamps[::5]
    placed, origins = place(setup, points, stamps, setup.sensors.clock.latency)
    distances, faces = setup.world.scene.distance(placed)
    beams = (placed - origins) / np.linalg.norm(points, axis=1, keepdims=True)
    cosines = -np.einsum("ni,ni->n", setup.world.normals[faces], beams)
    ranges = np.linalg.norm(points, axis=1)
    seen = (ranges > OWN_BODY) & (abs(cosines) > 0.4)
    return -distances[seen] / cosines[seen]


@pytest.mark.parametrize("head", HEADS)
def test_noiseless_points_lie_on_the_scene(head):
    setup, records = recorded(head)
    residuals = range_residuals(setup, records)
    assert len(residuals) > 4000
    # float32 ranges and times (60 ns at 0.1 s) leave a few micrometres.
    assert abs(residuals).max() < 2e-5


@pytest.mark.parametrize(("head", "sigma"), [("hokuyo-spin", 0.01), ("vlp16-motor", 0.02)])
def test_noisy_points_scatter_by_the_range_noise(head, sigma):
    setup, records = recorded(head, noiseless=False)
    # The stamps' jitter would move the points too.
    residuals = range_residuals(setup, records)
    inliers = residuals[abs(residuals) < 5 * sigma]
    assert len(inliers) > 0.97 * len(residuals)
    assert np.std(inliers) == pytest.approx(sigma, rel=0.06)
    assert abs(np.mean(inliers)) < 0.05 * sigma


def test_a_wrong_sign_of_the_latency_is_seen():
    setup, records = recorded()
    points, stamps = lidar_points(records)
    far = np.linalg.norm(points, axis=1) > OWN_BODY
    latency = setup.sensors.clock.latency
    placed, _ = place(setup, points[far], stamps[far], -latency)
    assert np.median(abs(setup.world.scene.distance(placed)[0])) > 1e-3


@pytest.mark.parametrize("head", ["hokuyo-spin", "hokuyo-nod"])
def test_integrating_the_perfect_imu_gives_the_true_motion(head):
    setup, _ = recorded(head)
    dt = 5e-4
    times = np.arange(1.0, 20.0, dt)
    truth = setup.rig.imu(times)
    gyro, force = truth.omega, specific_force(truth)
    # Second-order step with the coning term (Savage 1998).
    coning = np.cross(gyro[:-1], gyro[1:]) * dt**2 / 12
    steps = Rotation.from_rotvec((gyro[:-1] + gyro[1:]) * dt / 2 + coning).as_matrix()
    R = np.empty_like(truth.R)
    R[0] = truth.R[0]
    for i, step in enumerate(steps):
        R[i + 1] = R[i] @ step
    a = apply(R, force) - GRAVITY
    v = truth.v[0] + np.vstack([np.zeros(3), np.cumsum((a[:-1] + a[1:]) * dt / 2, axis=0)])
    p = truth.p[0] + np.vstack([np.zeros(3), np.cumsum((v[:-1] + v[1:]) * dt / 2, axis=0)])
    off = Rotation.from_matrix(R[-1].T @ truth.R[-1]).magnitude()
    assert off < 1e-5
    assert np.linalg.norm(p[-1] - truth.p[-1]) < 2e-3
    assert np.ptp(truth.p, axis=0).max() > 1.0


def test_an_imu_at_rest_feels_gravity_upwards():
    setup, _ = recorded()
    at_rest = setup.rig.imu(np.linspace(0.0, 3.0, 50))
    np.testing.assert_allclose(at_rest.omega, 0.0, atol=1e-14)
    upwards = apply(at_rest.R, specific_force(at_rest))
    np.testing.assert_allclose(upwards, np.tile(GRAVITY, (50, 1)), atol=1e-12)


def test_the_same_seed_gives_the_same_records_and_another_seed_others():
    _, first = recorded(noiseless=False)
    recorded.cache_clear()
    _, again = recorded(noiseless=False)
    _, other = recorded(noiseless=False, seed=1)
    for a, b in zip(first, again, strict=True):
        assert a.stamp == b.stamp
        assert a.arrival == b.arrival
    scans = [[r for r in rs if isinstance(r, ScanRecord)] for rs in (first, again, other)]
    np.testing.assert_array_equal(scans[0][7].ranges, scans[1][7].ranges)
    assert not np.array_equal(scans[0][7].ranges, scans[2][7].ranges)


def test_the_rates_are_those_of_the_sensors():
    _, spun = recorded()
    _, turned = recorded("vlp16-motor")
    kinds = [type(r) for r in spun]
    assert kinds.count(ScanRecord) == 100
    assert kinds.count(ImuRecord) == 200
    assert [type(r) for r in turned].count(CloudRecord) == 10
    assert [type(r) for r in turned].count(EncoderRecord) == 200


def test_records_come_in_order_of_arrival_and_after_they_were_measured():
    _, records = recorded("vlp16-motor", noiseless=False)
    arrivals = [record.arrival for record in records]
    assert arrivals == sorted(arrivals)
    assert all(r.arrival > r.stamp for r in records if isinstance(r, ImuRecord))


def test_the_encoder_reads_the_motor_less_its_zero():
    setup, records = recorded("vlp16-motor", noiseless=False)
    encoder = setup.rig.head.encoder
    read = [r for r in records if isinstance(r, EncoderRecord)]
    true = encoder.angle(np.array([r.stamp for r in read]))[:, 0] - encoder.zero
    difference = np.array([r.angle for r in read]) - true
    wrapped = (difference + np.pi) % (2 * np.pi) - np.pi
    assert abs(wrapped).max() < 6 * encoder.sigma


@pytest.mark.parametrize("head", HEADS)
def test_the_carrier_stays_clear_of_the_scene(head):
    setup, _ = recorded(head)
    times = np.arange(WINDOW[0] - 1.0, WINDOW[1] + 3.0, 0.05)
    origins = setup.rig.carrier.motion(times).p
    assert setup.world.clearance(origins).min() > (0.45 if head == "hokuyo-nod" else 0.8)
