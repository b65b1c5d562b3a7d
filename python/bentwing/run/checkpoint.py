# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the stages of a run have found, kept in its folder until the run completes.

A run that was killed goes on behind the last stage it finished: the trajectory, the calibration and
what the record said then are read back bit for bit, so that the results are those of an undisturbed run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.breaks import Break
from bentwing.base.calibration import Calibration
from bentwing.base.covariances import PoseCovariances
from bentwing.base.errors import UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.plain import plain
from bentwing.base.result_folder import is_plain_name
from bentwing.base.sealed import DAMAGE, read_sealed, write_sealed
from bentwing.base.trajectory import Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.calibrate.set_up import SetUp
from bentwing.closing.beams import FoundBeams
from bentwing.evaluate.verdict import Evidence
from bentwing.run.found import Found, Reading, Spin
from bentwing.run.request import deciding

if TYPE_CHECKING:
    from bentwing.run.folder import RunFolder
    from bentwing.run.settings import RunSettings

NAME = "checkpoint.npz"
_TRAJECTORY = ("times", "positions", "quats_xyzw")
_COVARIANCES = ("covariance_times", "covariance_matrices")
_SHORT = "short_variances"
_OF_ESTIMATE = ("windows", "counts", "timings", "health", "notes", "breaks", "segments")
_CORRECTIONS = ("localization", "loop_closure", "merging")
STAGES = ("estimate", "loops")


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
        arrays["spin"] = np.array(found.spin.samples).reshape(-1, 2)
        write_sealed(self._folder.file(NAME), described, arrays)
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
            arrays, described = read_sealed(self._path)
        except FileNotFoundError:
            return None, Found()
        except (OSError, *DAMAGE) as error:
            return None, self._anew(error)
        self._require_same(described.get("asked"))
        try:
            stage, files = str(described["stage"]), [*described["files"]]
            if stage not in STAGES or not all(map(self._has, files)):
                return None, Found()
            timings = {name: float(value) for name, value in described["timings"].items()}
            found = _found(arrays, described)
        except DAMAGE as error:
            return None, self._anew(error)
        for name in (*files, NAME):
            self._folder.file(name)
        for name, seconds in timings.items():
            self._folder.record.add_seconds(name, seconds)
        self._folder.record.found = found
        return stage, found

    def _has(self, name: object) -> bool:
        return is_plain_name(name) and (self._folder.path / str(name)).exists()

    def _anew(self, error: BaseException) -> Found:
        note = f"{self._path}: cannot be read ({error}); the run begins anew"
        return Found(stage_warnings=(note,))

    def discard(self) -> None:
        """Remove what only an unfinished run needs."""
        self._path.unlink(missing_ok=True)
        files = self._folder.record.files
        if NAME in files:
            files.remove(NAME)

    def _asked(self) -> dict[str, Any]:
        inputs = self._folder.record.inputs
        asked: dict[str, Any] = plain({**deciding(self._settings), "inputs": inputs})
        return asked

    def _require_same(self, asked: object) -> None:
        now, earlier = self._asked(), asked if isinstance(asked, dict) else {}
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
        stage_warnings=_sentences(described["stage_warnings"]),
        evidence=tuple(Evidence.from_json(one) for one in described.get("evidence") or []),
        set_up=SetUp.from_json(described["set_up"]) if described.get("set_up") else None,
        beams=FoundBeams.from_json(described["beams"]) if described.get("beams") else None,
    )


def _sentences(described: object) -> tuple[str, ...]:
    if not isinstance(described, list) or not all(isinstance(one, str) for one in described):
        msg = f"warnings: expected sentences, found {described!r:.40}"
        raise TypeError(msg)
    return tuple(described)
