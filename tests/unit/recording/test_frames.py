# SPDX-License-Identifier: MIT OR Apache-2.0
"""Transforms that a payload refers to, read from the /tf_static of a recording."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import PayloadError
from bentwing.recording import Payload, Recording

UP = (0.0, 0.0, 0.0, 1.0)
LEFT = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5))  # 90° about z
BASE_IMU = ("base_link", "imu_link", (0.1, 0.0, 0.0), LEFT)
BASE_PLATE = ("base_link", "plate", (0.0, 0.0, 0.2), UP)
PLATE_LIDAR = ("plate", "lidar_link", (0.0, 0.3, 0.0), UP)
TREE = (BASE_IMU, BASE_PLATE, PLATE_LIDAR)
# From base_link: the lidar at (0, 0.3, 0.2), the IMU at (0.1, 0, 0), whose x is base's y and y its -x.
T_IMU_LIDAR = [[0, 1, 0, 0.3], [-1, 0, 0, 0.1], [0, 0, 1, 0.2], [0, 0, 0, 1]]


@pytest.fixture(scope="module")
def recorded(ros, head_entries, tmp_path_factory):
    """Return a maker of short recordings with transforms, fixed and moving."""
    folder = tmp_path_factory.mktemp("tf")

    def make(name, static=(), moving=(), kind="mcap"):
        path = folder / (f"{name}.bag" if ros.ros1 else name)
        if not path.exists():
            entries = [("/tf_static", 0.0, ros.tf(0.0, link)) for link in static]
            entries += [("/tf", 0.1, ros.tf(0.1, *moving))] if moving else []
            body = head_entries(ros, 1.0, encoder=True)
            ros.write(path, sorted([*entries, *body], key=lambda entry: entry[1]), kind=kind)
        return path

    return make


def payload(parent, child):
    reference = {"from_tf": {"parent": parent, "child": child}}
    return Payload.model_validate({"T_imu_lidar": reference})


def read(path, parent, child):
    with Recording(path, payload(parent, child), strict=False) as recording:
        return recording.payload.T_imu_lidar


def refusal(path, parent, child):
    with pytest.raises(PayloadError) as refused:
        read(path, parent, child)
    assert str(refused.value).startswith("T_imu_lidar.from_tf: ")
    return str(refused.value)


def test_one_static_transform_is_read_as_it_was_sent(recorded):
    given = read(recorded("tree", TREE), "base_link", "imu_link")
    assert given.from_tf is None
    np.testing.assert_allclose(given.translation, (0.1, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(given.quaternion, LEFT, atol=1e-12)


def test_a_chain_through_several_frames_is_followed_up_and_down(recorded):
    given = read(recorded("tree", TREE), "imu_link", "lidar_link")
    np.testing.assert_allclose(given.pose.matrix, T_IMU_LIDAR, atol=1e-11)


def test_the_other_direction_is_the_inverse(recorded):
    path = recorded("tree", TREE)
    there = read(path, "imu_link", "lidar_link").pose.matrix
    back = read(path, "lidar_link", "imu_link").pose.matrix
    np.testing.assert_allclose(there @ back, np.eye(4), atol=1e-11)
    assert not np.allclose(there, back, atol=0.1)


def test_the_latest_of_several_transforms_of_one_frame_holds(recorded):
    moved = ("base_link", "imu_link", (0.5, 0.0, 0.0), UP)
    path = recorded("twice", (*TREE, moved))
    assert read(path, "base_link", "imu_link").translation == (0.5, 0.0, 0.0)


def test_the_slash_of_the_first_tf_makes_no_other_frame(recorded):
    path = recorded("slash", [("/base_link", "/imu_link", (0.1, 0.0, 0.0), UP)])
    assert read(path, "base_link", "/imu_link").translation == (0.1, 0.0, 0.0)


def test_both_transforms_of_a_motor_are_read(recorded):
    of_motor = {
        "T_imu_motor": {"from_tf": {"parent": "imu_link", "child": "plate"}},
        "T_motor_lidar": {"from_tf": {"parent": "plate", "child": "lidar_link"}},
    }
    head = Payload.model_validate({"encoder": of_motor})
    with Recording(recorded("tree", TREE), head, strict=False) as recording:
        encoder = recording.payload.encoder
    assert encoder.T_motor_lidar.translation == (0.0, 0.3, 0.0)
    whole = encoder.T_imu_motor.pose.matrix @ encoder.T_motor_lidar.pose.matrix
    np.testing.assert_allclose(whole, T_IMU_LIDAR, atol=1e-11)


def test_a_missing_frame_is_named_with_those_that_there_are(recorded):
    said = refusal(recorded("tree", TREE), "imu_link", "lidar_lnk")
    assert "no frame 'lidar_lnk'" in said
    assert "did you mean lidar_link?" in said
    assert "base_link, imu_link, lidar_link, plate" in said


def test_a_recording_without_static_transforms_says_so(recorded):
    said = refusal(recorded("none"), "imu_link", "lidar_link")
    assert "the recording has no /tf_static" in said
    assert "give translation and quaternion" in said


def test_a_moving_joint_on_the_way_is_named(recorded):
    turning = ("plate", "lidar_link", (0.0, 0.3, 0.0), LEFT)
    path = recorded("joint", (BASE_IMU, BASE_PLATE), [turning])
    said = refusal(path, "imu_link", "lidar_link")
    assert "between plate and lidar_link" in said
    assert "name it in the section encoder as 'from_tf" in said


def test_frames_that_nothing_joins_are_said_to_be_apart(recorded):
    path = recorded("apart", (BASE_IMU, PLATE_LIDAR))
    assert "no chain of static transforms joins imu_link and lidar_link" in refusal(
        path, "imu_link", "lidar_link"
    )


@pytest.mark.parametrize(
    ("name", "t", "quat", "figure"),
    [
        ("zero", (0.1, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), "norm 0,"),
        ("nan", (np.nan, 0.0, 0.0), UP, "nan"),
        ("far", (99.0, 0.0, 0.0), UP, "99 m long"),
    ],
)
def test_a_transform_that_is_none_is_refused_with_its_figure(recorded, name, t, quat, figure):
    path = recorded(name, [("imu_link", "lidar_link", t, quat)])
    assert figure in refusal(path, "imu_link", "lidar_link")


def test_a_damaged_message_is_passed_over(ros, head_entries, tmp_path):
    class Broken:
        __msgtype__ = "tf2_msgs/msg/TFMessage"

    whole = ros.tf(0.0, BASE_IMU)
    serialize = ros.serialize
    path = tmp_path / ("a.bag" if ros.ros1 else "a")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            ros,
            "serialize",
            lambda m: serialize(whole)[:-9] if isinstance(m, Broken) else serialize(m),
        )
        entries = [("/tf_static", 0.0, Broken()), ("/tf_static", 0.0, whole)]
        ros.write(path, [*entries, *head_entries(ros, 1.0)])
    assert read(path, "base_link", "imu_link").translation == (0.1, 0.0, 0.0)
