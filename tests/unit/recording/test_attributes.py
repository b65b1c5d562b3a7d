# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fields of the lidar's points that are carried to the map."""

from collections import Counter

import laspy
import numpy as np
import pytest

from bentwing.base.errors import PayloadError
from bentwing.map.write_las import EXTRA
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.attributes import Attributes, stored_name
from bentwing.recording.messages.point_cloud2 import PointClouds

FIELDS = [
    ("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("time", "<f4"), ("ring", "<u2"), ("reflectivity", "u1"),
    ("near_ir", "<u2"), ("return_number", "u1"), ("range", "<u4"),
]  # fmt: skip
N = 40


def table(number):
    """A turn; the k-th point of turn n is at x = 1 + k, with a reflectivity of k and a near_ir of 100 n + k."""
    points = np.zeros(N, FIELDS)
    order = np.arange(N)[::-1] if number % 2 else np.arange(N)
    points["x"] = 1 + order
    points["y"], points["time"] = 2.0, 0.002 * order
    points["reflectivity"], points["near_ir"], points["return_number"] = (
        order,
        100 * number + order,
        2,
    )
    points["x"][3] = np.nan
    return points


@pytest.fixture
def recording(ros, tmp_path):
    entries = [("/points", 0.1 * n, ros.cloud(0.1 * n, table(n))) for n in range(8)]
    return ros.write(tmp_path / "a.bag", entries)


def head(*attributes):
    return Payload.model_validate(
        {"imu": None, "lidar": {"attributes": attributes, "max_range": 100}}
    )


def read(recording, *attributes):
    with Recording(recording, head(*attributes)) as opened:
        return LidarBatch.joined([b for b in opened.batches() if isinstance(b, LidarBatch)])


def test_fields_stay_with_their_points(recording):
    """Whatever is left out and however the points are sorted."""
    found = read(recording, "near_ir", "REFLECTIVITY")
    assert found.attributes.dtype == [("near_ir", "<u2"), ("REFLECTIVITY", "u1")]
    assert len(found.times) == 8 * (N - 1)
    places = np.rint(found.points[:, 0] - 1).astype(int)
    turns = np.floor((found.times - 0.002 * places) / 0.1 + 0.5).astype(int)
    assert np.array_equal(found.attributes["REFLECTIVITY"], places)
    assert np.array_equal(found.attributes["near_ir"], 100 * turns + places)


def test_without_a_wish_there_are_none(recording):
    assert read(recording).attributes is None


def test_a_field_that_does_not_exist_is_refused_with_those_that_do(recording):
    with pytest.raises(
        PayloadError, match=r"no field ambient; attributes can be time, ring, reflectivity, near_ir"
    ):
        Recording(recording, head("near_ir", "ambient"))


def test_a_field_named_twice_is_refused():
    with pytest.raises(ValueError, match="near_ir is named twice"):
        head("near_ir", "Near_IR", "near_ir")


def test_a_recording_says_what_there_is(recording):
    with Recording(recording, head()) as opened:
        fields = {name: kind.name for name, kind in opened.lidar_fields.items()}
    assert fields == {
        "time": "float32", "ring": "uint16", "reflectivity": "uint8", "near_ir": "uint16",
        "return_number": "uint8", "range": "uint32",
    }  # fmt: skip


def test_a_cloud_that_lacks_a_field_is_a_broken_message(ros1):
    wanted = Attributes.of(["near_ir"], {"near_ir": np.dtype("u2")}, "/points")
    decoder = PointClouds(cdr=False, attributes=wanted)
    raw = ros1.serialize(ros1.cloud(0.0, table(0)[["x", "y", "z", "time"]].astype(FIELDS[:4])))
    with pytest.raises(ValueError, match="no fields x, y, z, near_ir"):
        decoder.parse(raw, Counter())


def test_names_that_a_map_has_for_other_things_are_changed():
    assert stored_name("return_number") == "sensor_return_number"
    assert stored_name("Range") == "sensor_Range"
    assert stored_name("near ir (nm)") == "near_ir__nm_"
    assert len(stored_name("x" * 40)) == 32
    own = [name.lower() for name in laspy.PointFormat(6).dimension_names]
    for name in [*own, *EXTRA, "range", "time", "nx", "normal_z"]:
        assert stored_name(name) == f"sensor_{name}"[:32], name


@pytest.mark.parametrize("name", ["ouster_os1_64.mcap", "sample_velodyne_vlp16_gps.pcap"])
def test_fields_of_real_sensors_are_read(shared_data, name):
    path = shared_data / "packets" / name
    with Recording(path, Payload.model_validate({"imu": None}), strict=False) as opened:
        fields = opened.lidar_fields
    assert len(fields) > 2
    wanted = tuple(fields)
    payload = Payload.model_validate({"imu": None}).carrying(wanted)
    with Recording(path, payload, strict=False) as opened:
        found = LidarBatch.joined([b for b in opened.batches() if isinstance(b, LidarBatch)])
    assert [found.attributes[stored_name(n)].dtype for n in wanted] == list(fields.values())
    assert np.array_equal(found.attributes[stored_name("ring")], found.ring)
