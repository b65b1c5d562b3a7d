# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a file of fixes to fixes on the clock of a recording."""

from __future__ import annotations

from collections import Counter
from datetime import datetime, timezone
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular
from bentwing.recording.fixes import Fixes, positive
from bentwing.recording.gnss_files.nmea import is_nmea, read_nmea
from bentwing.recording.gnss_files.rtklib import is_rtklib, read_rtklib

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import TextIO

    from bentwing.base.clock import Clock
    from bentwing.recording.gnss_files.file_fix import FileFix
    from bentwing.recording.gnss_files.names import TimeScale

_MOST = 2**30  # bytes, of a day at 20 Hz
_LONGEST = 4096  # characters of a line
_BEGINNING = 200  # lines by which a file is told


def read_fix_file(
    path: Path, clock: Clock, seconds: tuple[float, float], *, scale: TimeScale | None = None
) -> Fixes:
    """Read the fixes that a file has of a recording.

    Parameters
    ----------
    path : of RTKLIB (.pos) or NMEA 0183
    clock : of the recording
    seconds : s, first and last that are read
    scale : time scale of the file; default: what the file says

    Raises
    ------
    InputError
        If the file is of another kind, or has no fix of these seconds.
    """
    counts: Counter[str] = Counter()
    found = _read(path, clock, scale, counts)
    stamps = np.array([fix.stamp_ns for fix in found], np.int64)
    times = clock.to_seconds(stamps)
    inside = np.flatnonzero((times >= seconds[0]) & (times < seconds[1]))
    if not len(inside):
        raise InputError(_none_of(path, clock, stamps, seconds))
    order = inside[np.argsort(times[inside], kind="stable")]
    order = order[np.append(True, np.diff(times[order]) > 0)]
    counts["repeated"] += len(inside) - len(order)
    counts["fixes"] = len(order)
    for k in order:
        counts[f"of_quality_{found[k].quality}"] += 1
    covariances = positive(np.array([found[k].weighed() for k in order]))
    places = np.array([found[k].place for k in order])
    return Fixes(times[order], places, covariances, counts)


def _read(path: Path, clock: Clock, scale: TimeScale | None, counts: Counter[str]) -> list[FileFix]:
    require_regular(path, _MOST)
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            first = list(islice(_lines(file), _BEGINNING))
            file.seek(0)
            if is_rtklib(first):
                return list(read_rtklib(path, _lines(file), scale, counts))
            if is_nmea(first):
                return list(read_nmea(_lines(file), clock.start_ns, counts))
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror})"
        raise InputError(msg) from error
    msg = (
        f"{path}: is neither a solution of RTKLIB (.pos, with its header) nor NMEA 0183 with GGA; give one "
        "of these, or name a topic of fixes in payload.yaml"
    )
    raise InputError(msg)


def _lines(file: TextIO) -> Iterator[str]:
    """Yield the lines but for those that are too long, of which no more than a part is ever held."""
    is_inside = False
    while line := file.readline(_LONGEST):
        is_whole = not is_inside and (len(line) < _LONGEST or line.endswith("\n"))
        is_inside = not line.endswith("\n")
        if is_whole:
            yield line


def _none_of(path: Path, clock: Clock, stamps: np.ndarray, seconds: tuple[float, float]) -> str:
    if not len(stamps):
        return f"{path}: has no valid fix; does it hold positions with a quality above zero?"
    ends = [int(stamps.min()), int(stamps.max())]
    last = min(seconds[1], 1e9)
    own = clock.to_ns(np.array([max(seconds[0], 0.0), last])).tolist()
    return (
        f"{path}: has fixes from {_iso(ends[0])} to {_iso(ends[1])} UTC, none of them in the recording, which "
        f"begins at {_iso(own[0])}; do both clocks agree, and is the time scale right (--gnss-time)?"
    )


def _iso(stamp_ns: int) -> str:
    try:
        return f"{datetime.fromtimestamp(stamp_ns // 10**9, timezone.utc):%Y-%m-%d %H:%M:%S}"
    except (OverflowError, OSError, ValueError):
        return f"{stamp_ns // 10**9} s"
