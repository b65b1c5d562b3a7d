# SPDX-License-Identifier: MIT OR Apache-2.0
"""The way from one frame to another over links that are fixed, in either direction, and the pose along it."""

from __future__ import annotations

import difflib
import itertools
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.base import geometry, transform

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

QUATERNION_TOLERANCE = 1e-3  # rounding to three digits is repaired, anything worse is refused
DIGITS = 12  # of m and of a unit quaternion
MAX_LISTED = 20  # frames in a sentence


class Link(NamedTuple):
    """The pose of one frame in another: it takes coordinates in `child` to coordinates in `parent`.

    Attributes
    ----------
    parent, child : frames, without the slash in front that the first tf had
    translation : m
    quaternion : x y z w, as sent
    """

    parent: str
    child: str
    translation: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def chain(links: Iterable[Link], parent: str, child: str) -> list[str] | None:
    """Return the shortest way between two frames over links in either direction, None without one."""
    beside: dict[str, list[str]] = {}
    for link in links:
        beside.setdefault(link.parent, []).append(link.child)
        beside.setdefault(link.child, []).append(link.parent)
    if parent not in beside or child not in beside:
        return None
    before, waiting = {child: child}, deque([child])
    while waiting and parent not in before:
        here = waiting.popleft()
        for there in beside[here]:
            if there not in before:
                before[there] = here
                waiting.append(there)
    if parent not in before:
        return None
    way = [parent]
    while way[-1] != child:
        way.append(before[way[-1]])
    return way


def along(links: Mapping[str, Link], way: Sequence[str]) -> dict[str, list[float]]:
    """Return translation, m, and quaternion, x y z w, of the last frame of a way in the first.

    Parameters
    ----------
    links : by child

    Raises
    ------
    ValueError
        A link is no rigid transform.
    """
    T = np.eye(4)
    for here, there in itertools.pairwise(way):
        link = links.get(there)
        if link is not None and link.parent == here:
            T = T @ matrix(link)
        else:
            T = T @ transform.inverse(matrix(links[here]))
    parts = {"translation": T[:3, 3], "quaternion": geometry.from_matrices(T[:3, :3])}
    # The last digits are of the way through other frames; adding zero leaves no minus zero.
    return {name: (np.round(part, DIGITS) + 0.0).tolist() for name, part in parts.items()}


def matrix(link: Link) -> NDArray[np.float64]:
    """Return the (4, 4) that takes coordinates in the child to the parent.

    Raises
    ------
    ValueError
        It is no rigid transform.
    """
    t, quat = np.array(link.translation), np.array(link.quaternion)
    norm = np.linalg.norm(quat)
    if not (abs(norm - 1.0) <= QUATERNION_TOLERANCE and np.isfinite(t).all()):
        msg = (
            f"the transform from {link.parent} to {link.child} is none: its quaternion has norm "
            f"{norm:.4g}, its translation is {list(link.translation)}"
        )
        raise ValueError(msg)
    return transform.rigid(geometry.to_matrices(quat / norm), t)


def listed(known: Sequence[str], wanted: str, owner: str) -> str:
    """Return the words on what frames there are, the one nearest to the wanted first."""
    near = difflib.get_close_matches(wanted, known, n=1)
    guess = f"did you mean {near[0]}? " if near else ""
    more = f" and {len(known) - MAX_LISTED} more" if len(known) > MAX_LISTED else ""
    return f"{guess}{owner} has {', '.join(known[:MAX_LISTED])}{more}"
