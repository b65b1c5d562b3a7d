# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import time
from collections import Counter

import numpy as np
import pytest

from bentwing.recording import point_times
from bentwing.recording.messages import wire, wire_clouds
from bentwing.recording.messages.point_cloud2 import columns, sweep, time_field

STAMP_NS = 1_700_000_000_250_000_000
LAYOUTS = {
    "velodyne": [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2"),
                 ("time", "<f4")],
    "big endian": [("x", ">f4"), ("y", ">f4"), ("z", ">f4"), ("intensity", ">f4"), ("ring", ">u2"),
                   ("time", ">f4")],
    "doubles, reordered": [("time", "<f8"), ("ring", "u1"), ("z", "<f8"), ("y", "<f8"),
                           ("x", "<f8"), ("intensity", "u1")],
}  # fmt: skip


def table_of(dtype, n=50):
    table = np.zeros(n, dtype)
    names = table.dtype.names
    rng = np.random.default_rng(0)
    for axis in "xyz":
        table[axis] = rng.integers(1, 50, n)
    if "intensity" in names:
        table["intensity"] = np.arange(n)
    if "ring" in names:
        table["ring"] = np.arange(n) % 16
    if "time" in names:
        table["time"] = np.linspace(0, 0.1, n)
    return table


def cloud_of(ros1, table, **layout):
    return wire_clouds.point_cloud(ros1.serialize(ros1.cloud(0.25, table, **layout)), cdr=False)


@pytest.mark.parametrize("dtype", LAYOUTS.values(), ids=LAYOUTS)
def test_any_layout_gives_the_same_points(ros1, dtype):
    table = table_of(dtype)
    cols = columns(cloud_of(ros1, table), Counter())
    for axis, name in enumerate("xyz"):
        np.testing.assert_array_equal(cols.points[:, axis], table[name])
    np.testing.assert_array_equal(cols.ring, np.arange(50) % 16)
    np.testing.assert_array_equal(cols.intensity, np.arange(50))
    np.testing.assert_allclose(cols.raw_times.astype(float), table["time"])


def test_padding_within_points_and_rows_is_skipped(ros1):
    dtype = np.dtype(
        {"names": ["x", "y", "z"], "formats": ["<f4"] * 3, "offsets": [4, 8, 16], "itemsize": 32}
    )
    table = np.zeros(20, dtype)
    table["x"], table["y"], table["z"] = np.arange(1, 21), 2, 3
    rows = [row.tobytes() + b"\xff" * 12 for row in table.reshape(4, 5)]
    cloud = cloud_of(ros1, table, height=4, row_step=5 * 32 + 12, data=b"".join(rows))
    points = columns(cloud, Counter()).points
    np.testing.assert_array_equal(points[:, 0], np.arange(1, 21))
    np.testing.assert_array_equal(points[:, 2], np.full(20, 3))


def test_a_row_step_of_zero_is_forgiven_in_one_row(ros1):
    table = table_of(LAYOUTS["velodyne"])
    assert len(columns(cloud_of(ros1, table, row_step=0), Counter()).points) == 50


def test_invalid_points_are_counted_by_reason_whatever_is_dense_says(ros1):
    table = table_of(LAYOUTS["velodyne"])
    table["x"][0], table["y"][1] = np.nan, np.inf
    for axis in "xyz":
        table[axis][2] = 0
    counts = Counter()
    cols = columns(cloud_of(ros1, table), counts)
    assert counts == {"returns": 50, "nan": 1, "inf": 1, "zero": 1}
    np.testing.assert_array_equal(cols.intensity, np.arange(3, 50))


def test_a_layout_that_does_not_fit_is_broken(ros1):
    table = table_of(LAYOUTS["velodyne"])
    cloud = cloud_of(ros1, table, data=table.tobytes()[:-1])
    with pytest.raises(wire.BrokenMessageError, match="do not fit"):
        columns(cloud, Counter())


def test_a_cloud_without_x_is_broken(ros1):
    cloud = cloud_of(ros1, np.zeros(3, [("u", "<f4"), ("v", "<f4")]))
    with pytest.raises(wire.BrokenMessageError, match=r"no fields x, y, z \(found u, v\)"):
        columns(cloud, Counter())


def test_an_empty_cloud_is_no_error(ros1):
    assert len(columns(cloud_of(ros1, table_of(LAYOUTS["velodyne"], 0)), Counter()).points) == 0


@pytest.mark.parametrize("name", ["t", "time", "Timestamp", "offset_time", "time_offset", "ts"])
def test_the_time_field_is_found_by_its_usual_names(ros1, name):
    table = np.ones(3, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), (name, "<u4")])
    assert time_field(cloud_of(ros1, table)) == name


def test_points_are_sorted_by_time_and_wild_times_dropped(ros1):
    table = table_of(LAYOUTS["velodyne"])
    table["time"] = table["time"][::-1].copy()
    table["time"][7] = 1e6
    table["time"][8] = np.nan
    cols = columns(cloud_of(ros1, table), Counter())
    reading = point_times.TimeReading("time", "float32", "s", "header")
    counts = Counter()
    batch = sweep(cols, reading, STAMP_NS, 1.0, counts)
    assert counts["bad_point_time"] == 2
    assert np.all(np.diff(batch.times) >= 0)
    np.testing.assert_array_equal(batch.intensity[:3], [49, 48, 47])
    assert batch.points.flags.c_contiguous


def test_thirty_thousand_points_take_less_than_ten_milliseconds(ros1):
    raw = ros1.serialize(ros1.cloud(0.25, table_of(LAYOUTS["velodyne"], 30_000)))
    reading = point_times.TimeReading("time", "float32", "s", "header")

    def once():
        start = time.process_time()
        cols = columns(wire_clouds.point_cloud(raw, cdr=False), Counter())
        sweep(cols, reading, STAMP_NS, 1.0, Counter())
        return time.process_time() - start

    assert min(once() for _ in range(5)) < 0.01
