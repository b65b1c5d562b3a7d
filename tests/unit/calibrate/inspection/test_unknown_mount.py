# SPDX-License-Identifier: MIT OR Apache-2.0
from bentwing.calibrate.inspection import inspect
from bentwing.simulate import Scenario, simulate


def test_a_spinning_scanner_is_not_called_level_where_its_mount_is_unknown(tmp_path):
    simulate(Scenario(scene="courtyard", duration=20.0, seed=1), tmp_path / "rec")
    found = inspect([tmp_path / "rec" / "recording.bag"], None)
    assert found.defects == []
    assert any("cannot be told without" in warning for warning in found.warnings)
