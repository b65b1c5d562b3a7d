# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rows come back from their bucket in the order in which they came."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bentwing.base.buckets import Buckets

ROW = np.dtype([("x", "<i4"), ("y", "<f8")])


@given(st.lists(st.lists(st.integers(-5, 5), max_size=30), max_size=6), st.sampled_from([0, 2**20]))
def test_each_bucket_has_its_rows_in_order(parts, held):
    everything, n = {}, 0
    with tempfile.TemporaryDirectory() as folder, Buckets(Path(folder), held=held) as buckets:
        for keys in parts:
            rows = np.zeros(len(keys), ROW)
            rows["x"] = np.arange(n, n + len(keys))
            n += len(keys)
            buckets.add(np.array(keys, np.int64), {"rows": rows, "twice": rows["x"] * 2.0})
            for key, row in zip(keys, rows["x"].tolist(), strict=True):
                everything.setdefault(key, []).append(row)
        assert buckets.counts == {key: len(rows) for key, rows in sorted(everything.items())}
        assert list(buckets.counts) == sorted(everything)
        for key, rows in everything.items():
            tables = list(buckets.tables(key))
            assert np.concatenate([table["rows"]["x"] for table in tables]).tolist() == rows
            assert np.concatenate([table["twice"] for table in tables]).tolist() == [
                2 * r for r in rows
            ]
        assert not list(buckets.tables(99))


def test_buckets_leave_no_file_behind(tmp_path):
    with Buckets(tmp_path) as buckets:
        buckets.add(np.zeros(10, np.int64), {"rows": np.zeros(10)})
    assert not list(tmp_path.iterdir())
