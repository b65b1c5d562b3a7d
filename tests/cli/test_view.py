# SPDX-License-Identifier: MIT OR Apache-2.0
import json

import pytest

from bentwing.report.view.contents import read_contents
from bentwing.report.view.show import log_contents

pytest.importorskip("rerun", reason="rerun-sdk is not installed")


@pytest.mark.parametrize("run_format", ["laz", "ply"])
def test_a_run_becomes_a_file_for_the_viewer(run_format, bentwing, simulated, tmp_path):
    folder, out = simulated("office", 22.0), tmp_path / "run"
    recording, payload = folder / "recording.bag", folder / "payload.yaml"
    mapped = bentwing("map", recording, "--payload", payload, "-o", out, "--duration", "9",
                      "--map-format", run_format, "--map-spacing", "0.05")  # fmt: skip
    assert mapped.code == 0, mapped.err
    done = bentwing("view", out, "--save", tmp_path / "run.rrd", "--max-points", "5000")
    assert done.code == 0, done.err
    assert (tmp_path / "run.rrd").read_bytes().startswith(b"RRF2")
    stream = Logged()
    log_contents(stream, read_contents(out, 5000, Silent()))
    assert {"map/path", "map/surfels", "map/imu", "map/coarse/0"} <= set(stream.paths)
    windows = json.loads((out / "run.json").read_text())["windows"]
    assert stream.columns["windows/matches/n_surfels"] == len(windows)
    fine = [name for name in stream.paths if name.startswith("map/fine/")]
    assert len(fine) == pytest.approx(9, abs=1)  # one for each second
    assert 0.0 <= min(stream.times) < 1.0 < 8.0 < max(stream.times) <= 9.1


class Silent:
    def advance(self, amount):
        pass


class Logged:
    """What is logged, in the place of a viewer."""

    def __init__(self):
        self.paths, self.columns, self.times = [], {}, []

    def log(self, path, *_, **__):
        self.paths.append(path)

    def set_time(self, timeline, *, duration):
        assert timeline == "recording"
        self.times.append(duration)

    def send_columns(self, path, indexes, **_):
        self.columns[path] = len(indexes[0].as_arrow_array())
