# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing localize`: a recording in a map that is already there."""

from pathlib import Path
from typing import Annotated

from bentwing.cli import options
from bentwing.map.formats import MAP_FORMATS

EXAMPLES = (
    "bentwing localize recording.bag --map site -p payload.yaml -o today",
    "bentwing localize recording.bag --map scan.laz -p payload.yaml -o today",
)


def command(
    recording: options.Recording,
    *,
    prior_map: Annotated[
        Path,
        options.option(
            options.INPUT,
            "--map",
            metavar="MAP",
            help=f"Find the recording in this: a run folder, or a map ({', '.join(MAP_FORMATS)}).",
        ),
    ],
    out: options.Out,
    payload: options.Payload = None,
    estimator: options.Estimator = None,
    settings: options.Settings = None,
    set_: options.Set = [],  # noqa: B006 - typer reads it and hands out a copy
    map_format: options.Format = None,
    map_spacing: options.Spacing = None,
    keep_moving: options.KeepMoving = False,
    keep_mixed: options.KeepMixed = False,
    project: options.Project = None,
    no_refine: options.NoRefine = False,
    normals: options.Normals = False,
    threads: options.Threads = None,
    start: options.Start = None,
    duration: options.Duration = None,
    trust_payload: options.TrustPayload = False,
    force: options.Force = False,
    resume: options.Resume = False,
    quiet: options.Quiet = False,
) -> None:
    """Find a recording in a map without a guess, and report what has changed.

    Writes what `bentwing map` does, in the frame of the map, and the points that have appeared and
    disappeared since.
    """
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.cli.done import say_changes, say_run
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
        prior_map=prior_map,
        project=None if project is None else Project.load(project),
        threads=threads,
        start=start,
        duration=duration,
        trust_payload=True if trust_payload else None,
        force=True if force else None,
    )
    chosen = choose(settings, set_, payload, options_given)
    progress = create_progress(quiet=quiet)
    found = run_recording(recording, out, chosen, payload, resume=resume, progress=progress)
    say_changes(out, found.map, quiet=quiet)
    say_run(out, found.verdict, quiet=quiet)
