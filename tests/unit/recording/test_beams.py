# SPDX-License-Identifier: MIT OR Apache-2.0
"""Beams of a multi-beam lidar that are not where the recording has them."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import PayloadError
from bentwing.recording import LidarBatch, Payload
from bentwing.recording.beam_reading import directed, in_beams
from bentwing.recording.readings import LidarReading

OFFSETS = {
    "elevations": [0.002, -0.001],
    "azimuths": [0.0, 0.003],
    "ranges": [0.02, -0.01],
    "heights": [0.05, -0.04],
}


def _payload(**beams):
    return Payload.model_validate({"lidar": {"kind": "vlp16", "beams": beams}})


def _points(rng, n=50):
    ranges, azimuths = rng.uniform(1.0, 60.0, n), rng.uniform(-3.0, 3.0, n)
    rings = rng.integers(0, 2, n).astype(np.uint16)
    elevations = np.where(rings == 0, -0.1, 0.1) + rng.normal(0.0, 1e-3, n)
    return directed(ranges, elevations, azimuths, 0.0), rings


def test_rays_and_points_are_inverse():
    points, _ = _points(np.random.default_rng(0))
    assert directed(*in_beams(points), 0.0) == pytest.approx(points, abs=1e-12)


def test_each_return_is_corrected_by_its_beam():
    points, rings = _points(np.random.default_rng(1))
    reading = LidarReading.of(_payload(**OFFSETS).lidar)
    read = reading.batch(LidarBatch(points, np.arange(len(points)) * 1e-3, ring=rings)).points
    at_origin = read - np.array(OFFSETS["heights"])[rings][:, None] * [0.0, 0.0, 1.0]
    for name, found, given in zip(
        ("ranges", "elevations", "azimuths"), in_beams(at_origin), in_beams(points), strict=True
    ):
        assert found - given == pytest.approx(np.array(OFFSETS[name])[rings], abs=1e-9)


def test_beams_without_numbers_are_told_apart_by_the_table():
    points, rings = _points(np.random.default_rng(2))
    reading = LidarReading.of(_payload(**OFFSETS, table=[-0.1, 0.1]).lidar)
    times = np.arange(len(points)) * 1e-3
    numbered = reading.batch(LidarBatch(points, times, ring=rings)).points
    assert np.array_equal(reading.batch(LidarBatch(points, times)).points, numbered)


def test_a_payload_without_beams_leaves_the_points_as_they_are():
    points, rings = _points(np.random.default_rng(3))
    batch = LidarBatch(points, np.arange(len(points)) * 1e-3, ring=rings)
    assert LidarReading.of(Payload.default().lidar).batch(batch) is batch


@pytest.mark.parametrize(
    ("ring", "said"),
    [(None, "lidar.beams.table"), (np.array([0, 1, 2], np.uint16), "describes 2 beams")],
)
def test_returns_of_unknown_beams_are_refused(ring, said):
    reading = LidarReading.of(_payload(**OFFSETS).lidar)
    with pytest.raises(PayloadError, match=said):
        reading.batch(LidarBatch(np.ones((3, 3)), np.arange(3.0), ring=ring))


def test_beams_survive_being_written_and_read(tmp_path):
    payload = _payload(**OFFSETS, table=[-0.1, 0.1])
    payload.save(tmp_path / "payload.yaml")
    assert Payload.load(tmp_path / "payload.yaml") == payload
    assert "# rad" in (tmp_path / "payload.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("beams", "said"),
    [
        ({"elevations": [0.0], "ranges": [0.0, 0.0]}, "as many values in each list"),
        ({"elevations": [0.3]}, "elevations"),
        ({"distances": [0.0]}, "distances"),
    ],
)
def test_a_wrong_table_is_refused(beams, said, tmp_path):
    file = tmp_path / "payload.yaml"
    file.write_text(f"lidar: {{beams: {beams}}}\n", encoding="utf-8")
    with pytest.raises(PayloadError, match=said):
        Payload.load(file)
