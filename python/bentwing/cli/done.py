# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a command that has made a map says at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from bentwing.base.errors import EstimationError

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.evaluate.verdict import Verdict
    from bentwing.run.merging import Merged


def say_run(out: Path, verdict: Verdict, *, quiet: bool) -> None:
    """Say whether a run can be used, and where its report is.

    Raises
    ------
    EstimationError
        If it has failed: all files are there, but the map is wrong.
    """
    _require([(out, verdict)])
    if not quiet or verdict.state == "doubtful":
        typer.echo(f"{out}: {verdict.sentence()}; open {out / 'report.html'}", err=quiet)


def say_maps(merged: Merged, *, quiet: bool) -> None:
    """Say which maps there are, which runs are in them, and whether they can be used.

    Raises
    ------
    EstimationError
        If one of them has failed.
    """
    if len(merged.maps) > 1 and not quiet:
        typer.echo(f"not all runs have places in common: {len(merged.maps)} separate maps")
    for one in merged.maps:
        if not quiet or one.verdict.state == "doubtful":
            names, report = ", ".join(one.names), one.out / "report.html"
            typer.echo(f"{one.out}: {names}; {one.verdict.sentence()}; open {report}", err=quiet)
    _require([(one.out, one.verdict) for one in merged.maps])


def _require(results: list[tuple[Path, Verdict]]) -> None:
    failed = [(out, verdict) for out, verdict in results if verdict.state == "failed"]
    if not failed:
        return
    out, verdict = failed[0]
    more = f", and {len(failed) - 1} more" if len(failed) > 1 else ""
    msg = (
        f"{out}{more}: {verdict.sentence()}; the files are kept, open {out / 'report.html'} to see "
        "what is wrong"
    )
    raise EstimationError(msg)
