# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings are streamed: how long one is must not show in the memory."""

from __future__ import annotations

import json
import os
import sys

import pytest

pytestmark = pytest.mark.slow

MAP = (
    "import sys; from bentwing.run.pipeline import map_recording; "
    "map_recording(sys.argv[1], sys.argv[2], sys.argv[3], map_spacing=1.0)"
)


@pytest.fixture(scope="module")
def peak(simulated, tmp_path_factory):
    """Map the first seconds of one long flight; return the peak resident memory in MB."""

    def run(duration):
        folder = simulated("office", 600.0)
        out = tmp_path_factory.mktemp("memory")
        script = MAP.replace("map_spacing=1.0", f"map_spacing=1.0, duration={duration}")
        files = [str(folder / "recording.bag"), str(folder / "payload.yaml"), str(out / "run")]
        child = os.posix_spawn(sys.executable, [sys.executable, "-c", script, *files], os.environ)
        _, status, usage = os.wait4(child, 0)
        assert os.waitstatus_to_exitcode(status) == 0
        assert json.loads((out / "run" / "run.json").read_text())["complete"]
        return usage.ru_maxrss / 1024

    return run


def test_ten_minutes_need_little_more_memory_than_two(peak):
    """What may grow: 100 poses a second, a record per window, the sample of the map's points.

    That is 60,000 poses and 600 records, some 30 MB; the raw points would be 1 GB.
    """
    assert peak(600.0) < peak(120.0) + 80.0
