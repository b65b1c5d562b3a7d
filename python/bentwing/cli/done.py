# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a command that has made a map says at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from bentwing.base.errors import EstimationError, InputError, PartialError

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.evaluate.verdict import Verdict
    from bentwing.fleet.record import Site
    from bentwing.run.found import WrittenMap
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


def say_changes(out: Path, written: WrittenMap | None, *, quiet: bool) -> None:
    """Say what has changed since the map was made in which a recording was found."""
    if quiet or written is None or written.change is None:
        return
    areas, said = written.change.areas(), "nothing has changed since the map was made"
    if areas:
        new = sum(one.kind == "appeared" for one in areas)
        said = (
            f"areas changed since the map was made: {new} appeared, {len(areas) - new} disappeared, "
            f"the largest of {areas[0].area:.1f} m²; the report shows where"
        )
    typer.echo(f"{out}: {said}")


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


def say_site(site: Site, *, quiet: bool) -> None:
    """Say what came of each of many recordings, and which maps there are.

    Raises
    ------
    PartialError, EstimationError, InputError
        If not all of them have a map that can be used: if some have, if some failed, or if all are
        refused.
    """
    from bentwing.fleet.task import sentence_of

    page = site.place(site.out / "index.html")
    if not quiet:
        wide = max(len(one.name) for one in site.recordings)
        for one in site.recordings:
            state = sentence_of(one.state, one.reason)
            typer.echo(f"{one.name:<{wide}}  {state}{' (as before)' if one.is_earlier else ''}")
        for group in site.groups or []:
            alone = len(group.runs) == 1
            state = "belongs to no other" if alone else sentence_of(group.state, group.reason)
            typer.echo(f"{site.place(group.folder)}: {', '.join(group.runs)}; {state}")
        typer.echo(f"{site.url or site.out}: {_counted(site)}; open {page}")
    if site.is_complete:
        return
    bad = [one for one in site.recordings if not one.is_usable]
    wrong = [one for one in site.groups or [] if one.state == "failed" and len(one.runs) > 1]
    said = [
        f"{one.name} ({sentence_of(one.state, one.reason)})" if quiet else one.name for one in bad
    ]
    problems = [
        *(
            [f"{len(bad)} of {len(site.recordings)} are not mapped: {', '.join(said)}"]
            if bad
            else []
        ),
        *([f"the runs were not merged: {site.failure}"] if site.failure else []),
        *(f"{site.place(one.folder)}: {sentence_of(one.state, one.reason)}" for one in wrong),
    ]
    msg = f"{'; '.join(problems)}; open {page}"
    if len(bad) < len(site.recordings):
        raise PartialError(msg)
    raise (EstimationError if any(one.state == "failed" for one in bad) else InputError)(msg)


def _counted(site: Site) -> str:
    states = [one.state for one in site.recordings]
    return ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))


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
