# SPDX-License-Identifier: MIT OR Apache-2.0
"""Transforms that a payload refers to in the URDF of a robot."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import PayloadError
from bentwing.recording import Payload

ROBOT = """<?xml version="1.0"?>
<robot name="rover">
  <link name="base_link"/><link name="imu_link"/><link name="plate"/><link name="lidar_link"/>
  <joint name="imu" type="fixed">
    <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/>
    <parent link="base_link"/><child link="imu_link"/>
  </joint>
  <joint name="plate" type="fixed">
    <origin xyz="0 0 0.2"/><parent link="base_link"/><child link="plate"/>
  </joint>
  <joint name="lidar" type="{kind}">
    <origin xyz="0 0.3 0" rpy="0 0 0"/><parent link="plate"/><child link="lidar_link"/>
    <axis xyz="0 0 1"/>
  </joint>
  <transmission name="t"><joint name="lidar"/></transmission>
</robot>
"""
T_IMU_LIDAR = [[0, 1, 0, 0.3], [-1, 0, 0, 0.1], [0, 0, 1, 0.2], [0, 0, 0, 1]]


def load(folder, text=None, *, parent="imu_link", child="lidar_link", kind="fixed"):
    (folder / "robot.urdf").write_text(ROBOT.format(kind=kind) if text is None else text)
    payload = folder / "payload.yaml"
    payload.write_text(
        f"T_imu_lidar: {{from_urdf: {{file: robot.urdf, parent: {parent}, child: {child}}}}}"
    )
    return Payload.load(payload)


def test_fixed_joints_are_followed_up_and_down_beside_the_payload(tmp_path):
    head = load(tmp_path)
    np.testing.assert_allclose(head.T_imu_lidar_matrix(), T_IMU_LIDAR, atol=1e-11)
    assert "urdf" not in head.to_yaml()
    assert not head.refers_to_recording


def test_the_angles_of_an_origin_are_about_the_fixed_axes_x_y_z(tmp_path):
    text = ROBOT.format(kind="fixed").replace('rpy="0 0 0"', 'rpy="0.3 -0.2 0.5"')
    given = load(tmp_path, text, parent="plate").T_imu_lidar
    direct = Payload.model_validate(
        {"T_imu_lidar": {"translation": [0, 0.3, 0], "rpy": [0.3, -0.2, 0.5]}}
    ).T_imu_lidar
    np.testing.assert_allclose(given.pose.matrix, direct.pose.matrix, atol=1e-11)


ENTITIES = '<!DOCTYPE robot [<!ENTITY a "aaaa">]><robot name="&a;"/>'


@pytest.mark.parametrize(
    ("text", "names", "sentence"),
    [
        (None, {"child": "lidar_lnk"}, r"no joint of a link 'lidar_lnk'; did you mean lidar_link"),
        (None, {"kind": "continuous"}, r"moves between plate and lidar_link \(continuous\)"),
        (ENTITIES, {}, "has a DOCTYPE"),
        ("<robot", {}, "is no XML"),
        ("<sdf/>", {}, "no URDF: it begins with <sdf>"),
        ('<robot xmlns:xacro="x"><xacro:macro/></robot>', {}, "expand it with"),
        (ROBOT.replace("0.1 0 0", "0.1 0"), {"kind": "fixed"}, "origin of joint imu is '0.1 0'"),
        ('<robot><joint name="a"/></robot>', {}, "no joint of a link 'imu_link'"),
    ],
)
def test_what_does_not_tell_the_pose_is_refused(tmp_path, text, names, sentence):
    with pytest.raises(PayloadError, match=sentence) as refused:
        load(tmp_path, text, **names)
    assert "T_imu_lidar" in str(refused.value)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("robot.urdf", "names file, parent and child"),
        ("{file: none.urdf, parent: a, child: b}", "none.urdf cannot be read"),
        ("{file: robot.urdf, parent: a}", "names file, parent and child"),
    ],
)
def test_a_reference_that_leads_nowhere_is_refused(tmp_path, given, sentence):
    path = tmp_path / "payload.yaml"
    path.write_text(f"T_imu_lidar: {{from_urdf: {given}}}")
    with pytest.raises(PayloadError, match=sentence):
        Payload.load(path)
