# SPDX-License-Identifier: MIT OR Apache-2.0
"""The time of each point of a turning lidar whose clouds have none: from the angle of the rotor.

A cloud begins where its first points lie and goes on in the sense of the turn. What a beam looks aside of
the rotor is taken out where the order of the points shows it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.sweep_stamps import REASONS, SINCE, WORDS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.sections.lidar import TimeReference
    from bentwing.recording.sweep_stamps import Evidence

    Array = NDArray[np.float64]

TURN = 2 * np.pi
MARGIN = np.radians(20)
"""By which noise, and beams that look aside, may lead or lag at the cut."""
N_EDGE = 32
"""Points that tell where a cloud of one group begins and ends."""
EDGE = 0.1
"""Quantile of the groups' first points; many come late, for want of returns."""


@dataclass(frozen=True, slots=True)
class Order:
    """In which order the points of a cloud were measured.

    Attributes
    ----------
    index : (N,) the points, group by group, each group in the order of time
    begins : (G,) where in it each group begins
    """

    index: NDArray[np.intp]
    begins: NDArray[np.intp]

    @classmethod
    def of(cls, groups: NDArray[np.uint16] | None, n: int) -> Order:
        """Return the order of points by their rings, (N,), or of one group."""
        if groups is None:
            return cls(np.arange(n), np.zeros(min(n, 1), np.intp))
        index = np.argsort(groups, kind="stable")
        return cls(index, np.flatnonzero(np.diff(groups[index].astype(np.int64), prepend=-1)))

    @property
    def lengths(self) -> NDArray[np.intp]:
        """Points of each group (G,)."""
        return np.asarray(np.append(self.begins[1:], len(self.index)) - self.begins)

    @property
    def first(self) -> NDArray[np.intp]:
        """The points that were measured when the cloud began."""
        return self.index[:N_EDGE] if len(self.begins) == 1 else self.index[self.begins]

    @property
    def last(self) -> NDArray[np.intp]:
        """The points that were measured when the cloud ended."""
        ends = self.begins + self.lengths - 1
        return self.index[-N_EDGE:] if len(self.begins) == 1 else self.index[ends]


@dataclass(frozen=True, slots=True)
class TurnReading:
    """How the time of a point follows from where the rotor was.

    Attributes
    ----------
    sense : 1 for a turn about the lidar's z axis, counter-clockwise seen from above, or -1
    turn : s, of one turn
    advance : rad, from the beginning of a cloud to that of the next
    cut : rad, in the sense of the turn, where a cloud begins as far as its points do not tell
    reference, evidence : which moment of a cloud its stamp tells, and how that is known
    is_ordered : the order of the points within a ring, or of all without rings, is that of time
    aside : rad, by ring, how far its beam looks ahead of the rotor; none where that is not known
    unseen : rad, around the cut, where nothing returned
    error : s, likely, of the time of a point against others
    """

    sense: int
    turn: float
    advance: float
    cut: float
    reference: TimeReference
    evidence: Evidence
    is_ordered: bool = True
    aside: tuple[float, ...] = ()
    unseen: float = 0.0
    error: float = 0.0

    def __str__(self) -> str:
        way = "counter-clockwise" if self.sense > 0 else "clockwise"
        late = 1e3 * self.unseen / TURN * self.turn
        unsure = "; all may be off by up to {:.0f} ms, as nothing returned where clouds begin"
        shift = unsure.format(late) if late > 1.0 else ""
        return (
            f"time per point made from the azimuth, as the clouds have none: the lidar turns {way} "
            f"seen from above, once in {1e3 * self.turn:.2f} ms; the stamp is taken for that of a "
            f"cloud's {WORDS[self.reference]} ({REASONS[self.evidence]}); likely error "
            f"{1e3 * self.error:.2g} ms{shift}"
        )

    @property
    def first(self) -> float:
        """Of a cloud's first point, s after the stamp."""
        return -SINCE[self.reference] * self.advance / TURN * self.turn

    def offsets(self, points: Array, groups: NDArray[np.uint16] | None) -> Array:
        """Return (N,) s relative to the header stamp.

        Parameters
        ----------
        points : (N, 3) m, lidar frame, in the order of the message
        groups : (N,) the ring of each, or the line of an organized cloud
        """
        ahead = rotor_angles(points, groups, self.sense, self.aside)
        if not len(ahead):
            return np.zeros(0)
        if not self.is_ordered:
            angles = (ahead - self.cut) % TURN
        else:
            order = Order.of(groups, len(ahead))
            angles = since(ahead, order, self._begin(ahead, order))
        return self.first + angles * (self.turn / TURN)

    def _begin(self, ahead: Array, order: Order) -> float:
        """Return where a cloud begins: before its first points, and not a sweep before its last."""
        begin = beginning(ahead[order.first], self.cut)
        least = ending(ahead[order.last], begin + self.advance) - self.advance
        return min(max(self.cut, least), begin) if least <= begin else 0.5 * (least + begin)


def rotor_angles(
    points: Array,
    groups: NDArray[np.uint16] | None,
    sense: int,
    aside: tuple[float, ...] = (),
) -> Array:
    """Return (N,) rad, where the rotor was in the sense of its turn, up to whole turns."""
    angles = sense * np.arctan2(points[:, 1], points[:, 0])
    if not aside or groups is None:
        return np.asarray(angles)
    return np.asarray(angles - np.array(aside)[np.minimum(groups, len(aside) - 1)])


def beginning(firsts: Array, near: float) -> float:
    """Return where a cloud begins, rad, from the angles of its first points and a place near it."""
    return near + float(np.quantile(wrapped(firsts - near), EDGE))


def ending(lasts: Array, near: float) -> float:
    """Return where a cloud ends, rad, in the same way."""
    return near + float(np.quantile(wrapped(lasts - near), 1 - EDGE))


def since(ahead: Array, order: Order, begin: float) -> Array:
    """Return (N,) rad from the beginning of a cloud; beyond a turn the order says on which side."""
    angles = (ahead - begin) % TURN
    sorted_angles = angles[order.index]
    steps = np.diff(sorted_angles, prepend=0.0)
    steps[order.begins] = 0.0
    over = np.cumsum((steps < MARGIN - TURN).astype(np.int64) - (steps > TURN - MARGIN))
    # What most points of a group have in common is the turn of the cloud itself.
    own = over[order.begins + order.lengths // 2]
    sorted_angles += TURN * (over - np.repeat(own, order.lengths))
    angles[order.index] = sorted_angles
    return angles


def wrapped(angles: Array) -> Array:
    """Return angles between -π and π."""
    return np.asarray((angles + np.pi) % TURN - np.pi)
