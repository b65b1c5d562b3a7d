# SPDX-License-Identifier: MIT OR Apache-2.0
"""index.html of many runs: a row and a picture for each, with links to their reports."""

from __future__ import annotations

from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from bentwing.base.atomic import write_text
from bentwing.base.run_record import RUN_FOLDER
from bentwing.report.merging import merging_section
from bentwing.report.sections import SIGNS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

_JOINS = 6  # pairs of recordings that are named
_LEVELS = {"good": "good", "doubtful": "warn", "failed": "bad", "refused": "bad"}


def write_site_page(path: Path, record: Mapping[str, Any]) -> None:
    """Write the page of a site.

    Parameters
    ----------
    path : file to write, atomically; links and pictures are relative to its folder
    record : as in site.json
    """
    recordings, groups = record["recordings"], record["groups"]
    parts = [
        f"<header><h1>{len(recordings)} recordings</h1><p>{_counted(recordings)}</p></header>",
        _summary(record),
        *([] if groups is None else [_maps(groups)]),
        "<h2>Recordings</h2>",
        _table(
            ("", "recording", "state", "recorded", "points"),
            [_recording(one, path.parent) for one in recordings],
        ),
        _places(record),
    ]
    style = files("bentwing.report").joinpath("style.css").read_text(encoding="utf-8")
    page = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{len(recordings)} recordings</title><style>{style}</style></head>"
        f"<body><main>{''.join(parts)}</main></body></html>\n"
    )
    write_text(path, page)


def _counted(recordings: Sequence[Mapping[str, Any]]) -> str:
    counts = {state: sum(one["state"] == state for one in recordings) for state in _LEVELS}
    return ", ".join(f"{n} {state}" for state, n in counts.items() if n)


def _summary(record: Mapping[str, Any]) -> str:
    """Say in one box what is there, and what is not."""
    bad = [one for one in record["recordings"] if one["state"] in {"failed", "refused"}]
    groups = record["groups"] or []
    said = [f"{one['name']} ({one['state']}): {one['reason']}" for one in bad]
    if record["failure"]:
        said.append(f"The runs were not merged: {record['failure']}")
    if len(groups) > 1:
        islands = "; ".join(", ".join(one["runs"]) for one in groups)
        said.append(
            f"Not all runs have places in common. These are {len(groups)} separate maps, whose "
            f"relative poses are unknown: {islands}"
        )
    doubted = [one for one in groups if len(one["runs"]) > 1 and one["state"] != "good"]
    said += [f"{', '.join(one['runs'])} ({one['state']}): {one['reason']}" for one in doubted]
    is_doubted = len(groups) > 1 or doubted
    level = "bad" if bad or record["failure"] else "warn" if is_doubted else "good"
    headline = {
        "good": "All recordings are mapped",
        "warn": "All recordings are mapped, into separate maps"
        if len(groups) > 1
        else "All recordings are mapped, but the map is to be checked",
        "bad": "Not all recordings could be mapped" if bad else "The runs were not merged",
    }[level]
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in said)
    listed = f"<ul>{items}</ul>" if items else ""
    return f'<div class="verdict {level}"><strong>{SIGNS[level]} {headline}</strong>{listed}</div>'


def _maps(groups: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            _picture(one["folder"], ", ".join(one["runs"])),
            _link(", ".join(one["runs"]), one["folder"]),
            _state(one),
            _rests_on(one),
        )
        for one in groups
    ]
    return "<h2>Maps</h2>" + _table(
        ("", "recordings", "state", "what their positions rest on"), rows
    )


def _rests_on(group: Mapping[str, Any]) -> str:
    """Say by what the runs of a map hang together, the weakest first."""
    if len(group["runs"]) == 1:
        return "belongs to no other"
    joins = sorted(group.get("joins") or [], key=lambda one: (one["n_places"], one["has_loop"]))
    if not joins:
        return escape(f"{group['n_links']} places in common")
    said = [_join(one) for one in joins[:_JOINS]]
    if len(joins) > _JOINS:
        said.append(f"and {len(joins) - _JOINS} more pairs of recordings")
    return "<br>".join(map(escape, said))


def _join(one: Mapping[str, Any]) -> str:
    a, b = one["runs"]
    n = one["n_places"]
    if n == 1 and not one["has_loop"]:
        return f"{b} and {a}: a single place; no other place and no loop of recordings confirms it"
    found = "one place" if n == 1 else f"{n} places"
    return f"{b} and {a}: {found}{', confirmed by a loop of recordings' if one['has_loop'] else ''}"


def _places(record: Mapping[str, Any]) -> str:
    """Show what the merging compared, the groups in front."""
    if not record["places"]:
        return ""
    return merging_section({**record["places"], "maps": record["groups"]})


def _recording(one: Mapping[str, Any], site: Path) -> tuple[str, ...]:
    folder = one["folder"]
    # Of a site in a store, only the records are here.
    record = None if folder is None else RUN_FOLDER.read(site / folder)
    files = (record or {}).get("files", [])
    has_report, has_picture = "report.html" in files, "map_top.png" in files
    return (
        _picture(folder, one["name"]) if has_picture else "",
        _link(one["name"], folder) if has_report else escape(one["name"]),
        _state(one),
        f"{one['seconds']:,.0f} s" if one["seconds"] else "",
        f"{one['points'] / 1e6:.2f} M" if one["points"] else "",
    )


def _state(one: Mapping[str, Any]) -> str:
    sign = SIGNS[_LEVELS[one["state"]]]
    reason = f"<br>{escape(one['reason'])}" if one["reason"] else ""
    return f"{sign} {one['state']}{reason}"


def _link(name: str, folder: str) -> str:
    return f'<a href="{quote(folder)}/report.html">{escape(name)}</a>'


def _picture(folder: str, name: str) -> str:
    place = quote(folder)
    return (
        f'<a href="{place}/report.html"><img class="thumbnail" loading="lazy" '
        f'src="{place}/map_top.png" alt="{escape(name)} from above"></a>'
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Make a table of cells that are HTML already."""
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>'


def _cell(html: str) -> str:
    kind = ' class="picture"' if "<img" in html else ' class="n"' if html[:1].isdigit() else ""
    return f"<td{kind}>{html}</td>"
