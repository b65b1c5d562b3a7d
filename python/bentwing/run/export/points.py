# SPDX-License-Identifier: MIT OR Apache-2.0
"""The points of a finished run, from its map where that has them, else from its recording."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.arguments import instance
from bentwing.base.errors import BentwingError, UsageError
from bentwing.base.progress import as_progress
from bentwing.map.clean import clean
from bentwing.map.crop import Crop, Cropper
from bentwing.map.normals import moved, with_normals
from bentwing.map.refine import refine
from bentwing.map.thin import thin
from bentwing.products.finished_map import open_map_of
from bentwing.recording.attributes import stored_name
from bentwing.run.export.area import area_in
from bentwing.run.export.coordinates import same
from bentwing.run.mapping import clock_of, in_turn, joined_trajectory, with_own_times
from bentwing.run.settings import SMALLEST_SPACING

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator

    from bentwing.base.progress import Progress
    from bentwing.map.chunk import MapChunk
    from bentwing.map.clean import CleanSettings
    from bentwing.map.read_chunks import MapFile
    from bentwing.products.finished_map import FinishedMap
    from bentwing.run.export.coordinates import Change, Target
    from bentwing.run.export.finished import Finished
    from bentwing.run.merging.source import Source


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """The points that an export has, and their coordinates.

    Attributes
    ----------
    spacing : m, edge of the voxels that keep one point each; 0 for all points; None for those of the map
    crop : what is kept, in the coordinates of the export
    polygon : GeoJSON or DXF file of areas, inside of which points are kept beside what the crop says
    keep_moving : whether points are kept that beams went through at other times; None for what the map does
    keep_mixed : whether returns between two surfaces are kept; None for what the map does
    refine : whether points are moved along their beams to the surface that they measured together; None for
        what the map does
    normals : whether points have the normal of their surface, towards the lidar; None for what the map does
    attributes : names of further fields of the lidar's points; None for those of the map
    epsg : projected system; None for that of the map
    local : whether coordinates are in the frame of the trajectory
    """

    spacing: float | None = None
    crop: Crop = field(default_factory=Crop)
    polygon: Path | str | None = None
    keep_moving: bool | None = None
    keep_mixed: bool | None = None
    refine: bool | None = None
    normals: bool | None = None
    attributes: tuple[str, ...] | None = None
    epsg: int | None = None
    local: bool = False

    def __post_init__(self) -> None:
        instance("crop", self.crop, Crop, "give bentwing.map.Crop(...)")
        spacing = self.spacing
        if spacing is not None and spacing != 0 and not spacing >= SMALLEST_SPACING:
            msg = (
                f"a spacing of {spacing} m cannot be used; give 0 for all points, or "
                f"{SMALLEST_SPACING:g} m and more"
            )
            raise UsageError(msg)
        if self.polygon is not None and self.crop.area is not None:
            msg = f"{self.polygon}: an area is given already; give the crop's area or a file"
            raise UsageError(msg)

    def cleaning(self, of_map: CleanSettings) -> CleanSettings:
        """Return what is left out, where the map leaves out `of_map`."""
        kept = {"moving": self.keep_moving, "mixed_pixels": self.keep_mixed}
        changed = {name: not keep for name, keep in kept.items() if keep is not None}
        return of_map.model_copy(update=changed)

    def refines(self, run: Finished) -> bool:
        """Whether points are refined, where those of the run's map may be."""
        return run.refines if self.refine is None else self.refine

    def has_normals(self, run: Finished) -> bool:
        """Whether points have normals, where those of the run's map may."""
        return run.has_normals if self.normals is None else self.normals


@dataclass(frozen=True, slots=True)
class Points:
    """Where the points of an export come from.

    Attributes
    ----------
    origin : of them, as the user is told
    target : coordinates of the export
    """

    origin: str
    target: Target
    _options: ExportOptions
    _run: Finished
    _source: MapFile | list[Source]

    @classmethod
    def of(cls, run: Finished, options: ExportOptions) -> Points:
        """Decide where the points come from, and refuse what cannot be done before any work.

        Raises
        ------
        UsageError
            If what is asked for cannot be met, or leaves nothing.
        InputError
            If the recording has to be read again, and is gone or has changed.
        """
        target = run.coordinates.target(epsg=options.epsg, local=options.local)
        if options.polygon is not None:
            area = area_in(target, Path(options.polygon))
            options = replace(options, crop=replace(options.crop, area=area), polygon=None)
        stored = run.map_file()
        reason = _why_again(run, options, stored)
        if reason is None and stored is not None:
            _require_some(run, options, target, stored)
            origin = f"from {stored.path.name}, {stored.n_points:,} points"
            return cls(origin, target, options, run, stored)
        _require_some(run, options, target, None)
        try:
            sources = [source.carrying(options.attributes) for source in run.sources()]
            if options.attributes is not None:
                for source in sources:
                    with source.part():
                        pass  # which refuses fields that the recording does not have
        except BentwingError as error:
            msg = f"{run.run.folder}: {reason}, so the recording has to be read again: {error}"
            raise type(error)(msg) from error
        return cls(f"from the recording, as {reason}", target, options, run, sources)

    def chunks(
        self,
        folder: Path,
        *,
        threads: int | None = None,
        progress: Progress | None = None,
        counts: dict[str, int] | None = None,
    ) -> Generator[MapChunk, None, None]:
        """Yield the points that are asked for.

        Parameters
        ----------
        folder : of temporary files, where the recording is read again
        counts : receives what was left out
        """
        counts = {} if counts is None else counts
        options = self._options
        # Distances are those of the ground, which a projection stretches.
        near, rest = Crop(within=options.crop.within), replace(options.crop, within=None)
        with self._read(folder, threads, as_progress(progress), counts) as (read, change, to_path):
            if near:
                read = Cropper(near, self._run.path, to_path).chunks(read, counts)
            changed: Iterator[MapChunk] = (moved(chunk, change) for chunk in read)
            if rest:
                changed = Cropper(rest).chunks(changed, counts)
            yield from thin(changed, self._spacing(), counts)

    def _spacing(self) -> float:
        """Return the edge of the voxels to thin with; a map is not thinned twice with the same ones.

        Its coordinates are rounded, and two points next to a border would share a voxel then.
        """
        own = self._run.spacing
        wanted = own if self._options.spacing is None else self._options.spacing
        return 0.0 if wanted == own and not isinstance(self._source, list) else wanted

    @contextmanager
    def _read(
        self, folder: Path, threads: int | None, progress: Progress, counts: dict[str, int]
    ) -> Iterator[tuple[Generator[MapChunk, None, None], Change, Change]]:
        """Open the source: its points, the way to the export's coordinates and to the path's frame."""
        if isinstance(self._source, list):
            chunks = _again(
                self._run, self._options, self._source, folder, threads, progress, counts
            )
            yield chunks, self.target.from_local, same
            return
        stored = self._source
        with progress.stage("export", stored.n_points, "points") as shown:
            read = _shown(stored.chunks(self._run.run.start_ns), shown.advance)
            if self._options.has_normals(self._run) and not self._run.has_normals:
                read = with_normals(_seen(read, open_map_of(self._run.run.folder)), folder)
            elif not self._options.has_normals(self._run):
                read = (replace(chunk, normals=None) for chunk in read)
            if self._options.attributes is not None:
                read = _carrying(read, [*map(stored_name, self._options.attributes)])
            yield read, self.target.from_map, self._run.coordinates.nearly_local


