# SPDX-License-Identifier: MIT OR Apache-2.0
"""The verdict, the numbers and the tables of a report, as HTML."""

from __future__ import annotations

import re
from html import escape
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.spans import name_spans
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.expected import ExpectedAccuracy
from bentwing.report.picture import thinned
from bentwing.report.texts import ENGLISH

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.report.coverage import Coverage
    from bentwing.report.texts import Texts

Row = tuple[str, ...]
_PAUSE = 1.0  # s without a pose: there one run ends and the next begins

# A sign each, for those who do not see the colours apart.
SIGNS = {"good": "\N{CHECK MARK}", "warn": "!", "bad": "\N{MULTIPLICATION X}"}
DASH, TIMES, MINUS = "\N{EN DASH}", "\N{MULTIPLICATION SIGN}", "\N{MINUS SIGN}"
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:mm|m|%|s)\b)")


def verdict(record: Mapping[str, Any], texts: Texts = ENGLISH) -> str:
    """State in one box whether the result can be used as it is, and how accurate it is."""
    found = record.get("verdict") or {}
    reasons = [_reason(reason, texts) for reason in found.get("reasons") or []]
    warnings = [str(warning) for warning in record.get("warnings") or []]
    if not record.get("complete", False):
        stage, reason = record.get("stage", "?"), record.get("reason") or "not finished"
        level, headline = "bad", texts.incomplete
        sentence = texts.say(texts.stopped, stage=stage, reason=reason)
    else:
        state = found.get("state", "good")
        level = {"good": "good", "doubtful": "warn", "failed": "bad"}[state]
        headline = texts.headlines[state] if found else texts.finished
        sentence = expected(record, texts)
    items = "".join(f"<li>{escape(capital(reason))}.</li>" for reason in reasons)
    listed = _set_up(record.get("set_up") or [], texts) + (f"<ul>{items}</ul>" if items else "")
    if warnings:
        items = "".join(f'<li lang="en">{escape(warning)}</li>' for warning in warnings)
        listed += f"<p>{texts.worth_knowing}</p><ul>{items}</ul>"
    said = f"<p>{escape(sentence)}</p>" if sentence else ""
    return f'<div class="verdict {level}"><strong>{SIGNS[level]} {escape(headline)}</strong>{said}{listed}</div>'


def _reason(reason: Mapping[str, Any], texts: Texts) -> str:
    """Say a reason in the language of the report, as far as run.json has what it takes."""
    found = texts.findings.get(reason["kind"])
    if found is None:
        return f"{reason['sentence']}: {reason['advice']}"
    value = reason["value"] if reason["value"] is not None else np.inf
    measured = {"value": value, "percent": 100 * value, "when": "", **(reason.get("facts") or {})}
    spans = reason.get("spans") or []
    if spans:
        measured["when"] = f" {named_spans(spans, texts)}"
    try:
        said = texts.say(found[0], **measured)
    except KeyError:  # of an earlier version, without facts
        said = str(reason["sentence"])
    return f"{said}: {found[1]}"


def named_spans(spans: Sequence[Sequence[float]], texts: Texts) -> str:
    """Name stretches of time, of many the longest."""
    return name_spans(
        [(first, last) for first, last in spans],
        one=lambda first, last: texts.say(texts.span, first=first, last=last),
        others=lambda n: texts.say(texts.shorter, n=n),
        conjunction=texts.conjunction,
    )


def _set_up(findings: Sequence[Mapping[str, Any]], texts: Texts) -> str:
    """Say what was found of the head that the payload, if there was one, does not say."""
    if not findings:
        return ""
    items = "".join(
        f"<li>{escape(capital(f['sentence']))}: <code>{escape(f['line'])}</code></li>"
        for f in findings
    )
    return f"<p>{escape(texts.set_up)}</p><ul>{items}</ul>"


def capital(sentence: str) -> str:
    """Begin a sentence with a capital letter."""
    return sentence[:1].upper() + sentence[1:]


