# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings without the times of points make maps as good as those with them."""

from __future__ import annotations

import pytest

from bentwing.evaluate.simulated import score
from bentwing.run.pipeline import map_recording
from bentwing.simulate.faults import with_fault

# A tenth of a millisecond, the likely error, at 2 m/s and 2 rad/s times 10 m.
WORSE = 1e-4 * (2.0 + 20.0)


@pytest.mark.slow
@pytest.mark.parametrize("head", ["vlp16-fixed", "hokuyo-spin"])
@pytest.mark.parametrize("fault", ["times-none", "times-none-end"])
def test_made_times_cost_no_accuracy(flown, tmp_path, head, fault):
    good = flown("office", 22.0, head=head)
    files = (good.recording / name for name in ("recording.bag", "payload.yaml"))
    recording, payload = with_fault(*files, fault, tmp_path / "untimed")
    run = map_recording(recording, payload, tmp_path / "run", threads=2)
    found = score(good.recording, tmp_path / "run")
    assert run.verdict.state == "good"
    assert found.ate < good.score.ate + WORSE
    assert found.map_std < good.score.map_std + WORSE
    assert any("made from the" in warning for warning in run.warnings)
