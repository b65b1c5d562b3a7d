# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the payload says of a set-up, found again in the samples of a recording."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import PayloadError, RecordingError
from bentwing.recording import EncoderBatch, ImuBatch, LidarBatch, Payload, Recording
from bentwing.recording.described import described_calibration

GYRO, ACCEL = (0.1, 0.2, 0.3), (1.0, 2.0, 9.5)
START_NS = 1_700_000_000 * NS_PER_S  # of what the fixtures write
SCAN_HZ, IMU_HZ, N = 40, 100, 100


def head(*, lidar=None, imu=None, encoder=None):
    """The payload with something said of a sensor."""
    values = {"lidar": lidar or {}, "imu": imu or {}}
    mount = {"T_imu_lidar": {}} if encoder is None else {"encoder": {"T_imu_motor": {}} | encoder}
    return Payload.model_validate(values | mount)


def imu(ros, i, gyro, accel, late_ns):
    """A sample whose stamp is a whole number of ns, on any clock."""
    message = ros.imu(0.0, gyro, accel)
    stamp = message.header.stamp
    stamp.sec, stamp.nanosec = divmod(START_NS + i * (NS_PER_S // IMU_HZ) + late_ns, NS_PER_S)
    return message


def entries(
    ros,
    *,
    gyro=GYRO,
    accel=ACCEL,
    imu_late_ns=0,
    ranges=None,
    joints=None,
    names=("motor",),
    **scan,
):
    """Messages of a lidar, an IMU, and where positions over time are given, an encoder."""
    found = [("/scan", i / SCAN_HZ, ros.scan(i / SCAN_HZ, ranges, **scan)) for i in range(40)]
    found += [("/imu", i / IMU_HZ, imu(ros, i, gyro, accel, imu_late_ns)) for i in range(N)]
    if joints is not None:
        found += [
            ("/joints", i / IMU_HZ, ros.joint(i / IMU_HZ, joints(i / IMU_HZ), names=names))
            for i in range(N)
        ]
    return sorted(found, key=lambda entry: entry[1])


@pytest.fixture
def read(tmp_path, ros1):
    """Return a function: what of one kind a recording with these messages gives, joined."""

    def read(kind, payload, **messages):
        path = ros1.write(
            tmp_path / f"{len(list(tmp_path.iterdir()))}.bag", entries(ros1, **messages)
        )
        with Recording(path, payload) as recording:
            found = [batch for batch in recording.batches() if isinstance(batch, kind)]
            read.recording = recording
        names = {LidarBatch: "points", ImuBatch: "gyro accel", EncoderBatch: "angles"}[kind]
        return [np.concatenate([getattr(b, n) for b in found]) for n in ("times", *names.split())]

    return read


def test_a_payload_that_says_nothing_of_the_set_up_changes_no_bit(read):
    _, gyro, accel = read(ImuBatch, head())
    assert gyro.tobytes() == np.tile(GYRO, (N, 1)).tobytes()
    assert accel.tobytes() == np.tile(ACCEL, (N, 1)).tobytes()


def test_axes_of_the_imu_are_taken_with_their_signs(read):
    _, gyro, accel = read(ImuBatch, head(imu={"axes": ["y", "-x", "z"]}))
    np.testing.assert_array_equal(gyro[0], [0.2, -0.1, 0.3])
    np.testing.assert_array_equal(accel[0], [2.0, -1.0, 9.5])


def test_a_left_handed_imu_is_read(read):
    _, gyro, accel = read(ImuBatch, head(imu={"axes": ["x", "y", "-z"]}), accel=(1.0, 2.0, -9.5))
    np.testing.assert_array_equal(gyro[0], [0.1, 0.2, -0.3])
    np.testing.assert_array_equal(accel[0], ACCEL)


def test_the_gyro_may_have_axes_of_its_own(read):
    _, gyro, accel = read(ImuBatch, head(imu={"gyro_axes": ["z", "x", "y"]}))
    np.testing.assert_array_equal(gyro[0], [0.3, 0.1, 0.2])
    np.testing.assert_array_equal(accel[0], ACCEL)


@pytest.mark.parametrize(
    ("unit", "factor"), [("g", 9.80665), ("milli-g", 9.80665e-3), ("cm/s2", 0.01), ("cm/s²", 0.01)]
)
def test_accelerations_in_the_units_of_drivers_are_read_and_not_refused(read, unit, factor):
    payload = head(imu={"units": {"accel": unit}})
    _, _, accel = read(ImuBatch, payload, accel=np.array(ACCEL) / factor)
    np.testing.assert_allclose(accel[0], ACCEL, rtol=1e-12)


def test_rates_in_degrees_are_read_and_not_refused(read):
    fast = np.array([0.0, 0.0, 4.0])
    in_degrees = np.degrees(fast)
    with pytest.raises(RecordingError, match=r"deg/s .*'imu: \{units: \{gyro: deg/s\}\}'"):
        read(ImuBatch, head(), gyro=in_degrees)
    _, gyro, _ = read(ImuBatch, head(imu={"units": {"gyro": "deg/s"}}), gyro=in_degrees)
    np.testing.assert_allclose(gyro[0], fast, rtol=1e-12)


def test_the_wrong_unit_is_refused_as_the_samples_in_the_right_one_were(read):
    payload = head(imu={"units": {"accel": "milli-g"}})
    with pytest.raises(RecordingError, match=r"accelerations have a median length of 0\.0957"):
        read(ImuBatch, payload)


def test_units_of_the_payload_that_the_samples_contradict_are_refused(read):
    with pytest.raises(
        RecordingError, match=r"payload says .* in g, but .* 9\.76 is gravity in m/s²"
    ):
        read(ImuBatch, head(imu={"units": {"accel": "g"}}))


def test_a_clock_from_power_on_is_put_on_the_lidars_without_losing_a_nanosecond(read):
    late_ns = 12_345_678_901 - START_NS
    with pytest.raises(RecordingError, match=r"'imu: \{clock_offset: 1699999987\.654\}'"):
        read(ImuBatch, head(), imu_late_ns=late_ns)
    offset = 1_699_999_987.0  # which a float holds exactly
    times, *_ = read(ImuBatch, head(imu={"clock_offset": offset}), imu_late_ns=late_ns)
    assert times.tolist() == [i / IMU_HZ for i in range(N)]
    # The IMU comes first: its samples are put 0.65 s before the scans.
    assert read.recording.start_ns == 12_345_678_901 + int(offset) * NS_PER_S


def test_a_large_latency_is_taken_off_the_stamps_and_a_small_one_left_to_the_estimator(read):
    for latency, read_off in ((0.9, 0.9), (-0.9, -0.9), (0.05, 0.0), (0.004, 0.0)):
        payload = head(lidar={"latency": latency})
        times, _ = read(LidarBatch, payload)
        start = (read.recording.start_ns - START_NS) / NS_PER_S
        assert times[0] + start == pytest.approx(-read_off, abs=1e-9)
        calibration = described_calibration(payload)
        assert calibration.latency == pytest.approx(latency - read_off, abs=1e-12)
        assert calibration.source_latency == pytest.approx(latency)


def test_the_encoder_stays_on_the_lidars_clock_when_a_latency_is_taken_off(read):
    joints = {"joints": lambda t: t}
    payload = head(lidar={"latency": 0.9}, encoder={})
    times, angles = read(EncoderBatch, payload, **joints)
    lidar, _ = read(LidarBatch, payload, **joints)
    assert times[0] - angles[0] == pytest.approx(lidar[0], abs=1e-9)


def test_mirrored_scans_are_turned_round(read):
    _, plain = read(LidarBatch, head())
    _, mirrored = read(LidarBatch, head(lidar={"mirrored": True}))
    np.testing.assert_array_equal(mirrored, plain * [1, -1, 1])


@pytest.mark.parametrize("range_max", [30.0, 30_000.0])
def test_scans_in_millimetres_are_read_whatever_the_unit_of_their_limits(read, range_max):
    _, plain = read(LidarBatch, head(), ranges=np.linspace(2.0, 20.0, 100))
    _, scaled = read(
        LidarBatch,
        head(lidar={"range_scale": 1e-3}),
        ranges=np.linspace(2000.0, 20_000.0, 100),
        range_min=range_max / 300,
        range_max=range_max,
    )
    np.testing.assert_allclose(scaled, plain, rtol=1e-6)


def test_an_encoder_in_degrees_that_grows_the_other_way_is_unwrapped_in_radians(read):
    turning = {"joints": lambda t: (-np.degrees(3.0 * t) + 180.0) % 360.0 - 180.0}
    _, angles = read(EncoderBatch, head(encoder={"unit": "deg", "sign": -1}), **turning)
    np.testing.assert_allclose(np.diff(angles), 3.0 / IMU_HZ, rtol=1e-9)


def test_an_encoder_with_a_clock_of_its_own_is_put_on_the_lidars(read):
    times, _ = read(EncoderBatch, head(encoder={"clock_offset": 2.5}), joints=lambda t: t)
    assert times[0] == pytest.approx(2.5, abs=1e-9)


def two_joints(**encoder):
    return head(encoder=encoder), {"joints": lambda t: (7.0, t), "names": ("pan", "motor")}


def test_the_joint_that_the_payload_names_is_read(read):
    payload, messages = two_joints(joint="motor")
    times, angles = read(EncoderBatch, payload, **messages)
    np.testing.assert_allclose(angles, times, atol=1e-9)
    assert read.recording.joints == ("pan", "motor")
    assert not read.recording.warnings


def test_the_first_of_several_joints_is_read_with_a_warning_where_none_is_named(read):
    payload, messages = two_joints()
    _, angles = read(EncoderBatch, payload, **messages)
    assert (angles == 7.0).all()
    (warning,) = read.recording.warnings
    assert "joints pan, motor the first, pan, is taken" in warning
    assert "'encoder: {joint: ...}'" in warning


def test_a_joint_that_no_message_has_is_refused_with_those_there_are(read):
    payload, messages = two_joints(joint="tilt")
    with pytest.raises(RecordingError, match=r"joint tilt.*they have pan, motor"):
        read(EncoderBatch, payload, **messages)


@pytest.mark.parametrize(
    ("section", "parts"),
    [
        ("imu: {axes: [x, x, z]}", ["imu.axes", "[x, x, z]", "each of x, y and z once"]),
        ("imu: {axes: [x, y]}", ["imu.axes"]),
        ("imu: {gyro_axes: [x, y, w]}", ["imu.gyro_axes", "'w'"]),
        ("imu: {units: {accel: mg}}", ["imu.units.accel", "milli-g", "'mg'"]),
        ("imu: {clock_offset: 1.0e+12}", ["imu.clock_offset"]),
        ("lidar: {range_scale: 0}", ["lidar.range_scale"]),
        ("lidar: {latency: 2}", ["lidar.latency", "1.5"]),
        ("encoder: {sign: 0}", ["encoder.sign", "1 or -1"]),
        ("encoder: {unit: degrees}", ["encoder.unit", "'deg'"]),
    ],
)
def test_what_cannot_be_a_set_up_is_refused_with_its_place(tmp_path, section, parts):
    path = tmp_path / "payload.yaml"
    path.write_text(section)
    with pytest.raises(PayloadError) as caught:
        Payload.load(path)
    assert all(part in str(caught.value) for part in parts), str(caught.value)
