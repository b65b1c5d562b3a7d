# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the first page says in words: of the job, of the recording, of coordinates, of what was left out."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING, Any

from bentwing.recording.sections.project import Project, project_in
from bentwing.report.sections import DASH

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.base.trajectory import Trajectory
    from bentwing.report.texts import Texts

_EARLIEST = 946_684_800  # s, the year 2000: a clock before counts from when it was switched on
_OF_RETURNS = {
    "no_echo": ("lidar.nan", "lidar.inf", "lidar.invalid"),
    "range": ("preprocess.range",),
    "self_hits": ("preprocess.self_hits",),
    "no_angle": ("preprocess.no_encoder_angle",),
    "outside": ("map.outside_trajectory", "map.not_finite"),
    "mixed": ("map.mixed_pixels",),
    "moving": ("map.moving",),
    "thinned": ("map.thinned",),
}


def job(record: Mapping[str, Any], trajectory: Trajectory, texts: Texts) -> list[tuple[str, str]]:
    """Names and values of what was done for whom, where, when, by whom and with what."""
    project = project_in(record) or Project()
    rows = [
        (texts.project, project.name),
        (texts.number_of, project.number),
        (texts.site, project.site),
        (texts.client, project.client),
        (texts.contractor, project.contractor),
        (texts.operator, project.operator),
        (texts.instrument, project.instrument or _head(record)),
        (texts.recorded, "; ".join(_spans(record, trajectory, project, texts))),
        (texts.recording, subject(record)),
        (texts.remarks, project.remarks),
    ]
    return [(name, value) for name, value in rows if value]


def subject(record: Mapping[str, Any]) -> str:
    """Name the recordings, or the runs that were merged."""
    maps = (record.get("merging") or {}).get("maps") or []
    runs = [str(run) for one in maps for run in one["runs"]]
    names = [str(item["name"]) for item in record.get("inputs") or []]
    named = runs or [name for name in names if not name.endswith((".yaml", ".yml"))]
    return f"{', '.join(named[:3])}{' …' if len(named) > 3 else ''}" or "recording"


def _head(record: Mapping[str, Any]) -> str:
    """Name the sensor head, or those of all runs."""
    payload = (record.get("settings") or {}).get("payload") or {}
    own = {"name": payload.get("name"), "kind": (payload.get("lidar") or {}).get("kind")}
    heads = [run["head"] for run in record.get("runs") or [] if "head" in run] or [own]
    named = dict.fromkeys(
        f"{name} ({kind})" if name and kind else name or kind
        for name, kind in ((head["name"] or "", head["kind"] or "") for head in heads)
    )
    return ", ".join(named)


def _spans(
    record: Mapping[str, Any], trajectory: Trajectory, project: Project, texts: Texts
) -> list[str]:
    """Date and times of each recording."""
    found = []
    for run in record.get("runs") or [record]:
        start, spans = run.get("start_ns"), run.get("segments") or []
        if start is None:
            continue
        if not spans and len(trajectory.times):
            spans = [[float(trajectory.times[0]), float(trajectory.times[-1])]]
        if start / 1e9 < _EARLIEST:
            return [texts.unknown_time]
        epoch = datetime.fromtimestamp(start // 10**9, timezone.utc)
        ends = [float(spans[0][0]), float(spans[-1][1])] if spans else [0.0, 0.0]
        first, last = ((epoch + timedelta(seconds=s)).astimezone(project.zone) for s in ends)
        day = first.strftime(texts.date)
        found.append(f"{day}, {first:%H:%M:%S} {DASH} {last:%H:%M:%S} {first:%Z}")
    return found


def coordinates(record: Mapping[str, Any], texts: Texts) -> str:
    """Name the coordinate system of the map."""
    found = record.get("georeference") or {}
    if "epsg" in found:
        heights = _heights(found.get("heights") or "those of the system", texts)
        return texts.say(
            texts.system, name=found.get("crs", ""), epsg=found["epsg"], heights=heights
        )
    if found.get("mode"):
        return texts.site_frame
    return texts.given_system if found else texts.local_frame


def _heights(said: str, texts: Texts) -> str:
    """Say what heights are above: the name of a system or an ellipsoid stays."""
    for english in ("above the ellipsoid", "those of the system", "those of"):
        if said.startswith(english):
            return said.replace(english, texts.phrase(english), 1)
    return said


def left_out(record: Mapping[str, Any], texts: Texts) -> list[str]:
    """Say what was measured and is not in the map, with the number and its share."""
    counts: Mapping[str, int] = record.get("counts") or {}
    total = counts.get("lidar.returns", 0)
    said = []
    for name, keys in _OF_RETURNS.items():
        n = sum(counts.get(key, 0) for key in keys)
        if n:
            share = f" ({_percent(n / total, texts)})" if total else ""
            said.append(f"{texts.number(n, ',')}{share} {texts.reasons[name]}")
    fixes = (record.get("georeference") or {}).get("fixes") or {}
    if fixes.get("rejected"):
        said.append(texts.say(texts.left_fixes, n=fixes["rejected"], of=fixes.get("fixes", 0)))
    marks = (record.get("georeference") or {}).get("control_points") or []
    unused = [
        str(row["id"]) for row in marks if row["residual"] is None and row.get("picked_off") is None
    ]
    if unused:
        said.append(texts.say(texts.left_marks, names=", ".join(unused)))
    return said


def _percent(share: float, texts: Texts) -> str:
    if share < 0.001:
        return texts.say(texts.below, share=0.1)
    return f"{texts.number(100 * share, '.1f')} %"