def _why_again(run: Finished, options: ExportOptions, stored: MapFile | None) -> str | None:
    """Return why the map does not have what is asked for; None if it has."""
    if run.map_name is None:
        return "the run was made without a map"
    if stored is None:
        return f"{run.map_name} is not there, or does not keep all that is known of its points"
    if options.spacing is not None and options.spacing < run.spacing:
        return f"its map has one point in {run.spacing:g} m only"
    if options.cleaning(run.cleaning) != run.cleaning:
        return "its map was cleaned otherwise"
    lacking = {*map(stored_name, options.attributes or ())} - {*stored.attributes}
    if lacking:
        return f"its map does not have {', '.join(sorted(lacking))}"
    if options.refines(run) != run.refines:
        return f"its map is {'' if run.refines else 'not '}refined"
    return None


def _require_some(
    run: Finished, options: ExportOptions, target: Target, stored: MapFile | None
) -> None:
    """Refuse a crop that leaves nothing, as far as that can be seen from outside.

    Raises
    ------
    UsageError
    """
    times, span = options.crop.times, run.span
    if times is not None and (times[1] < span[0] or times[0] > span[1]):
        msg = (
            f"no point was measured from {times[0]:g} to {times[1]:g} s: the run has {span[0]:.1f} to "
            f"{span[1]:.1f} s"
        )
        raise UsageError(msg)
    if stored is None or not stored.n_points:
        return
    corners = np.stack([stored.low, stored.high])
    grid = np.stack(np.meshgrid(*corners.T, indexing="ij"), axis=-1).reshape(-1, 3)
    box = target.from_map(grid)
    low, high = options.crop.bounds
    if (low > box.max(axis=0) + 1.0).any() or (high < box.min(axis=0) - 1.0).any():
        msg = (
            f"nothing of the map is inside: it reaches from {_written(box.min(axis=0))} to "
            f"{_written(box.max(axis=0))} m"
        )
        raise UsageError(msg)


def _written(corner: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in corner) + ")"


def _again(  # noqa: PLR0917 - private, called once
    run: Finished,
    options: ExportOptions,
    sources: list[Source],
    folder: Path,
    threads: int | None,
    progress: Progress,
    counts: dict[str, int],
) -> Generator[MapChunk, None, None]:
    """Read the recordings with the trajectories of the map, and clean their points."""
    points = [s.points(s.estimate, threads=threads, progress=progress) for s in sources]
    _, late = clock_of(points)
    cleaned: Iterator[MapChunk] = clean(
        in_turn(points, counts),
        folder,
        duration=_duration(sources),
        settings=options.cleaning(run.cleaning),
        counts=counts,
        threads=threads,
    )
    if options.refines(run):
        cleaned = refine(cleaned, folder, counts=counts, threads=threads)
    if options.has_normals(run):
        cleaned = with_normals(cleaned, folder)
    for chunk in cleaned:
        yield with_own_times(chunk, late)


def _duration(sources: list[Source]) -> float:
    if len(sources) > 1:
        return float(joined_trajectory([source.estimate for source in sources]).times[-1])
    with sources[0].part() as part:
        return part.length


def _carrying(chunks: Iterator[MapChunk], names: list[str]) -> Generator[MapChunk, None, None]:
    """Leave out further fields of the points that are not asked for."""
    for chunk in chunks:
        kept = None if chunk.attributes is None or not names else chunk.attributes[names]
        yield replace(chunk, attributes=kept)


def _seen(chunks: Iterator[MapChunk], source: FinishedMap) -> Generator[MapChunk, None, None]:
    """Give the points of a map the directions in which the sensor saw them; NaN where unknown."""
    for chunk in chunks:
        near = replace(chunk, points=chunk.points - source.origin)
        yield replace(chunk, beams=source.beams_of(near).astype(np.float32))


def _shown(
    chunks: Iterator[MapChunk], advance: Callable[[float], None]
) -> Generator[MapChunk, None, None]:
    for chunk in chunks:
        yield chunk
        advance(len(chunk))
