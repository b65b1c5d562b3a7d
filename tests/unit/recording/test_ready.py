# SPDX-License-Identifier: MIT OR Apache-2.0
"""The payloads that come with bentwing: their form, their sources, and transforms made anew from these."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from bentwing.base.errors import PayloadError
from bentwing.recording import Payload, Recording
from bentwing.recording.payload import as_payload
from bentwing.recording.ready import PREFIX, payload_path, ready_payloads
from bentwing.recording.topics import resolve

READY = ready_payloads()
PAGE = Path(__file__).parents[3] / "docs" / "datasets.md"
of_each = pytest.mark.parametrize("ready", READY, ids=lambda one: one.name)


def pose(translation, *, quat=None, rpy=None):
    """(4, 4) from a URDF's rpy, or a quaternion x y z w."""
    matrix = np.eye(4)
    rotation = Rotation.from_quat(quat) if rpy is None else Rotation.from_euler("xyz", rpy)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), translation
    return matrix


def between(T_base_imu, T_base_lidar):
    return np.linalg.inv(T_base_imu) @ T_base_lidar


# From what the sources give, each as it stands there.
MADE_ANEW = {
    "newer-college-2020": between(
        pose([6.253e-3, -11.775e-3, 7.645e-3], quat=[0, 0, 0, 1]),
        pose([0, 0, 36.18e-3], quat=[0, 0, 1, 0]),
    ),
    "oxford-spires": between(
        pose(
            [-0.0008544600980918986, 0.005115741648037186, -0.06898747851173177],
            quat=[0.0042909719518877815, -0.7085293318962699, 0.705668106144218, 0.0005453193252705428],
        ),
        pose(
            [0.00035060884033447846, -0.079574053851818, -0.053826061545697405],
            quat=[0.5034725628949727, 0.5003337192107279, -0.4947539264483171, 0.5013981452864594],
        ),
    ),
    "grand-tour": between(
        pose(
            [0.2957044989290818, -0.061128744866863934, 0.16350284167378368],
            rpy=[3.1413487385824572, 0.0026837131690162774, -0.0006173323019130506],
        ),
        pose(
            [0.30124877107935666, -0.033792163092416165, -0.008073477131669393],
            rpy=[-3.1369486215758, 0.0019805316850838306, -1.5756556464922145],
        ),
    ),
    "hilti-2023-robot": pose(
        [0.13372435098296154, -0.011301799498041736, 0.010893033077978013],
        rpy=[3.1330375472345637, -0.03502513872030596, -0.003399364361300018],
    ),
    "m2dgr": np.linalg.inv(pose([-0.27255, 0.00053, -0.17954], quat=[0, 0, 0, 1])),
    "livox-mid360": np.linalg.inv(pose([11e-3, 23.29e-3, -44.12e-3], quat=[0, 0, 0, 1])),
    "botanic-garden": np.array(
        [
            [-0.00140533, -0.00896721, 0.99995881, 0.18377395],
            [-0.99999022, 0.0042065, -0.00136765, 0.14789743],
            [-0.00419407, -0.99995095, -0.00897304, -0.0087318],
            [0, 0, 0, 1],
        ]
    )
    @ [
        [0.0238743541600432, -0.999707744440396, 0.00360642510766516, 0.138922870923538],
        [-0.00736968896588375, -0.00378431903190059, -0.999965147452649, -0.177101909101325],
        [0.999687515506770, 0.0238486947027063, -0.00745791352160211, -0.126685267545513],
        [0, 0, 0, 1],
    ],
}  # fmt: skip


@of_each
def test_a_ready_payload_reads_as_a_head_that_can_be_mapped(ready):
    head = as_payload(PREFIX + ready.name)
    assert head.name == ready.name
    assert head.imu is None or head.places_lidar_on_imu
    assert not head.refers_to_recording


@of_each
def test_a_ready_payload_has_a_title_and_the_source_of_all_that_it_says(ready):
    text = ready.path.read_text(encoding="utf-8")
    comment = "".join(line for line in text.splitlines(keepends=True) if line.startswith("#"))
    assert ": " in ready.title
    assert re.search(r"^# Topics.*: https://", comment, re.MULTILINE)
    if "T_imu_lidar:" in text:
        assert re.search(r"^# (Topics, t|T)ransform.*: .*https://", comment, re.MULTILINE)
        assert re.search(r"^# (.*\bn|N)oise", comment, re.MULTILINE)


