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
from bentwing.base.breaks import Break
from bentwing.base.calibration import Calibration
from bentwing.base.covariances import PoseCovariances
from bentwing.base.errors import UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.plain import plain
from bentwing.base.trajectory import Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.calibrate.set_up import SetUp
from bentwing.closing.beams import FoundBeams
from bentwing.evaluate.verdict import Evidence
from bentwing.run.found import Found, Reading, Spin

if TYPE_CHECKING:
    from bentwing.run.folder import RunFolder
    from bentwing.run.settings import RunSettings

NAME = "checkpoint.npz"
_TRAJECTORY = ("times", "positions", "quats_xyzw")
_COVARIANCES = ("covariance_times", "covariance_matrices")
_SHORT = "short_variances"
_OF_ESTIMATE = ("windows", "counts", "timings", "health", "notes", "breaks", "segments")
_CORRECTIONS = ("localization", "loop_closure", "merging")
# What must be the same for a run to go on; the number of threads changes no bit.
_FREE = frozenset({"threads"})


class Checkpoint:
    """The stages of a run that are done.

    Parameters
    ----------
    folder : of the run, with its inputs recorded
    asked : settings as they were given; the head that was found may have changed those of the folder
    """

    def __init__(self, folder: RunFolder, asked: RunSettings) -> None:
        self._folder = folder
        self._settings = asked
        self._path = folder.path / NAME

    def save(self, stage: str, found: Found) -> None:
        """Keep what the run has found, at the end of a stage."""
        estimate, record = found.estimate, self._folder.record
        if estimate is None:
            return
        arrays = {name: getattr(estimate.trajectory, name) for name in _TRAJECTORY}
        covariances = estimate.covariances
        if covariances is not None:
            arrays |= {
                name: getattr(covariances, name.removeprefix("covariance_"))
                for name in _COVARIANCES
            }
        if estimate.short_variances is not None:
            arrays[_SHORT] = estimate.short_variances
        described = {
            "stage": stage,
            "asked": self._asked(),
            "calibration": estimate.calibration,
            "estimate": {name: getattr(estimate, name) for name in _OF_ESTIMATE},
            "reading": found.reading,
            "corrections": {name: getattr(found, name) for name in _CORRECTIONS},
            "stage_warnings": found.stage_warnings,
            "evidence": found.evidence,
            "set_up": None if found.set_up is None else found.set_up.to_json(),
            "beams": found.beams,
            "timings": record.timings,
            "files": [name for name in record.files if name != NAME],
        }
        data = io.BytesIO()
        np.savez(
            data,
            described=np.array(json.dumps(plain(described))),
            spin=np.array(found.spin.samples).reshape(-1, 2),
            **arrays,
        )
        write_bytes(self._folder.file(NAME), data.getvalue())
        self._folder.save()  # a run that is killed now is known to have this file

    def restore(self, *, resume: bool) -> tuple[str | None, Found]:
        """Read back what an earlier run has found.

        Parameters
        ----------
        resume : whether an earlier run counts

        Returns
        -------
        The last stage that is done, None if the run begins anew, and what was found until then.

        Raises
        ------
        UsageError
            If that run had other inputs or settings.
        """
        if not resume:
            return None, Found()
        try:
            with np.load(self._path, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
                described = json.loads(str(stored["described"]))
        except FileNotFoundError:
            return None, Found()
        except (OSError, ValueError, KeyError, BadZipFile) as error:
            note = f"{self._path}: cannot be read ({error}); the run begins anew"
            return None, Found(stage_warnings=(note,))
        self._require_same(described["asked"])
        if not all((self._folder.path / name).exists() for name in described["files"]):
            return None, Found()
        for name in (*described["files"], NAME):
            self._folder.file(name)
        for stage, seconds in described["timings"].items():
            self._folder.record.add_seconds(stage, seconds)
        self._folder.record.found = _found(arrays, described)
        return str(described["stage"]), self._folder.record.found

    def discard(self) -> None:
        """Remove what only an unfinished run needs."""
        self._path.unlink(missing_ok=True)
        files = self._folder.record.files
        if NAME in files:
            files.remove(NAME)

    def _asked(self) -> dict[str, Any]:
        settings = {k: v for k, v in self._settings.to_json().items() if k not in _FREE}
        asked: dict[str, Any] = plain({**settings, "inputs": self._folder.record.inputs})
        return asked

    def _require_same(self, earlier: dict[str, Any]) -> None:
        now = self._asked()
        changed = sorted(k for k in {*now, *earlier} if now.get(k) != earlier.get(k))
        if changed:
            msg = (
                f"{self._folder.path}: the run to go on with had other {', '.join(changed)}; "
                "give the same, or leave --resume out to begin anew"
            )
            raise UsageError(msg)


def _found(arrays: dict[str, Any], described: dict[str, Any]) -> Found:
    fields = described["estimate"]
    fields["segments"] = [(first, last) for first, last in fields["segments"]]
    fields["windows"] = [WindowRecord.from_json(window) for window in fields["windows"]]
    fields["breaks"] = [Break(**broken) for broken in fields["breaks"]]
    trajectory = Trajectory(*(arrays[name] for name in _TRAJECTORY))
    known = _COVARIANCES[0] in arrays
    fields["covariances"] = PoseCovariances(*(arrays[n] for n in _COVARIANCES)) if known else None
    fields[_SHORT] = arrays.get(_SHORT)
    return Found(
        Estimate(trajectory, Calibration.from_json(described["calibration"]), **fields),
        Reading(**described["reading"]),
        Spin([(time, rate) for time, rate in arrays["spin"].tolist()]),
        **described["corrections"],
        stage_warnings=tuple(described["stage_warnings"]),
        evidence=tuple(Evidence.from_json(one) for one in described.get("evidence") or []),
        set_up=SetUp.from_json(described["set_up"]) if described.get("set_up") else None,
        beams=FoundBeams.from_json(described["beams"]) if described.get("beams") else None,
    )
