# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the stages of a run have found, kept in its folder until the run completes.

A run that was killed goes on behind the last stage it finished: the trajectory, the calibration and
what the record said then are read back bit for bit, so that the results are those of an undisturbed run.
"""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np

from bentwing.base.atomic import write_bytes
from bentwing.base.calibration import Calibration
from bentwing.base.errors import UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.plain import plain
from bentwing.base.trajectory import Trajectory

if TYPE_CHECKING:
    from bentwing.run.folder import RunFolder
    from bentwing.run.run import Run

NAME = "checkpoint.npz"
_TRAJECTORY = ("times", "positions", "quats_xyzw")
# What the stages have written into the record.
_RECORDED = (
    "counts",
    "timings",
    "warnings",
    "calibration",
    "loop_closure",
    "localization",
    "merging",
    "segments",
    "windows",
)
# What must be the same for a run to go on; the number of threads changes no bit.
_ASKED = ("settings", "inputs")
_FREE = frozenset({"threads"})


class Checkpoint:
    """The stages of a run that are done.

    Parameters
    ----------
    folder : of the run, with its inputs and settings recorded
    """

    def __init__(self, folder: RunFolder) -> None:
        self._folder = folder
        self._path = folder.path / NAME

    def save(self, stage: str, run: Run) -> None:
        """Keep what the run has found, at the end of a stage."""
        estimate = run.estimate
        if estimate is None:
            return
        record = self._folder.record
        arrays = {name: getattr(estimate.trajectory, name) for name in _TRAJECTORY}
        described = {
            "stage": stage,
            "asked": self._asked(),
            "calibration": plain(estimate.calibration),
            "estimate": {
                name: plain(getattr(estimate, name))
                for name in ("windows", "counts", "timings", "warnings", "segments")
            },
            "record": {name: plain(record.get(name)) for name in _RECORDED},
            "files": [name for name in record["files"] if name != NAME],
        }
        data = io.BytesIO()
        np.savez(
            data,
            described=np.array(json.dumps(described)),
            spin=np.array([run.spin_times, run.spin_rates]),
            **arrays,
        )
        write_bytes(self._folder.file(NAME), data.getvalue())
        self._folder.save()  # a run that is killed now is known to have this file

    def restore(self, run: Run) -> str | None:
        """Read back what an earlier run has found; returns its last stage, None if there is none.

        Raises
        ------
        UsageError
            If that run had other inputs or settings.
        """
        try:
            with np.load(self._path, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in (*_TRAJECTORY, "spin")}
                described = json.loads(str(stored["described"]))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, BadZipFile) as error:
            self._folder.record["warnings"].append(
                f"{self._path}: cannot be read ({error}); the run begins anew"
            )
            return None
        self._require_same(described["asked"])
        if not all((self._folder.path / name).exists() for name in described["files"]):
            return None
        trajectory = Trajectory(*(arrays[name] for name in _TRAJECTORY))
        fields = described["estimate"]
        fields["segments"] = [(first, last) for first, last in fields["segments"]]
        run.estimate = Estimate(
            trajectory, Calibration.from_json(described["calibration"]), **fields
        )
        run.spin_times, run.spin_rates = arrays["spin"].tolist()
        self._folder.record.update(described["record"])
        for name in (*described["files"], NAME):
            self._folder.file(name)
        return str(described["stage"])

    def discard(self) -> None:
        """Remove what only an unfinished run needs."""
        self._path.unlink(missing_ok=True)
        files = self._folder.record["files"]
        if NAME in files:
            files.remove(NAME)

    def _asked(self) -> dict[str, Any]:
        record = plain({name: self._folder.record[name] for name in _ASKED})
        settings = {k: v for k, v in record["settings"].items() if k not in _FREE}
        return {**settings, "inputs": record["inputs"]}

    def _require_same(self, earlier: dict[str, Any]) -> None:
        now = self._asked()
        changed = sorted(k for k in {*now, *earlier} if now.get(k) != earlier.get(k))
        if changed:
            msg = (
                f"{self._folder.path}: the run to go on with had other {', '.join(changed)}; "
                "give the same, or leave --resume out to begin anew"
            )
            raise UsageError(msg)
