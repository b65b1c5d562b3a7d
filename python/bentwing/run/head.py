# SPDX-License-Identifier: MIT OR Apache-2.0
"""The sensor head of a run: as the payload says, or as its recording shows it where that is certain."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.errors import RecordingError
from bentwing.base.memory import give_back
from bentwing.calibrate.inspection import judge
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import KeptBatches, RecordingPart

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import TracebackType

    from typing_extensions import Self

    from bentwing.base.progress import Progress
    from bentwing.calibrate.set_up import SetUp
    from bentwing.closing.beams import FoundBeams
    from bentwing.run.settings import RunSettings

_ALL_THE_SAME = "to map it all the same, give --force"


class Head:
    """Context manager around a recording that is open with the payload that describes it best.

    Parameters
    ----------
    paths : one recording, or its consecutive parts
    settings : of the run, with the payload as it was given

    Attributes
    ----------
    settings : with the payload that is in use
    set_up : what was found, if the head had to be found

    Raises
    ------
    RecordingError, PayloadError
        The recording cannot be read or does not match the payload.
    """

    def __init__(
        self,
        paths: Path | str | Sequence[Path | str],
        settings: RunSettings,
        progress: Progress,
    ) -> None:
        self.paths = [Path(paths)] if isinstance(paths, (str, Path)) else [*map(Path, paths)]
        self.settings = settings
        self.set_up: SetUp | None = None
        self._progress = progress
        self._kept: KeptBatches | None = None
        carried = settings.payload.lidar.attributes
        if settings.payload == Payload.default().carrying(carried):
            from bentwing.calibrate.draft import draft_payload

            self._describe(draft_payload(self.paths).payload.carrying(carried))
        self.recording = Recording(self.paths, self.settings.payload, strict=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.recording.close()

    @property
    def part(self) -> RecordingPart:
        """The part of the recording that the run uses."""
        settings = self.settings
        return RecordingPart(
            self.recording, settings.payload, settings.start, settings.duration, self._kept
        )

    @contextmanager
    def keeping(self, folder: Path) -> Iterator[None]:
        """Decode the recording once: what its first whole pass yields is in a folder for the later ones."""
        self._kept = KeptBatches(folder)
        try:
            yield
        finally:
            self._kept.close()
            self._kept = None

    def require_fit(self) -> None:
        """Refuse what `bentwing info` calls unfit and no other set-up explains.

        Raises
        ------
        RecordingError
            The sentence says how to repair it.
        """
        if self.settings.force:
            return
        defects = judge(self.recording, has_payload=True).defects
        if defects and not self.settings.trust_payload and self._moves:
            found = self.found()
            if found.doubt is not None:
                msg = (
                    f"{_listed(defects)} ({found.doubt})" if self._lacks_mount else _listed(defects)
                )
                raise RecordingError(f"{msg}; {_ALL_THE_SAME}")
            self.use(found)
            defects = judge(self.recording, has_payload=True).defects
        if defects:
            msg = f"{_listed(defects)}; {_ALL_THE_SAME}"
            raise RecordingError(msg)
        self.recording.check()

    def found(self) -> SetUp:
        """Return the head as the recording shows it; takes some seconds, of a 2D lidar up to a minute."""
        from bentwing.calibrate.set_up import find_set_up

        self._progress.note("looking for the set-up of the sensor head in the recording")
        settings = self.settings
        found = find_set_up(
            self.paths, settings.payload, settings.threads, after=settings.start or 0.0
        )
        give_back()  # it has held all returns of a stretch
        return found

    def use(self, set_up: SetUp) -> None:
        """Read the recording by a set-up that was found, and say what it is."""
        self.set_up = set_up
        self._read_by(set_up.payload)
        for finding in set_up.findings:
            self._progress.note(f"set-up: {finding.sentence} ({finding.line})")

    def use_beams(self, beams: FoundBeams) -> None:
        """Read the recording with its beams where they were found to be."""
        self._read_by(beams.in_payload(self.settings.payload))

    def _read_by(self, payload: Payload) -> None:
        self._describe(payload)
        self.recording.close()
        if self._kept is not None:  # read by another payload
            self._kept.close()
        self.recording = Recording(self.paths, payload, strict=False)

    @property
    def _moves(self) -> bool:
        recording = self.recording
        return recording.imu_topic is not None or recording.encoder_topic is not None

    @property
    def _lacks_mount(self) -> bool:
        return not self.settings.payload.places_lidar_on_imu

    def _describe(self, payload: Payload) -> None:
        self.settings = self.settings.model_copy(update={"payload": payload})


def _listed(defects: list[str]) -> str:
    more = f" (`bentwing info` lists {len(defects) - 1} more)" if len(defects) > 1 else ""
    return f"{defects[0]}{more}"
