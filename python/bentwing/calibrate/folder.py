# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder of a calibration: payload.yaml, calibration.json, and a picture another room draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.result_folder import RecordedFolder, ResultFolder
from bentwing.calibrate.outcome import as_record

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from bentwing.calibrate.outcome import Calibrated

PAYLOAD = "payload.yaml"
_FOLDER = RecordedFolder("calibration.json", "bentwing calibration", "calibration")


class CalibrationFolder(ResultFolder):
    """Folder that holds one calibration; see `ResultFolder`."""

    def __init__(self, out: Path, inputs: Iterable[Path] = ()) -> None:
        super().__init__(out, _FOLDER, inputs)

    def finish(self, found: Calibrated, inputs: Iterable[Path]) -> None:
        """Write payload.yaml, and last of all calibration.json."""
        found.payload.save(self.file(PAYLOAD))
        self.complete((path for path in inputs if path.is_file()), as_record(found))
