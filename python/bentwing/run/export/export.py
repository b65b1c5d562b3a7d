# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a finished run to a file: its points as they are wished, or its trajectory."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import gettempdir
from typing import TYPE_CHECKING

from bentwing.base.arguments import thread_count
from bentwing.base.errors import UsageError
from bentwing.base.new_file import require_new
from bentwing.base.progress import as_progress
from bentwing.map.formats import FORMATS, MAP_FORMATS, require_format, require_room
from bentwing.map.write_tiles import write_tiles
from bentwing.map.writer import open_map
from bentwing.recording.preprocess.read_ahead import read_ahead
from bentwing.run.export.finished import Finished
from bentwing.run.export.mcap_file import SPACING, SUFFIX, write_mcap
from bentwing.run.export.points import ExportOptions, Points
from bentwing.run.export.trajectory_files import SUFFIXES, format_of, write_trajectory

if TYPE_CHECKING:
    from collections.abc import Generator

    from bentwing.base.progress import Progress
    from bentwing.map import MapFormat
    from bentwing.map.chunk import MapChunk
    from bentwing.run.export.names import TrajectoryFormat
    from bentwing.run.run import Run


# Made while those before them are compressed and written.
_CHUNKS_AHEAD = 2


@dataclass(frozen=True, slots=True)
class Exported:
    """What was written.

    Attributes
    ----------
    paths : files, or the folder of the tiles
    n_points : in them; None for a trajectory
    origin : of the points, as the user is told
    counts : what was left out
    """

    paths: tuple[Path, ...]
    n_points: int | None = None
    origin: str = ""
    counts: dict[str, int] | None = None

    def sentence(self) -> str:
        """Return what the user is told at the end."""
        paths = ", ".join(map(str, self.paths))
        if self.n_points is None:
            return f"{paths}: the trajectory"
        left = {
            "cropped": "outside",
            "thinned": "thinned out",
            "moving": "moving",
            "mixed_pixels": "mixed",
        }
        counts = self.counts or {}
        out = [f"{n:,} {word}" for name, word in left.items() if (n := counts.get(f"map.{name}"))]
        return f"{paths}: {self.n_points:,} points" + (f" ({', '.join(out)})" if out else "")


