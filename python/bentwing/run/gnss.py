# SPDX-License-Identifier: MIT OR Apache-2.0
"""The GNSS fixes of a run: of a file, or of the recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.closing.georeference.receivers import Receivers
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.recording import Recording
    from bentwing.recording.fixes import Fixes
    from bentwing.recording.preprocess import RecordingPart

NO_LEVER = (
    "the payload has no lever arm, so the antenna counts as being at the IMU; say where it is with "
    "`gnss: {lever_arm: [x, y, z]}`"
)


def fixes_of(
    recording: Recording,
    wanted: GeoreferenceSettings,
    start: float | None = None,
    duration: float | None = None,
) -> Fixes | None:
    """Return the fixes of a part of a recording, s; None without any.

    Raises
    ------
    InputError
        If the file or the topic cannot be used, or the file has no fix of this part.
    """
    if wanted.fixes is None:
        return recording.fixes(start, duration)
    from bentwing.recording.gnss_files.read import read_fix_file

    begin = start or 0.0
    end = recording.duration if duration is None else begin + duration
    return read_fix_file(wanted.fixes, recording.clock, (begin, end), scale=wanted.fixes_time)


def receivers_of(
    part: RecordingPart, wanted: GeoreferenceSettings, name: str = ""
) -> Receivers | None:
    """Return the fixes of a part of a recording with their antenna; None without any."""
    from bentwing.closing.georeference.receivers import Receivers

    fixes = fixes_of(part.recording, wanted, part.start, part.duration)
    gnss = part.payload.gnss
    if fixes is None:
        return None
    if gnss is None:
        return Receivers.one(fixes, (0.0, 0.0, 0.0), name)
    return Receivers.one(fixes, gnss.lever_arm, name, gnss.lever_arm_std)
