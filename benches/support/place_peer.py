# SPDX-License-Identifier: MIT OR Apache-2.0
"""MapClosures on the pairs of flights that `places.py` compares, in an interpreter that has it.

It gets what it is made for: the whole cloud of a flight as one local map, gravity-aligned and thinned
evenly, at several resolutions of its density map, as its image features need a hundred pixels and
more across. Its transforms are to be refined by a registration: right is what is within `NEAR` and `TURNED`. To know
that it is fed rightly, half of a flight's points are turned and shifted, and are to be found in the other half.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benches.support import tables
from bentwing.base.transform import apply, upright

SETTINGS = ((0.5, 2), (0.25, 2), (0.1, 2), (0.05, 2))
"""Resolution of the density map, m, and voxels along a pixel's edge that keep one point each."""
THRESHOLD = 5
"""Keypoints, of which it wants more by default."""
NEAR, TURNED = 2.0, np.radians(10.0)
"""m, seen from above, in the middle of the flight; rad, about the vertical."""
ELSEWHERE_YAW, ELSEWHERE_SHIFT = 2.0, np.array([40.0, -25.0, 3.0])
SCRIPT = Path(__file__).parents[1] / "peers" / "map_closures_places.py"


@dataclass(slots=True)
class Sort:
    """What was found in one sort of pairs: for each pair and setting inliers, and whether rightly."""

    inliers: list[list[int]] = field(default_factory=list)
    right: list[list[bool]] = field(default_factory=list)


class Peer:
    """MapClosures in a process of its own, and what it has found so far."""

    def __init__(self, python: str) -> None:
        self._process = subprocess.Popen(
            [python, str(SCRIPT)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.sorts: dict[str, Sort] = {}

    def compare(self, sort: str, a, b, T_a_b) -> None:
        """Let it find the cloud `b` in the cloud `a`; `T_a_b` is the truth, None where there is none."""
        with tempfile.NamedTemporaryFile(suffix=".npz") as file:
            np.savez(file, a=a, b=b, settings=np.array(SETTINGS))
            file.flush()
            self._process.stdin.write(f"{file.name}\n")
            self._process.stdin.flush()
            found = json.loads(self._process.stdout.readline())
        one = self.sorts.setdefault(sort, Sort())
        one.inliers.append([inliers for inliers, _ in found])
        middle = np.median(b, axis=0)
        one.right.append([is_right(T, T_a_b, middle) for _, T in found])

    def itself(self, a) -> None:
        """Let it find half of a cloud, turned and shifted, in the other half."""
        T = upright(ELSEWHERE_YAW, ELSEWHERE_SHIFT)
        self.compare("itself, turned", a[::2], apply(T, a[1::2]), np.linalg.inv(T))

    def close(self) -> None:
        self._process.communicate()

    def table(self) -> str:
        """Markdown: found rightly and wrongly, by setting, and at the threshold without false ones."""
        columns = ["MapClosures, density map of"]
        columns += [f"{sort}, right / false" for sort in self.sorts]
        columns += ["right of overlapping at zero false"]
        rows = [columns, ["---"] * len(columns)]
        for k, (resolution, division) in enumerate(SETTINGS):
            name = f"{resolution:g} m, voxels of {resolution / division:g} m"
            rows.append([name, *self._counts(k), self._without_false(k)])
        return "\n".join(tables.line(row) for row in rows)

    def _counts(self, k: int) -> list[str]:
        cells = []
        for one in self.sorts.values():
            said = np.array(one.inliers)[:, k] > THRESHOLD
            right = np.array(one.right)[:, k]
            cells.append(f"{(said & right).sum()} / {(said & ~right).sum()} of {len(said)}")
        return cells

    def _without_false(self, k: int) -> str:
        """Right ones with more inliers than any false one has."""
        inliers = np.concatenate([np.array(s.inliers)[:, k] for s in self.sorts.values()])
        right = np.concatenate([np.array(s.right)[:, k] for s in self.sorts.values()])
        most = max(THRESHOLD, int(inliers[~right].max(initial=0)))
        one = self.sorts.get("overlapping", Sort([[0] * len(SETTINGS)], [[False] * len(SETTINGS)]))
        found = (np.array(one.inliers)[:, k] > most) & np.array(one.right)[:, k]
        return f"{found.sum()} of {len(found)} (more than {most} keypoints)"


def is_right(found, true, middle) -> bool:
    """Whether a transform comes near enough to be refined."""
    if found is None or true is None:
        return False
    T = np.array(found)
    off = (T - true) @ np.append(middle, 1.0)
    turn = np.arctan2(T[1, 0], T[0, 0]) - np.arctan2(true[1, 0], true[0, 0])
    turned = abs((turn + np.pi) % (2 * np.pi) - np.pi)
    return bool(np.hypot(off[0], off[1]) <= NEAR and turned <= TURNED)
