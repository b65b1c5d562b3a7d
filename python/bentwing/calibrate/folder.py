# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder of a calibration: payload.yaml, calibration.json, and a picture another room draws."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from bentwing.atomic import write_text
from bentwing.calibrate.outcome import as_record
from bentwing.run_record import RecordedFolder, describe_input, plain, versions

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bentwing.calibrate.outcome import Calibrated

RECORD, PAYLOAD = "calibration.json", "payload.yaml"
_KIND = "bentwing calibration"
_FOLDER = RecordedFolder(RECORD, _KIND, "calibration")


class CalibrationFolder:
    """Folder that holds one calibration; the files of an earlier one are replaced.

    Parameters
    ----------
    out : folder, made if it does not exist

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, or holds files that are not of a calibration.
    """

    def __init__(self, out: Path) -> None:
        self.path = Path(out)
        self._earlier = _FOLDER.claim(self.path)
        self._files: list[str] = []

    def file(self, name: str) -> Path:
        """Path of a file that is about to be written atomically."""
        self._files.append(name)
        # whatever happens before the end, the folder can be told to be ours
        self._write({"kind": _KIND, "complete": False, "files": {*self._files, *self._earlier}})
        return self.path / name

    def finish(self, found: Calibrated, inputs: Iterable[Path]) -> None:
        """Write payload.yaml and calibration.json, and remove what is left of an earlier one."""
        content = found.payload.model_dump(mode="json", exclude_unset=True)
        write_text(
            self.file(PAYLOAD), yaml.safe_dump(content, sort_keys=False, default_flow_style=None)
        )
        record = {
            "kind": _KIND,
            "complete": True,
            "versions": versions(),
            "inputs": [describe_input(path) for path in inputs if path.is_file()],
            **as_record(found),
            "files": sorted(self._files),
        }
        self._write(record)
        for name in self._earlier:
            if name not in self._files:
                (self.path / name).unlink(missing_ok=True)

    def _write(self, record: dict[str, Any]) -> None:
        text = json.dumps(plain(record), indent=1, allow_nan=False)
        write_text(self.path / RECORD, text + "\n")
