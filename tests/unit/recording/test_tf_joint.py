# SPDX-License-Identifier: MIT OR Apache-2.0
"""The motion of a joint by /tf is the encoder of a turned lidar."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import PayloadError, RecordingError
from bentwing.recording import Payload, Recording
from bentwing.recording.batches import EncoderBatch

ORIGIN = np.array([0.05, 0.0, 0.1])
TILT = geometry.exp(np.array([0.0, 0.6, 0.0]))  # of the motor on the plate
T_PLATE = (0.0, 0.0, 0.2)
RATE = 4.0  # rad/s
UP = (0.0, 0.0, 0.0, 1.0)
STATIC = (
    ("imu_link", "plate", T_PLATE, UP),
    ("rotor", "lidar_link", (0.0, 0.0, 0.03), UP),
)


def turned(angle, axis=(0.0, 0.0, 1.0), origin=ORIGIN, tilt=TILT):
    quat = geometry.multiply(tilt, geometry.exp(angle * np.array(axis)))
    return ("plate", "rotor", origin, quat)


@pytest.fixture
def recorded(ros, head_entries, tmp_path):
    """Return a maker of recordings with a turning joint in /tf, among others."""

    def make(link_of=lambda angle: turned(angle)):
        entries = [("/tf_static", 0.0, ros.tf(0.0, link)) for link in STATIC]
        for i in range(200):
            t = i / 100
            entries.append(("/tf", t + 0.001, ros.tf(t, ("map", "odom", (t, 0, 0), UP))))
            entries.append(("/tf", t + 0.002, ros.tf(t, link_of(RATE * t))))
        entries += head_entries(ros, 2.0)
        path = tmp_path / ("a.bag" if ros.ros1 else "a")
        return ros.write(path, sorted(entries, key=lambda entry: entry[1]))

    return make


def head(*, motor="rotor", **values):
    encoder = {
        "from_tf": {"parent": "plate", "child": "rotor"},
        "T_imu_motor": {"from_tf": {"parent": "imu_link", "child": motor}},
        "T_motor_lidar": {"from_tf": {"parent": "rotor", "child": "lidar_link"}},
    }
    return Payload.model_validate({"encoder": encoder | values})


def angles_of(path, payload):
    with Recording(path, payload) as recording:
        found = [b for b in recording.batches() if isinstance(b, EncoderBatch)]
        counts = recording.counts
        encoder = recording.payload.encoder
    return (
        *(np.concatenate([getattr(b, n) for b in found]) for n in ("times", "angles")),
        encoder,
        counts,
    )


def test_the_turn_of_a_joint_is_read_and_unwrapped(recorded):
    times, angles, _, counts = angles_of(recorded(), head())
    assert len(times) == 200
    np.testing.assert_allclose(angles - angles[0], RATE * times, atol=1e-6)
    assert np.ptp(angles) > 2 * np.pi
    assert counts["encoder.other_joints"] == 200


def test_both_sides_of_the_joint_make_the_pose_that_tf_says(recorded):
    times, angles, encoder, _ = angles_of(recorded(), head())
    for t, angle in zip(times[::37], angles[::37], strict=True):
        _, _, origin, quat = turned(RATE * t)
        expected = np.array(T_PLATE) + origin + geometry.rotate(quat, np.array([0.0, 0.0, 0.03]))
        motor, lidar = encoder.T_imu_motor.pose, encoder.T_motor_lidar.pose
        turn = geometry.exp(angle * np.array(encoder.axis))
        found = motor.matrix[:3, 3] + motor.matrix[:3, :3] @ geometry.rotate(
            turn, lidar.matrix[:3, 3]
        )
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_the_sign_of_the_payload_holds_for_it_too(recorded):
    _, angles, *_ = angles_of(recorded(), head(sign=-1))
    assert angles[-1] < -7.0


@pytest.mark.parametrize(
    ("link_of", "values", "error", "sentence"),
    [
        (turned, {"axis": [0, 1, 0]}, RecordingError, r"but about \[0\.000, 0\.000, 1\.000\]"),
        (turned, {"motor": "plate"}, PayloadError, "give 'child: rotor'"),
        (
            lambda angle: turned(0.0, origin=(0.1 * angle, 0, 0)),
            {},
            RecordingError,
            "moves by .* m while",
        ),
        (
            lambda angle: turned(angle, tilt=geometry.exp(np.array([np.pi, 0, 0]))),
            {},
            RecordingError,
            "upside down",
        ),
        (
            turned,
            {"from_tf": {"parent": "plate", "child": "mast"}, "T_imu_motor": {}},
            RecordingError,
            "does not come in it",
        ),
    ],
)
def test_a_joint_that_is_not_as_the_payload_says_is_refused(
    recorded, link_of, values, error, sentence
):
    with pytest.raises(error, match=sentence):
        Recording(recorded(link_of), head(**values), strict=False)


def test_a_recording_without_moving_tf_has_no_such_encoder(ros1, head_entries, tmp_path):
    path = ros1.write(tmp_path / "a.bag", head_entries(ros1, 1.0))
    payload = Payload.model_validate({"encoder": {"from_tf": {"parent": "a", "child": "b"}}})
    with pytest.raises(RecordingError, match="no topic of type tf2_msgs/msg/TFMessage"):
        Recording(path, payload, strict=False)


@pytest.mark.parametrize("key", [{"joint": "motor"}, {"unit": "deg"}])
def test_what_tf_does_not_have_is_not_asked_of_it(key):
    with pytest.raises(ValueError, match="leave joint and unit out"):
        Payload.model_validate({"encoder": {"from_tf": {"parent": "a", "child": "b"}} | key})
