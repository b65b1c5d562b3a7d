# SPDX-License-Identifier: MIT OR Apache-2.0
"""What closing the loops did, and how well places agree that were seen again."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report.sections import DASH, Row, table
from bentwing.report.texts import ENGLISH

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.evaluate.revisits import Revisits
    from bentwing.evaluate.thickness import Thickness
    from bentwing.report.texts import Texts

_SPAN = 20.0  # s, of the flight that are one side of a loop
_SHOWN = 12  # loops in the table, those with most patches
_FEWEST = 5  # patches that make a loop
_WALLS = 2.0  # thicknesses of a wall that both sides may be apart


def consistency_table(
    walls: Thickness | None, revisits: Revisits | None, texts: Texts = ENGLISH
) -> str:
    """Make the table of how well the map agrees with itself."""
    rows: list[Row] = []
    if walls is not None:
        for name, which in (
            ("thickness of flat surfaces, first visits, one standard deviation", ~walls.is_later),
            ("thickness of flat surfaces, later visits, one standard deviation", walls.is_later),
        ):
            if np.count_nonzero(which) >= _FEWEST:
                rows.append(_thickness(texts.phrase(name), walls, which, texts))
    if revisits is not None:
        rest = texts.phrase(
            "95 % below {p95:.1f} mm, {n:,} patches", p95=1e3 * revisits.p95, n=revisits.n_patches
        )
        name = texts.phrase("offset between two visits, standard deviation")
        rows.append((name, f"{texts.number(1e3 * revisits.std, '.1f')} mm", rest))
    head = tuple(texts.phrase(name) for name in ("measure", "median", "spread"))
    return table(head, rows, numbers=frozenset({1}))


def _thickness(name: str, walls: Thickness, which: NDArray[np.bool_], texts: Texts) -> Row:
    p25, median, p75 = (1e3 * np.percentile(walls.stds[which], [25, 50, 75])).tolist()
    spread = texts.phrase(
        "middle half {p25:.1f} to {p75:.1f} mm, {n:,} patches of {edge:g} m",
        p25=p25,
        p75=p75,
        n=int(np.count_nonzero(which)),
        edge=walls.edge,
    )
    return name, f"{texts.number(median, '.1f')} mm", spread


def closing_table(record: Mapping[str, Any] | None, *, asked: bool) -> str:
    """Make the table of the global registration: what was matched, and what it moved."""
    if not record:
        why = "Not recorded." if asked else "Loop closure was off: the map is open-loop."
        return f'<p class="none">{why}</p>'
    verdict = "accepted" if record.get("applied") else f"rejected: {record.get('reason')}"
    rows: list[Row] = [("correction of the whole trajectory", verdict)]
    if "n_revisits" in record:
        rows += [
            ("pairs of stretches that saw the same", f"{record['n_stretch_pairs']:,}"),
            ("of these seen again later", f"{record['n_revisits']:,}"),
            ("matches that agree at the end", f"{100 * record['inlier_share']:.1f} %"),
            ("their distance, as a multiple of the expected noise of one point", f"{record['residual_rms']:.2f}"),
            ("largest correction", f"{1e3 * record['largest_translation']:.1f} mm, "
             f"{np.degrees(record['largest_rotation']):.3f}°"),
        ]  # fmt: skip
    rows += [(_named(one), str(one["said"])) for one in record.get("named") or []]
    rows += [
        (f"iteration {i + 1}", f"{step['n_far_matches']:,} matches between visits, moved "
         f"{1e3 * step['translation']:.2f} mm")
        for i, step in enumerate(record.get("iterations") or [])
    ]  # fmt: skip
    return table(("closing the loops", ""), rows, numbers=frozenset({1}))


def _named(loop: Mapping[str, Any]) -> str:
    """Say which loop this is that a user has named."""
    first, second = loop["times"]
    what = "the same place" if loop["same"] else "not the same place"
    return f"named as {what}: {first:g} s and {second:g} s"


def revisits_table(
    revisits: Revisits | None, thickness: float | None, texts: Texts = ENGLISH
) -> str:
    """Make the table of loops: which stretches saw the same, and how far apart they have it.

    A loop is accepted whose sides lie within two thicknesses of a wall of each other.
    """
    if revisits is None:
        return f'<p class="none">{texts.phrase("No flat surface was seen in two visits.")}</p>'
    limit = max(_WALLS * (thickness or 0.0), 1e-3)
    loops = _loops(revisits)
    rows = [
        (
            f"{a:.0f} {DASH} {a + _SPAN:.0f} s",
            f"{b:.0f} {DASH} {b + _SPAN:.0f} s",
            texts.number(len(offsets), ","),
            f"{texts.number(1e3 * float(np.median(np.abs(offsets))), '.1f')} mm",
            f"{texts.number(1e3 * float(np.percentile(np.abs(offsets), 95)), '.1f')} mm",
            texts.phrase(
                "agrees" if float(np.median(np.abs(offsets))) <= limit else "does not agree"
            ),
        )
        for a, b, offsets in loops[:_SHOWN]
    ]
    if not rows:
        return f'<p class="none">{texts.phrase("No two stretches share enough flat surface.")}</p>'
    n_good = sum(float(np.median(np.abs(o))) <= limit for _, _, o in loops)
    head = (
        *map(texts.phrase, ("seen at", "seen again at", "patches", "median offset")),
        "95 %",
        texts.phrase("within {limit:.0f} mm", limit=1e3 * limit),
    )
    said = texts.phrase(
        "{good} of {n} loops agree; those with most patches are listed.", good=n_good, n=len(loops)
    )
    note = f'<p class="none">{escape(said)}</p>'
    return table(head, rows, numbers=frozenset({0, 1, 2, 3, 4})) + note


def _loops(revisits: Revisits) -> list[tuple[float, float, NDArray[np.float64]]]:
    """Begin of the earlier stretch, begin of the later one, and offsets; most patches first."""
    later = np.floor(revisits.middles / _SPAN)
    earlier = np.floor((revisits.middles - revisits.intervals) / _SPAN)
    pairs, member = np.unique(np.stack([earlier, later], axis=1), axis=0, return_inverse=True)
    order = np.argsort(member.ravel(), kind="stable")
    cuts = np.searchsorted(member.ravel()[order], np.arange(1, len(pairs)))
    groups = np.split(revisits.offsets[order], cuts)
    loops = [
        (_SPAN * float(a), _SPAN * float(b), offsets)
        for (a, b), offsets in zip(pairs, groups, strict=True)
        if len(offsets) >= _FEWEST and b > a
    ]
    return sorted(loops, key=lambda loop: -len(loop[2]))
