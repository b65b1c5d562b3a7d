# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which runs, or segments of one, were put together, by which places, and why not by others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.report.sections import DASH, table
from bentwing.report.texts import ENGLISH

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bentwing.report.texts import Texts

_HEAD = ("one", "other", "votes", "keypoints", "overlap", "agreement", "apart, mm", "verdict")
_NUMBERS = frozenset({2, 3, 4, 5, 6})


def merging_section(merging: Mapping[str, Any] | None, texts: Texts = ENGLISH) -> str:
    """Make the tables of maps and of all pairs of places that were considered; empty without any."""
    if not merging:
        return ""
    candidates = merging.get("candidates") or []
    accepted = [c for c in candidates if c["accepted"]]
    others = [c for c in candidates if not c["accepted"]]
    parts = [
        f"<h2>{texts.phrase('Places seen by more than one')}</h2>",
        _groups(merging),
        f"<h3>{texts.phrase('Accepted ({n})', n=len(accepted))}</h3>{_table(accepted)}",
        f"<details><summary>{texts.phrase('Rejected ({n}), with the reason', n=len(others))}</summary>"
        f"{_table(others)}</details>",
    ]
    return "".join(parts)


def _groups(merging: Mapping[str, Any]) -> str:
    """Tell what belongs together."""
    rows = [
        (
            "this one" if one["folder"] == "." else one["folder"],
            ", ".join(one["runs"]),
            str(one["n_links"]),
        )
        for one in merging.get("maps") or []
    ]
    if rows:
        return table(("map", "runs", "places that link them"), rows, numbers=frozenset({2}))
    groups: Sequence[Sequence[int]] = merging.get("groups") or []
    told = [(", ".join(str(segment) for segment in group),) for group in groups]
    return table(("segments that belong together",), told)


def _table(candidates: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            _place(c, "a"),
            _place(c, "b"),
            f"{c['votes']:.0f}",
            f"{c['n_inliers']}" if c["n_inliers"] else DASH,
            _share(c.get("overlap")),
            _share(c.get("agreement")),
            DASH if c.get("distance") is None else f"{1e3 * c['distance']:.0f}",
            c["reason"] or "accepted",
        )
        for c in candidates
    ]
    return table(_HEAD, rows, numbers=_NUMBERS) if rows else '<p class="none">None.</p>'


def _place(candidate: Mapping[str, Any], side: str) -> str:
    span = candidate[f"span_{side}"]
    when = f", {span[0]:.0f}{DASH}{span[1]:.0f} s" if span else ""
    segment = candidate[f"segment_{side}"]
    part = f" · part {segment + 1}" if segment else ""
    return f"{candidate[side]}{part}{when}"


def _share(value: float | None) -> str:
    return DASH if value is None else f"{100 * value:.0f} %"
