# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is checked before a run begins: nothing has been estimated or written when it fails."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError
from bentwing.run.gnss import fixes_of
from bentwing.run.head import Head

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from bentwing.base.progress import Progress
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.recording import Recording
    from bentwing.run.settings import RunSettings


@contextmanager
def opened(
    paths: Path | str | Sequence[Path | str], settings: RunSettings, progress: Progress
) -> Iterator[Head]:
    """Open a recording that can be mapped as the settings say.

    Raises
    ------
    RecordingError, PayloadError
        It cannot be read, does not match the payload, or is unfit for mapping and not forced.
    UsageError, InputError
        A setting or a file that it names cannot be used, or has no effect on this recording.
    """
    require_coordinates(settings.georeferencing)
    with Head(paths, settings, progress) as head:
        recording = head.recording
        has_fixes = recording.has_fixes or settings.georeferencing.fixes is not None
        require_effect(settings.georeferencing, recording.paths[0], is_placed=has_fixes)
        _require_part(head.recording, settings.start)
        if settings.georeferencing.fixes is not None:  # before the hours of work that come first
            fixes_of(recording, settings.georeferencing, settings.start, settings.duration)
        head.require_fit()
        yield head


def require_coordinates(wanted: GeoreferenceSettings) -> None:
    """Refuse a system or a file of control points that cannot be used."""
    if wanted.epsg is not None:
        from bentwing.base.geodesy import ProjectedSystem

        ProjectedSystem.of_epsg(wanted.epsg)
    if wanted.control_points is not None:
        from bentwing.closing.georeference.control_point_file import read_control_points

        read_control_points(wanted.control_points)


def require_effect(wanted: GeoreferenceSettings, of: Path | str, *, is_placed: bool) -> None:
    """Refuse a wish for coordinates where nothing says where on the Earth something is.

    Parameters
    ----------
    of : what is to be placed
    is_placed : whether GNSS fixes say where it is
    """
    if is_placed or wanted.control_points is not None:
        return
    if wanted.epsg is None and wanted.mode != "constraints":
        return
    what = f"--epsg {wanted.epsg}" if wanted.epsg is not None else "--georeference constraints"
    msg = (
        f"{what} has no effect on {of}: it has no GNSS fixes that the payload names, "
        "and there are no control points; name the topic under 'gnss' in payload.yaml, give "
        "--control-points, or leave the option out"
    )
    raise UsageError(msg)


def _require_part(recording: Recording, start: float | None) -> None:
    if start is not None and start >= recording.duration:
        msg = (
            f"--start {start:g} lies behind the end of {recording.paths[0]}, which lasts "
            f"{recording.duration:.1f} s"
        )
        raise UsageError(msg)
