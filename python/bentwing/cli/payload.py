# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing payload`: a description of the sensor head to start from, and those that are ready."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from bentwing.base.errors import UsageError
from bentwing.cli import options

EXAMPLES = (
    "bentwing payload init recording.bag",
    "bentwing payload init recording.bag -o head.yaml",
    "bentwing payload list",
)


def command(
    action: Annotated[
        Literal["init", "list"],
        typer.Argument(
            metavar="ACTION",
            help="What to do: init writes what a recording tells of its head; list names the payloads of "
            "public data sets that come with bentwing.",
            rich_help_panel=options.INPUT,
        ),
    ],
    recording: options.SomeRecording = None,
    *,
    out: Annotated[
        Path | None,
        options.file(
            "--out",
            "-o",
            show_default="payload.yaml",
            help="Write this file; it must not exist.",
        ),
    ] = None,
    quiet: options.Quiet = False,
) -> None:
    """Write a payload.yaml to start from, or list those of public data sets."""
    if action == "list":
        if recording or out is not None:
            msg = "`bentwing payload list` takes neither recordings nor --out"
            raise UsageError(msg)
        _list()
        return
    if not recording:
        msg = "`bentwing payload init` needs the recording that it is to read"
        raise UsageError(msg)
    _write(recording, Path("payload.yaml") if out is None else out, quiet=quiet)


def _list() -> None:
    from bentwing.recording.ready import FOLDER, PREFIX, ready_payloads

    ready = ready_payloads()
    width = max(len(one.name) for one in ready) + len(PREFIX)
    for one in ready:
        typer.echo(f"{PREFIX + one.name:{width}}  {one.title}")
    typer.echo(f"{FOLDER}: the files, with the sources of their figures; copy one to change it")


def _write(recording: list[Path], out: Path, *, quiet: bool) -> None:
    # slow to import, so only when it is needed
    from bentwing.base.new_file import require_new
    from bentwing.calibrate.draft import draft_payload

    require_new(out)
    draft = draft_payload(recording)
    draft.save(out)
    if not quiet:
        typer.echo(draft.to_yaml())
        typer.echo(f"{out}: written; answer what stands behind #, then `bentwing info`")
