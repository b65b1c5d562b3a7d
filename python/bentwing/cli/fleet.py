# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing fleet`: many recordings into merged maps, on a cluster."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.base.new_file import require_folder
from bentwing.cli import options
from bentwing.fleet.store import is_url

EXAMPLES = (
    "bentwing fleet flights -o site",
    "bentwing fleet flights.yaml -o site --workers 4",
    "bentwing fleet flights.csv -o site --scheduler tcp://head:8786",
    "bentwing fleet s3://bucket/flights -o s3://bucket/site",
)


def _writable(place: str) -> str:
    """Look at a folder here before anything else is done; a store is asked when it is written to."""
    if not is_url(place):
        require_folder(Path(place))
    return place


def command(
    recordings: Annotated[
        list[str],
        typer.Argument(
            metavar="MANIFEST|FOLDER|URL",
            help="List of recordings, .yaml or .csv, or folders that hold recordings; also s3://….",
            rich_help_panel=options.INPUT,
        ),
    ],
    *,
    out: Annotated[
        str,
        options.option(
            options.RESULT,
            "--out",
            "-o",
            metavar="FOLDER|URL",
            callback=_writable,
            help="Write into this folder, here or in a store.",
        ),
    ],
    payload: options.Payload = None,
    settings: options.Settings = None,
    set_: options.Set = [],  # noqa: B006 - typer reads it and hands out a copy
    estimator: options.Estimator = None,
    map_format: options.Format = None,
    map_spacing: options.Spacing = None,
    georeference: options.Georeference = None,
    epsg: options.Epsg = None,
    control_points: options.ControlPoints = None,
    project: options.Project = None,
    trust_payload: options.TrustPayload = False,
    force: options.Force = False,
    workers: Annotated[
        int | None,
        options.option(
            options.RUNNING,
            "--workers",
            metavar="N",
            min=1,
            max=1024,
            show_default="two where memory allows",
            help="Start a cluster of N workers on this machine.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        options.option(
            options.RUNNING,
            "--scheduler",
            metavar="ADDRESS",
            show_default="DASK_ADDRESS",
            help="Use the dask cluster whose scheduler is there, such as tcp://head:8786.",
        ),
    ] = None,
    threads: options.Threads = None,
    quiet: options.Quiet = False,
) -> None:
    """Map many recordings, merge those that belong together, and make one folder of all.

    Each recording is mapped in a process of its own. One that cannot be mapped does not stop the others,
    and what is finished is left as it is when the command is started again.
    """
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.cli.done import say_site
    from bentwing.fleet.opened import on_cluster
    from bentwing.fleet.plan import Choice
    from bentwing.fleet.site import map_site
    from bentwing.recording.sections.project import Project
    from bentwing.run.choose import given

    options_given = given(
        estimator=estimator,
        map_format=map_format,
        map_spacing=map_spacing,
        georeferencing=given(mode=georeference, epsg=epsg, control_points=control_points),
        project=None if project is None else Project.load(project),
        trust_payload=True if trust_payload else None,
        force=True if force else None,
    )
    progress = create_progress(quiet=quiet)
    opened = on_cluster(threads, progress, workers=workers, scheduler=scheduler)
    choice = Choice(settings, tuple(set_), payload, options_given)
    say_site(map_site(recordings, out, choice, opened, progress), quiet=quiet)