def expected(record: Mapping[str, Any], texts: Texts) -> str:
    """Say how accurate the result is expected to be."""
    found = record.get("expected_accuracy")
    checked = ((record.get("georeference") or {}).get("residuals") or {}).get("check")
    if found:
        said = _accuracy(ExpectedAccuracy(**found), texts)
    elif checked:
        said = texts.say(texts.accuracy_checked, rms=1e3 * checked["rms"], n=checked["n"])
    else:
        said = texts.accuracy_none
    return _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", said)


def _accuracy(found: ExpectedAccuracy, texts: Texts) -> str:
    whole, short = (
        texts.say(
            texts.accuracy_of,
            horizontal=_length(h, texts),
            vertical=_length(v, texts),
            heading=np.degrees(turn),
        )
        for h, v, turn in (
            (found.horizontal, found.vertical, found.heading),
            (found.horizontal_per_10m, found.vertical_per_10m, found.heading_per_10m),
        )
    )
    said = texts.say(texts.accuracy, whole=whole, short=short)
    if found.map_thickness is not None:
        said += "; " + texts.say(texts.accuracy_map, mm=1e3 * found.map_thickness)
    return f"{said}."


def _length(metres: float, texts: Texts) -> str:
    if metres >= 0.1:
        return f"{texts.number(metres, '.2f')} m"
    return f"{texts.number(1e3 * metres, '.2g' if metres < 0.01 else '.0f')} mm"


def quality(windows: Sequence[Mapping[str, Any]]) -> str:
    """Say how many matches agree with the trajectory."""
    shares = [w["inlier_share"] for w in windows if w.get("inlier_share") is not None]
    if not shares:
        return "All stages completed."
    return (
        f"All stages completed; {100 * float(np.median(shares)):.0f} % of the surface matches agree "
        f"with the trajectory in the median window, {100 * min(shares):.0f} % in the worst."
    )


def tiles(
    record: Mapping[str, Any],
    trajectory: Trajectory,
    points: NDArray[np.float64],
    coverage: Coverage | None,
    texts: Texts = ENGLISH,
) -> str:
    """Show the few numbers everybody asks for."""
    counts = record.get("counts") or {}
    facts: list[tuple[str, str]] = []
    if coverage is not None:
        facts.append((f"{texts.number(coverage.area, ',.0f')} m²", texts.area))
        facts.append((f"{texts.number(coverage.volume, ',.0f')} m³", texts.volume))
    if len(trajectory.times) > 1:
        parts = _parts(trajectory)
        duration = sum(float(part.times[-1] - part.times[0]) for part in parts)
        facts.append((f"{texts.number(sum(map(path_length, parts)), ',.0f')} m", texts.length))
        facts.append((clock(duration), texts.duration))
    if "map.points" in counts:
        n_points = counts.get("map.written", counts["map.points"])
        facts.append((_amount(n_points, texts), texts.points))
    if len(points):
        size = np.subtract(*np.percentile(thinned(points), [99.8, 0.2], axis=0))
        facts.append(
            (
                f"\N{THIN SPACE}{TIMES}\N{THIN SPACE}".join(f"{s:.0f}" for s in size) + " m",
                texts.extent,
            )
        )
    cells = [
        f'<div class="tile"><b>{escape(b)}</b><span>{escape(s)}</span></div>' for b, s in facts
    ]
    return f'<div class="tiles">{"".join(cells)}</div>'


def refinement_sentence(found: Mapping[str, Any] | None, texts: Texts) -> str:
    """Say how many points were moved along their beams, by how much, and what is left."""
    if found is None:
        return ""
    if not found.get("moved"):
        return f"<p>{escape(texts.nothing_refined)}</p>"
    move, before, after = (1000 * found[name] for name in ("move", "sigma_before", "sigma"))
    said = texts.say(
        texts.refined, share=100 * found["moved"], move=move, before=before, after=after
    )
    return f"<p>{escape(said)}</p>"


def _parts(trajectory: Trajectory) -> list[Trajectory]:
    """Return the trajectories of runs that were joined one after the other, with a pause between."""
    cuts = [0, *(np.flatnonzero(np.diff(trajectory.times) > _PAUSE) + 1), len(trajectory.times)]
    slices = [slice(a, b) for a, b in pairwise(cuts) if b - a > 1]
    return [
        Trajectory(trajectory.times[s], trajectory.positions[s], trajectory.quats_xyzw[s])
        for s in slices
    ]


