# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing info`: whether a recording is fit for mapping."""

import typer

from bentwing.base.errors import RecordingError
from bentwing.cli import options

UNFIT = RecordingError.exit_code

EXAMPLES = (
    "bentwing info recording.bag",
    "bentwing info recording.bag -p payload.yaml",
    "bentwing info recording.bag --write-payload payload.yaml",
    "bentwing info part1.bag part2.bag --json",
)


def command(
    recording: options.Recording,
    *,
    payload: options.Payload = None,
    write_payload: options.WritePayload = None,
    as_json: options.Json = False,
) -> int | None:
    """Check a recording: topics, rates, gaps, spin, stalls and visible structure, with a verdict."""
    # slow to import, so only when it is needed
    import json

    from rich.console import Console

    from bentwing.base.plain import plain
    from bentwing.calibrate.draft import draft_payload
    from bentwing.calibrate.inspection import inspect
    from bentwing.cli.info_page import page

    inspection = inspect(recording, payload)
    if write_payload is not None:
        shown = inspection.set_up
        described = payload if shown is None or shown.doubt is not None else shown.payload
        draft_payload(recording, described, inspection.self_hits).save(write_payload)
    if as_json:
        typer.echo(json.dumps({**plain(inspection), "is_fit": inspection.is_fit}))
    else:
        console = Console()
        for part in page(inspection):
            console.print(part)
    return None if inspection.is_fit else UNFIT
