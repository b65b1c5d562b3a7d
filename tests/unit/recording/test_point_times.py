# SPDX-License-Identifier: MIT OR Apache-2.0
"""Every convention of drivers for the time of a point, each told apart from its values."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.recording.point_times import decide

STAMP_NS = 1_700_000_000_250_000_000
SWEEP = np.linspace(0, 0.099, 1000)

CASES = {
    "ouster t, uint32 ns": ((SWEEP * 1e9).astype("u4"), "ns", "header", SWEEP),
    "uint32 us": ((SWEEP * 1e6).astype("u4"), "us", "header", SWEEP),
    "int32 us to the end": ((SWEEP * 1e6).astype("i4") - 100_000, "us", "header", SWEEP - 0.1),
    "velodyne time, float32 s": (SWEEP.astype("f4"), "s", "header", SWEEP),
    "velodyne to the end of the sweep": ((SWEEP - 0.1).astype("f4"), "s", "header", SWEEP - 0.1),
    "float32 ms": ((SWEEP * 1e3).astype("f4"), "ms", "header", SWEEP),
    "float32 ns": ((SWEEP * 1e9).astype("f4"), "ns", "header", SWEEP),
    "hesai timestamp, float64 s": (1_700_000_000.25 + SWEEP, "s", "epoch", SWEEP),
    "livox timestamp, float64 ns": (1.70000000025e18 + SWEEP * 1e9, "ns", "epoch", SWEEP),
    "uint64 ns absolute": (STAMP_NS + (SWEEP * 1e9).astype("u8"), "ns", "epoch", SWEEP),
    "uint64 us absolute": (STAMP_NS // 1000 + (SWEEP * 1e6).astype("u8"), "us", "epoch", SWEEP),
    "float64 s since the sensor was started": (4321.0 + SWEEP, "s", "sensor", SWEEP),
    "uint64 ns since the sensor was started": (
        4_321_000_000_000 + (SWEEP * 1e9).astype("u8"), "ns", "sensor", SWEEP,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("values", "unit", "origin", "expected"), CASES.values(), ids=CASES)
@pytest.mark.parametrize("period", [0.1, None])
def test_unit_and_origin_are_told_from_the_values(values, unit, origin, expected, period):
    reading = decide("time", values, STAMP_NS, period)
    assert (reading.unit, reading.origin) == (unit, origin)
    # float64 resolves absolute stamps to 256 ns, microseconds to 1 us.
    np.testing.assert_allclose(reading.offsets(values, STAMP_NS), expected, atol=2e-6)


@pytest.mark.parametrize("rate_hz", [5, 10, 20, 50])
def test_the_period_of_the_messages_does_not_mislead(rate_hz):
    values = (np.linspace(0, 0.98 / rate_hz, 500) * 1e9).astype("u4")
    assert decide("t", values, STAMP_NS, 1 / rate_hz).unit == "ns"
    assert decide("t", values, STAMP_NS, None).unit == "ns"


def test_a_third_of_a_turn_is_still_a_sweep():
    values = (np.linspace(0, 0.033, 500)).astype("f4")
    assert decide("time", values, STAMP_NS, 0.1).unit == "s"


def test_a_clock_that_starts_near_zero_is_not_taken_for_offsets():
    reading = decide("timestamp", 0.5 + SWEEP, 500_000_000, 0.1)
    assert reading.origin == "epoch"
    reading = decide("timestamp", SWEEP, 500_000_000, 0.1)
    assert reading.origin == "header"


@pytest.mark.parametrize("values", [np.zeros(100), np.full(100, 1.7e9), np.full(10, np.nan), []])
def test_values_that_do_not_vary_are_no_times(values):
    assert decide("time", np.asarray(values, float), STAMP_NS, 0.1) is None


def test_absolute_float32_seconds_are_no_times():
    values = (1_700_000_000.25 + SWEEP).astype("f4")
    assert decide("timestamp", values, STAMP_NS, 0.1) is None


def test_the_decision_is_told_in_a_sentence():
    text = str(decide("t", (SWEEP * 1e9).astype("u4"), STAMP_NS, 0.1))
    assert text == (
        "time per point from field 't' (uint32): ns, relative to the header stamp, from +0.0 to "
        "+99.0 ms in the first cloud"
    )
