# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whatever tables go into a spool, and however much it holds in memory, the same come out."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import tempfile
from itertools import zip_longest
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as some

from bentwing.base.array_spool import ArraySpool

COLUMNS = {
    "points": (np.float64, (3,)),
    "times": (np.float64, ()),
    "intensity": (np.float32, ()),
    "ring": (np.uint16, ()),
    "doubtful": (np.bool_, ()),
}


@st.composite
def tables(draw):
    n_rows = draw(st.integers(0, 40))
    names = draw(st.lists(st.sampled_from(sorted(COLUMNS)), min_size=1, unique=True))
    table = {}
    for name in names:
        kind, shape = COLUMNS[name]
        table[name] = draw(some.arrays(kind, (n_rows, *shape)))
    return table


def assert_same(found, expected):
    for ours, theirs in zip_longest(found, expected):
        assert ours.keys() == theirs.keys()
        for name, values in theirs.items():
            assert ours[name].dtype == values.dtype
            assert ours[name].shape == values.shape
            assert ours[name].tobytes() == values.tobytes()
            assert ours[name].flags.aligned
            assert ours[name].flags.c_contiguous


@settings(deadline=None, max_examples=60)
@given(st.lists(tables(), max_size=8), st.sampled_from([0, 1, 500, 5000, 10**9]))
def test_what_went_in_comes_out_bit_for_bit_as_often_as_asked(given_tables, held):
    with tempfile.TemporaryDirectory() as folder, ArraySpool(Path(folder), held=held) as spool:
        for table in given_tables:
            spool.add(table)
        assert_same(spool.tables(), given_tables)
        first, second = spool.tables(), spool.tables()
        for table in given_tables:  # two looks at the same time do not disturb each other
            assert_same([next(first)], [table])
            assert_same([next(second)], [table])


def test_columns_that_are_not_contiguous_come_out_as_they_are(tmp_path):
    values = np.arange(60.0).reshape(20, 3)
    with ArraySpool(tmp_path) as spool:
        spool.add({"points": values[::2], "times": values[::2, 1]})
        assert_same(spool.tables(), [{"points": values[::2], "times": values[::2, 1]}])


def test_nothing_is_in_the_folder_meanwhile_and_none_needs_a_folder_within_its_budget(tmp_path):
    with ArraySpool(tmp_path / "missing", held=800) as spool:
        spool.add({"times": np.zeros(100)})
        with pytest.raises(FileNotFoundError):
            spool.add({"times": np.zeros(1)})
    with ArraySpool(tmp_path) as spool:
        spool.add({"times": np.zeros(100_000)})
        assert not any(not p.name.endswith(".partial") for p in tmp_path.iterdir())
    assert not list(tmp_path.iterdir())


def test_it_takes_no_more_than_its_share_of_the_disk(tmp_path, monkeypatch):
    usage = type("Usage", (), {"free": 1000})
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    with ArraySpool(tmp_path, share=0.5) as spool:
        spool.add({"times": np.zeros(60)})
        with pytest.raises(OSError, match=os.strerror(errno.ENOSPC)):
            spool.add({"times": np.zeros(3)})


KILLED = """
import os, signal, sys
from pathlib import Path
import numpy as np
from bentwing.base.array_spool import ArraySpool
spool = ArraySpool(Path(sys.argv[1]))
spool.add({"times": np.zeros(1000)})
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_a_process_that_is_killed_leaves_nothing_behind(tmp_path):
    done = subprocess.run([sys.executable, "-c", KILLED, tmp_path], check=False)
    assert done.returncode == -signal.SIGKILL
    assert not list(tmp_path.iterdir())
