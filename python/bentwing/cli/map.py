# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing map`: from a recording to a trajectory, a map and a report."""

from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.command import PRINT_SETTINGS

EXAMPLES = (
    "bentwing map recording.bag -p payload.yaml -o run",
    "bentwing map recording.bag -p payload.yaml -o run --start 60 --duration 30",
    "bentwing map part1.bag part2.bag -p payload.yaml -o run --map-spacing 0.02",
    "bentwing map flights -p payload.yaml -o runs",
    "bentwing map --print-settings -p payload.yaml > settings.yaml",
    "bentwing map recording.bag -o run --settings settings.yaml --set window=4",
)


def command(
    recording: options.Recording,
    *,
    out: options.Out,
    payload: options.Payload = None,
    estimator: options.Estimator = None,
    settings: options.Settings = None,
    set_: options.Set = [],  # noqa: B006 - typer reads it and hands out a copy
    map_format: options.Format = None,
    map_spacing: options.Spacing = None,
    keep_moving: options.KeepMoving = False,
    keep_mixed: options.KeepMixed = False,
    no_refine: options.NoRefine = False,
    normals: options.Normals = False,
    attributes: options.Attributes = None,
    georeference: options.Georeference = None,
    epsg: options.Epsg = None,
    gnss: options.Gnss = None,
    gnss_time: options.GnssTime = None,
    control_points: options.ControlPoints = None,
    no_loop_closure: Annotated[
        bool,
        options.option(
            options.ESTIMATION, "--no-loop-closure", help="Leave the trajectory open-loop."
        ),
    ] = False,
    loops: options.Loops = None,
    no_map: Annotated[
        bool,
        options.option(
            options.MAP, "--no-map", help="Leave the map out: the trajectory alone, much sooner."
        ),
    ] = False,
    project: options.Project = None,
    write_payload: options.WritePayload = None,
    threads: options.Threads = None,
    start: options.Start = None,
    duration: options.Duration = None,
    trust_payload: options.TrustPayload = False,
    force: options.Force = False,
    resume: options.Resume = False,
    quiet: options.Quiet = False,
    print_settings: Annotated[
        bool,
        options.option(
            options.ESTIMATION,
            PRINT_SETTINGS,
            help="Print the settings and the sensor head, and stop; needs no recording.",
        ),
    ] = False,
) -> None:
    """Turn a recording into a trajectory, a map and a report.

    Several parts of one recording are mapped as one; recordings of several flights are mapped one by
    one and merged. The recordings in a folder are mapped each into a folder of its own.
    """
    # slow to import, so only when it is needed
    from bentwing.base.errors import UsageError
    from bentwing.base.progress import create_progress
    from bentwing.cli.done import say_maps, say_run, say_site
    from bentwing.closing.loop_file import read_loops
    from bentwing.recording.containers.source import is_folder_of_recordings
    from bentwing.recording.flights import flights_of
    from bentwing.recording.sections.project import Project
    from bentwing.run.choose import choose, given
    from bentwing.run.pipeline import run_recording

    options_given = given(
        estimator=estimator,
        map_format=map_format,
        map_spacing=map_spacing,
        cleaning=options.cleaning(keep_mixed=keep_mixed, keep_moving=keep_moving),
        refine=False if no_refine else None,
        normals=True if normals else None,
        georeferencing=given(
            mode=georeference,
            epsg=epsg,
            fixes=gnss,
            fixes_time=gnss_time,
            control_points=control_points,
        ),
        loop_closure=False if no_loop_closure else None,
        loops=None if loops is None else read_loops(loops),
        writes_map=False if no_map else None,
        project=None if project is None else Project.load(project),
        threads=threads,
        start=start,
        duration=duration,
        trust_payload=True if trust_payload else None,
        force=True if force else None,
    )
    chosen = choose(settings, set_, payload, options_given)
    if (carried := options.names(attributes)) is not None:
        chosen = chosen.carrying(carried)
    if print_settings:
        typer.echo(chosen.to_yaml(), nl=False)
        return
    progress = create_progress(quiet=quiet)
    if any(map(is_folder_of_recordings, recording)):
        from bentwing.fleet.opened import side_by_side
        from bentwing.fleet.plan import Choice
        from bentwing.fleet.site import map_site

        of_one: dict[str, object] = {
            "--write-payload": write_payload,
            "--loops": loops,
            "--gnss": gnss,
            "--attributes": attributes,
        }
        for name in (name for name, file in of_one.items() if file is not None):
            msg = f"{name} with a folder of recordings: give it with one recording"
            raise UsageError(msg)
        choice = Choice(settings, tuple(set_), payload, options_given)
        opened = side_by_side(threads, progress)
        say_site(map_site(recording, out, choice, opened, progress, merges=False), quiet=quiet)
        return
    flights = flights_of(recording) if len(recording) > 1 else [recording]
    if len(flights) > 1:
        from bentwing.run.flights import map_flights

        if not chosen.writes_map:
            msg = (
                f"--no-map with {len(flights)} flights: they are merged into one map; give one "
                "recording, or leave it out"
            )
            raise UsageError(msg)
        if write_payload is not None:
            msg = (
                f"--write-payload with {len(flights)} flights: each finds the head anew; give it with "
                "one recording"
            )
            raise UsageError(msg)
        merged = map_flights(flights, out, chosen, payload, resume=resume, progress=progress)
        say_maps(merged, quiet=quiet)
        return
    found = run_recording(recording, out, chosen, payload, resume=resume, progress=progress)
    if write_payload is not None and found.estimate is not None and found.payload is not None:
        from bentwing.calibrate.outcome import with_motion

        with_motion(found.payload, found.estimate.calibration).save(write_payload)
    say_run(out, found.verdict, quiet=quiet)