def path_length(trajectory: Trajectory) -> float:
    """Length of the way, m, from positions ten times a second so that vibration does not count."""
    times = np.arange(trajectory.times[0], trajectory.times[-1], 0.1)
    positions, _ = trajectory.interpolate(times)
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())


def table(head: Row, rows: Iterable[Row], *, numbers: frozenset[int] = frozenset()) -> str:
    """Make a table; the columns in `numbers` are set in tabular figures."""

    def cell(i: int, text: str) -> str:
        kind = ' class="n"' if i in numbers else ""
        return f"<td{kind}>{escape(text)}</td>"

    body = ["<tr>" + "".join(cell(i, t) for i, t in enumerate(row)) + "</tr>" for row in rows]
    if not body:
        return '<p class="none">Not recorded.</p>'
    top = "".join(f"<th>{escape(text)}</th>" for text in head)
    return (
        f'<div class="scroll"><table><thead><tr>{top}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div>"
    )


def mapping_table(head: Row, values: Mapping[str, Any], *, are_amounts: bool = True) -> str:
    """Make a table of names and values, nested names joined by dots.

    Parameters
    ----------
    are_amounts : whether thousands are set apart; a code, a year or a version is no amount
    """
    rows = [(k.replace("_", " "), _value(v, are_amounts=are_amounts)) for k, v in _flat(values)]
    return table(head, rows, numbers=frozenset({1}) if are_amounts else frozenset())


def timings_table(timings: Mapping[str, float], peak_memory_mb: float | None) -> str:
    """Make the table of wall times by stage, and of the most memory."""
    rows = [
        ((f"{DASH} " + name.split("/", 1)[1]) if "/" in name else name, f"{seconds:.2f}")
        for name, seconds in timings.items()
    ]
    if peak_memory_mb is not None:
        rows.append(("most memory, MB", f"{peak_memory_mb:.1f}"))
    return table(("stage", "seconds"), rows, numbers=frozenset({1}))


def shares_table(shares: Sequence[Mapping[str, Any]]) -> str:
    """Make the table of runs whose GNSS fixes place a merged map."""

    def metres(offset: Sequence[float] | None) -> str:
        return (
            DASH
            if offset is None
            else ", ".join(f"{value:+.3f}".replace("-", MINUS) for value in offset)
        )

    cells = [
        (s["name"], f"{s['used']:,}", f"{s['rejected']:,}", metres(s["offset"])) for s in shares
    ]
    head = ("run", "used", "left out", "map from fixes (east, north, up), m")
    return table(head, cells, numbers=frozenset({1, 2}))


def inputs_table(inputs: Sequence[Mapping[str, Any]]) -> str:
    """Make the table of input files with their hashes."""
    rows = [
        (str(i["name"]), f"{i['bytes'] / 1e6:,.1f} MB", f"{i['sha256']} ({i['hashed']})")
        for i in inputs
    ]
    return table(("file", "size", "SHA-256 (of)"), rows, numbers=frozenset({1}))


def _flat(values: Mapping[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    flat: list[tuple[str, Any]] = []
    for name, value in values.items():
        if isinstance(value, dict):
            flat += _flat(value, f"{prefix}{name}.")
        else:
            flat.append((f"{prefix}{name}", value))
    return flat


def figure(drawing: str, name: str, note: str = "", *, wide: bool = False) -> str:
    """Make a drawing with its caption, which stay together."""
    kind = ' class="wide"' if wide else ""
    caption = f"<b>{escape(name)}</b> {escape(note)}"
    return f"<figure{kind}>{drawing}<figcaption>{caption}</figcaption></figure>"


def _value(value: object, *, are_amounts: bool) -> str:
    if value is None:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}" if are_amounts else str(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return ", ".join(_value(item, are_amounts=are_amounts) for item in value)
    return str(value)


def _amount(n: int, texts: Texts) -> str:
    if n < 1_000_000:
        return texts.number(n, ",")
    return f"{texts.number(n / 1e6, '.0f' if n >= 10_000_000 else '.1f')} {texts.million}"


def clock(seconds: float) -> str:
    """Write a duration."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d} min" if whole >= 60 else f"{seconds:.0f} s"
