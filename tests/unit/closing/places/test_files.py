# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of files: the office that is scanned twice, and what is no run."""

import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.closing.places import (
    PlaceSettings,
    describe_run,
    match_places,
    places_of_cloud,
    places_of_run,
)


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(UsageError, match="no bentwing run"):
        places_of_run(tmp_path)


def test_a_large_cloud_is_described_tile_by_tile_as_its_points_would_be(tmp_path, monkeypatch):
    """Read in parts, a few tiles at a time, with every n-th point of a full one."""
    rng = np.random.default_rng(8)
    points = rng.uniform((0, 0, 0), (100, 40, 3), (120_000, 3)).astype(np.float32)
    header = "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{}end_header\n".format(
        len(points), "".join(f"property float {axis}\n" for axis in "xyz")
    )
    path = tmp_path / "cloud.ply"
    path.write_bytes(header.encode() + points.tobytes())
    settings = PlaceSettings(max_points=10_000)
    expected = describe_run(points.astype(np.float64), settings=settings)
    monkeypatch.setattr("bentwing.map.read_rows.PART", 7001)
    monkeypatch.setattr("bentwing.closing.places.tiles._AT_ONCE", 3)
    found = places_of_cloud(path, settings)
    assert len(found) == len(expected) > 4
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.descriptors, other.descriptors)
        np.testing.assert_array_equal(one.surfels.means, other.surfels.means)


def test_what_a_cloud_is_shifted_by_is_taken_off_its_places(tmp_path):
    away = np.array([1000.0, 2000.0, 0.0])
    points = np.random.default_rng(9).uniform(0.0, 3.0, (3000, 3))
    path = tmp_path / "cloud.ply"
    header = "ply\nformat ascii 1.0\nelement vertex 3000\n{}end_header\n".format(
        "".join(f"property double {axis}\n" for axis in "xyz")
    )
    rows = "\n".join(" ".join(f"{v:.6f}" for v in row) for row in points + away)
    path.write_text(header + rows + "\n")
    (place,) = places_of_cloud(path, shift=away)
    assert np.abs(place.centre - 1.5).max() < 0.5


def test_two_scans_of_an_office_are_registered_without_a_guess(shared_data):
    scans = shared_data / "room_scans"
    first, second = (places_of_cloud(scans / f"room_scan{n}.pcd") for n in (1, 2))
    (found,) = match_places(first, second)
    assert found.accepted, found.reason
    T = found.alignment.T_a_b
    assert np.degrees(np.arctan2(T[1, 0], T[0, 0])) == pytest.approx(40.8, abs=0.5)
    np.testing.assert_allclose(T[:3, 3], [1.97, 0.06, 0.03], atol=0.05)
    assert found.agreement.distance < 0.015