@of_each
def test_a_ready_rotation_is_one_to_the_digits_of_its_source(ready):
    given = yaml.safe_load(ready.path.read_text(encoding="utf-8")).get("T_imu_lidar")
    if given is None:
        return
    if "matrix" in given:
        rotation = np.array(given["matrix"])[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-5)
        assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-5)
    else:
        assert np.linalg.norm(given["quaternion"]) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("name", MADE_ANEW)
def test_a_ready_transform_follows_from_its_source(name):
    found = as_payload(PREFIX + name).T_imu_lidar_matrix()
    np.testing.assert_allclose(found, MADE_ANEW[name], atol=2e-5)


def test_the_joints_of_the_hilti_scanner_confirm_the_lever_arm_and_its_direction():
    mount = pose([-65.21e-3, -0.109e-3, 177e-3], quat=[0, 0, 0, 1])
    imu = mount @ pose([6e-3, -8.55e-3, 17.4e-3], rpy=[np.pi, 0, 0])
    lidar = pose([-59.957e-3, 0.015e-3, 93e-3 + 46.4e-3], quat=[0, 0, 0, 1])
    found = as_payload(PREFIX + "hilti-2022").T_imu_lidar_matrix()
    np.testing.assert_allclose(found[:3, 3], between(imu, lidar)[:3, 3], atol=5e-4)
    assert found[2, 2] == pytest.approx(-1.0)  # the IMU's z points down


def test_two_calibrations_of_the_hilti_robot_agree_in_their_direction():
    T_lidar_imu = np.array(
        [
            [0.9993809082422996, -0.003397272928783347, 0.03501797791768812, -0.13406141062872667],
            [-0.0036988105559615262, -0.9999566093030182, 0.008549755065630918, -0.010899820828818012],
            [0.03498741261178718, -0.0086739868491098, -0.9993501102771111, 0.006109253103427932],
            [0, 0, 0, 1],
        ]
    )  # fmt: skip
    found = as_payload(PREFIX + "hilti-2023-robot").T_imu_lidar_matrix()
    expected = np.linalg.inv(T_lidar_imu)
    np.testing.assert_allclose(found[:3, :3], expected[:3, :3], atol=1e-3)
    np.testing.assert_allclose(found[:3, 3], expected[:3, 3], atol=6e-3)
    turned = between(found, T_lidar_imu)  # as if its direction were the other one
    assert np.linalg.norm(turned[:3, 3]) > 0.2


@of_each
def test_a_ready_payload_finds_its_topics_beside_others(ready, tmp_path, ros1):
    head = Payload.load(ready.path)
    table = np.ones(64, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("ring", "u2"), ("time", "f4")])
    table["time"] = np.linspace(0, 0.09, 64)
    entries = [
        (topic, i / 10, ros1.cloud(i / 10, table))
        for topic in (head.lidar.topic, "/other/points")
        for i in range(4)
    ]
    if head.imu is not None:
        factor = 1 / 9.81 if head.imu.units.accel == "g" else 1.0
        sample = {"accel": (0.0, 0.0, 9.81 * factor)}
        entries += [
            (topic, i / 100, ros1.imu(i / 100, **sample))
            for topic in (head.imu.topic, "/other/imu")
            for i in range(40)
        ]
    bag = ros1.write(tmp_path / "a.bag", sorted(entries, key=lambda entry: entry[1]))
    with Recording(bag, head) as recording:
        roles = resolve(recording.topics, head)
        assert roles.lidar.name == head.lidar.topic
        assert (roles.imu is None) == (head.imu is None)


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(PayloadError, match=r"newer-college-2020, .* or a file"):
        payload_path("dataset:newer-college-2019")


def test_the_page_of_data_sets_has_each_of_them_and_no_other():
    named = set(re.findall(r"dataset:([a-z0-9-]+)", PAGE.read_text(encoding="utf-8")))
    assert named == {one.name for one in READY}
