# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.clock import Clock, format_ns

START_NS = 1_700_000_000_123_456_789


def test_stamps_survive_the_way_through_seconds_to_the_nanosecond():
    stamps_ns = START_NS + np.array([-5, 0, 1, 999, 10**9 + 1, 3600 * 10**9 + 7], dtype=np.int64)
    clock = Clock(START_NS)
    np.testing.assert_array_equal(clock.to_ns(clock.to_seconds(stamps_ns)), stamps_ns)


def test_absolute_text_keeps_every_digit():
    assert Clock(START_NS).to_absolute_text(np.array([0.0, 1e-9, 10.0])) == [
        "1700000000.123456789",
        "1700000000.123456790",
        "1700000010.123456789",
    ]


@pytest.mark.parametrize(
    ("stamp_ns", "text"),
    [(0, "0.000000000"), (1, "0.000000001"), (1_500_000_000, "1.500000000"), (-1, "-0.000000001")],
)
def test_ns_are_written_without_rounding(stamp_ns, text):
    assert format_ns(stamp_ns) == text