def export(
    run: Run | Path | str,
    path: Path | str,
    options: ExportOptions | None = None,
    *,
    tiles: int | None = None,
    map_format: MapFormat | None = None,
    trajectory_format: TrajectoryFormat | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Exported:
    """Write a finished run's map, or its trajectory, in another form, without estimating again.

    The points come from the map in the run folder. Where that does not have what is asked for, they are read
    from the recording once more.

    Parameters
    ----------
    run : folder of a run, a localized run or a merged map
    path : of the file, which must not exist; its suffix says the format. With `tiles`, a folder of that
        name without the suffix. `.mcap` has trajectory and map as messages of ROS 2
    options : which points, and in which coordinates; default: those of the map
    tiles : m, edge of square tiles, a file each; default: one file
    map_format : one of `MAP_FORMATS`; default: what the suffix says
    trajectory_format : one of `tum`, `kitti`, `euroc`, `kml`, `geojson`; default: what the suffix says
    threads : default: all cores
    progress : what to tell the user meanwhile; default: nothing

    Raises
    ------
    UsageError
        If the run is not complete, or what is asked for cannot be had or is nothing.
    InputError
        If a file of the run has changed, or the recording is to be read again and is gone or has changed.
    """
    out, shown = Path(path), as_progress(progress)
    thread_count(threads)
    options = options or ExportOptions()
    kind = None if map_format is not None else format_of(out, trajectory_format)
    if trajectory_format is not None and map_format is not None:
        msg = f"a trajectory ({trajectory_format}) and a map ({map_format}) are two files; export twice"
        raise UsageError(msg)
    if kind is None and map_format is None and out.suffix.lower() == SUFFIX:
        return _export_messages(run, out, options, tiles, threads=threads, progress=shown)
    if kind is not None:
        if options != ExportOptions() or tiles is not None:
            msg = f"{out}: is a trajectory, of which spacing, crop, coordinates and tiles cannot be chosen"
            raise UsageError(msg)
        return _export_trajectory(Finished.open(run), out, kind)
    wanted = require_format(map_format) if map_format is not None else _map_format_of(out)
    require_room(wanted, normals=bool(options.normals), attributes=bool(options.attributes))
    target = out if tiles is None else _without_suffix(out, wanted)
    require_new(target)
    if tiles is not None and (tiles != int(tiles) or tiles < 1):
        msg = f"tiles of {tiles} m cannot be written; give whole metres"
        raise UsageError(msg)
    finished = Finished.open(run)
    points = Points.of(finished, options)
    shown.note(f"export: {points.origin}")
    counts: dict[str, int] = {}
    chunks = _some(points.chunks(target.parent, threads=threads, progress=shown, counts=counts))
    if tiles is not None:
        n_points = write_tiles(
            chunks,
            target,
            int(tiles),
            map_format=wanted,
            clock_origin_ns=finished.run.start_ns,
            system=points.target.system,
            progress=shown,
        )
    else:
        with (
            closing(chunks),
            open_map(target, wanted, finished.run.start_ns, points.target.crs_wkt) as writer,
        ):
            writer.progress = shown
            for chunk in chunks:
                writer.write(chunk)
        n_points = writer.n_points
    return Exported((target,), n_points, points.origin, counts)


def export_points(
    run: Run | Path | str,
    options: ExportOptions | None = None,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Generator[MapChunk, None, None]:
    """Yield the points that `export` writes, as arrays; the parameters are its own.

    Raises
    ------
    UsageError, InputError
        At once, as `export`; an empty result is no error.
    """
    thread_count(threads)
    points = Points.of(Finished.open(run), options or ExportOptions())
    return points.chunks(Path(gettempdir()), threads=threads, progress=progress)


def _export_messages(
    run: Run | Path | str,
    out: Path,
    options: ExportOptions,
    tiles: int | None,
    *,
    threads: int | None,
    progress: Progress,
) -> Exported:
    if options.epsg is not None or tiles is not None:
        msg = f"{out}: messages are in the frame of the trajectory and in one file; leave --epsg and --tiles out"
        raise UsageError(msg)
    require_new(out)
    finished = Finished.open(run)
    spacing = max(SPACING, finished.spacing) if options.spacing is None else options.spacing
    points = Points.of(finished, replace(options, spacing=spacing, local=True))
    progress.note(f"export: {points.origin}")
    counts: dict[str, int] = {}
    chunks = points.chunks(out.parent, threads=threads, progress=progress, counts=counts)
    n_points = write_mcap(out, finished, _some(chunks))
    return Exported((out,), n_points, points.origin, counts)


def _export_trajectory(run: Finished, out: Path, kind: TrajectoryFormat) -> Exported:
    paths = [out]
    if len(run.flights) > 1:
        paths = [out.with_name(f"{out.stem}_{one.name}{out.suffix}") for one in run.flights]
    for path in paths:
        require_new(path)
    for path, one in zip(paths, run.flights, strict=True):
        write_trajectory(path, kind, one, run.coordinates)
    return Exported(tuple(paths))


def _map_format_of(path: Path) -> MapFormat:
    """Return the map format that a name ends in; the longest, as that of COPC ends in that of LAZ."""
    name = path.name.lower()
    for known in sorted(MAP_FORMATS, key=len, reverse=True):
        if name.endswith(f".{known}"):
            return require_format(known)
    listed = ", ".join(f".{name}" for name in FORMATS)
    msg = (
        f"{path}: its name says no format; end it in {listed} for a map, or in {', '.join(SUFFIXES)} "
        f"for a trajectory, or in {SUFFIX} for both as messages"
    )
    raise UsageError(msg)


def _without_suffix(path: Path, map_format: str) -> Path:
    name = path.name
    if name.lower().endswith(f".{map_format}"):
        name = name[: -len(map_format) - 1]
    return path.with_name(name)


def _some(chunks: Generator[MapChunk, None, None]) -> Generator[MapChunk, None, None]:
    """Pass chunks on; refuse an export without any.

    Raises
    ------
    UsageError
    """
    is_empty = True
    with closing(read_ahead(chunks, _CHUNKS_AHEAD)) as ahead:
        for chunk in ahead:
            is_empty = False
            yield chunk
    if is_empty:
        msg = "no point of the map is left; crop less, and see the report for where the map is"
        raise UsageError(msg)
