# SPDX-License-Identifier: MIT OR Apache-2.0
"""The records of the core against laspy's own fields, filled by NumPy."""

from __future__ import annotations

import laspy
import numpy as np
import pytest

from bentwing import _core
from bentwing.base.errors import EstimationError

STORED = ("ring", "incidence", "shift", "sigma", "run_id")
OFFSETS, STEP = (1000.0, 0.0, -2000.0), 1e-4


def some_columns(n: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(5)
    odd = np.array([np.nan, np.inf, -np.inf, -1.0, 0.5, 70_000.0], np.float32)
    angles = rng.uniform(0.0, np.pi, n).astype(np.float32)
    angles[::7] = np.nan
    return {
        "times": np.sort(rng.uniform(0.0, 60.0, n)),
        "ranges": rng.uniform(0.0, 90.0, n).astype(np.float32),
        "intensity": rng.choice(odd, n),
        "ring": rng.integers(0, 2**16, n, np.uint16),
        "incidence": angles,
        "thickness": rng.uniform(0.0, 0.1, n).astype(np.float32),
        "shift": rng.uniform(-0.03, 0.03, n).astype(np.float32),
        "sigma": rng.uniform(0.0, 0.02, n).astype(np.float32),
        "run_id": rng.integers(0, 9, n, np.uint16),
    }


def some_points(n: int) -> np.ndarray:
    points = np.random.default_rng(6).uniform(-90.0, 90.0, (n, 3)) + OFFSETS
    points[::3] = np.round(points[::3], 4) + STEP / 2  # halves are rounded to even steps
    return points


def records(points: np.ndarray, columns: dict[str, np.ndarray], **others: object) -> np.ndarray:
    fixed = {"stored": STORED, "offsets": OFFSETS, "step": STEP, "gps_origin": 7e8}
    return _core.las_records(points, **columns, **{**fixed, "intensity_scale": 1.0, **others})


def header() -> laspy.LasHeader:
    made = laspy.LasHeader(point_format=6, version="1.4")
    kinds = {"range": "f4", "ring": "u2", "incidence": "f4", "shift": "f4", "sigma": "f4"}
    for name, kind in {**kinds, "run_id": "u2"}.items():
        made.add_extra_dim(laspy.ExtraBytesParams(name, kind))
    return made


def test_records_are_those_that_numpy_makes() -> None:
    n = 30_000
    points, columns = some_points(n), some_columns(n)
    table = np.zeros(n, header().point_format.dtype())
    for axis, name in enumerate("XYZ"):
        table[name] = np.rint((points[:, axis] - OFFSETS[axis]) / STEP)
    table["intensity"] = np.clip(np.rint(np.nan_to_num(columns["intensity"])), 0, 65_535)
    table["bit_fields"] = 0x11
    table["point_source_id"] = table["run_id"] = columns["run_id"]
    table["gps_time"] = 7e8 + columns["times"]
    table["range"], table["ring"] = columns["ranges"], columns["ring"]
    table["incidence"] = np.rint(np.degrees(columns["incidence"]) * 8) / 8
    for name in ("shift", "sigma"):
        table[name] = np.rint(columns[name] * np.float32(8192)) / np.float32(8192) + np.float32(0)
    assert records(points, columns).tobytes() == table.tobytes()


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_records_do_not_depend_on_the_number_of_threads(threads: int) -> None:
    points, columns = some_points(20_000), some_columns(20_000)
    expected = records(points, columns, threads=4)
    assert np.array_equal(records(points, columns, threads=threads), expected)


def test_a_column_that_is_missing_or_not_stored_takes_no_value() -> None:
    points, columns = some_points(10), some_columns(10)
    columns |= {"ring": None, "intensity": None, "run_id": None}
    table = records(points, columns).view(header().point_format.dtype())
    for name in ("ring", "intensity", "run_id", "point_source_id"):
        assert not table[name].any()
    assert len(records(points, columns, stored=())) == 10 * 34


@pytest.mark.parametrize("bad", [np.nan, np.inf, 215_800.0])
def test_what_32_bits_cannot_count_is_refused(bad: float) -> None:
    points = some_points(10)
    points[4, 0] = bad
    with pytest.raises(EstimationError, match="too far for a LAS file"):
        records(points, some_columns(10))


def test_columns_of_another_length_are_refused() -> None:
    columns = some_columns(10) | {"ring": np.zeros(9, np.uint16)}
    with pytest.raises(ValueError, match="ring: expected 10 values as points has, got 9"):
        records(some_points(10), columns)
