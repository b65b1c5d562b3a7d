# SPDX-License-Identifier: MIT OR Apache-2.0
from bentwing.calibrate.inspection import inspect


def test_a_spinning_scanner_is_not_called_level_where_its_mount_is_unknown(simulated):
    found = inspect([simulated("office", 22.0) / "recording.bag"], None)
    assert found.defects == []
    assert found.set_up.doubt is None
    assert [finding.kind for finding in found.set_up.findings] == ["mount", "mirrored"]
