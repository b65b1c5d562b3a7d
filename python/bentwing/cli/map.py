# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing map`: from a recording to a trajectory, a map and a report."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from bentwing.closing.georeference import GeoreferenceSettings


def map_command(
    recording: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Recording, or its consecutive parts; several flights are mapped and merged."
        ),
    ] = None,
    *,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder to write into.")] = None,
    payload: Annotated[
        Path | None, typer.Option(help="payload.yaml, the description of the sensor head.")
    ] = None,
    estimator: Annotated[
        str,
        typer.Option(
            help="continuous; kalman for 3D lidars, faster; ndt for 3D lidars without an IMU."
        ),
    ] = "continuous",
    map_format: Annotated[str, typer.Option(help="laz, las, ply, pcd or e57.")] = "laz",
    map_spacing: Annotated[
        float, typer.Option(help="Keep one point per voxel of this edge in metres; 0 keeps all.")
    ] = 0.0,
    keep_moving: Annotated[
        bool, typer.Option("--keep-moving", help="Keep what beams went through at other times.")
    ] = False,
    keep_mixed: Annotated[
        bool, typer.Option("--keep-mixed", help="Keep returns between two surfaces.")
    ] = False,
    georeference: Annotated[
        str,
        typer.Option(
            help="Use of GNSS fixes and control points: rigid, constraints (may bend the map) or off."
        ),
    ] = "rigid",
    epsg: Annotated[
        int | None,
        typer.Option(help="Projected system of the map.", show_default="UTM zone", min=1),
    ] = None,
    control_points: Annotated[
        Path | None, typer.Option(help="CSV of surveyed points: id,x,y,z,radius[,use].")
    ] = None,
    no_loop_closure: Annotated[
        bool, typer.Option("--no-loop-closure", help="Leave the trajectory open-loop.")
    ] = False,
    threads: Annotated[int | None, typer.Option(help="Default: all cores.", min=1)] = None,
    start: Annotated[
        float | None, typer.Option(help="Seconds to skip at the start.", min=0)
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Seconds of the recording to use.", min=0)
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in OUT that was killed.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")] = False,
    print_settings: Annotated[
        bool, typer.Option("--print-settings", help="Show the settings and stop.")
    ] = False,
) -> None:
    """Turn a recording into a trajectory, a map and a report."""
    # slow to import, so only when it is needed
    from bentwing.base.errors import UsageError
    from bentwing.base.progress import create_progress
    from bentwing.cli.merge import say_maps
    from bentwing.map.clean import CleanSettings
    from bentwing.recording.flights import flights_of
    from bentwing.run.flights import map_flights
    from bentwing.run.pipeline import run_recording
    from bentwing.run.settings import as_run_settings

    settings = as_run_settings(
        estimator=estimator,
        payload=payload,
        settings=None,
        map_format=map_format,
        map_spacing=map_spacing,
        cleaning=CleanSettings(mixed_pixels=not keep_mixed, moving=not keep_moving),
        georeferencing=georeferencing_settings(georeference, epsg, control_points),
        loop_closure=False if no_loop_closure else None,
        threads=threads,
        start=start,
        duration=duration,
    )
    if print_settings:
        typer.echo(settings.to_yaml())
        return
    if not recording or out is None:
        msg = "a recording and a folder for the results are needed: bentwing map RECORDING -o OUT"
        raise UsageError(msg)
    progress = create_progress(quiet=quiet)
    flights = flights_of(recording) if len(recording) > 1 else [recording]
    if len(flights) > 1:
        merged = map_flights(flights, out, settings, payload, resume=resume, progress=progress)
        if not quiet:
            say_maps(merged)
        return
    run_recording(recording, out, settings, payload, resume=resume, progress=progress)
    if not quiet:
        typer.echo(f"{out}: open {out / 'report.html'}")


def georeferencing_settings(
    mode: str, epsg: int | None, control_points: Path | None
) -> GeoreferenceSettings:
    """Return the settings that the options stand for.

    Raises
    ------
    UsageError
        If the mode is none of the known ones.
    """
    from bentwing.base.errors import UsageError
    from bentwing.closing.georeference.settings import GeoreferenceSettings

    if mode not in {"rigid", "constraints", "off"}:
        msg = f"--georeference {mode!r} is not known; choose rigid, constraints or off"
        raise UsageError(msg)
    return GeoreferenceSettings.model_validate(
        {"mode": mode, "epsg": epsg, "control_points": control_points}
    )
