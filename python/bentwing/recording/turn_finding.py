# SPDX-License-Identifier: MIT OR Apache-2.0
"""Find from the first clouds how a lidar turns: which way, how fast, and where its clouds begin."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.recording.turn_times import (
    EDGE,
    MARGIN,
    TURN,
    Order,
    TurnReading,
    beginning,
    rotor_angles,
    since,
    wrapped,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording.sweep_stamps import SweepStamps

    Array = NDArray[np.float64]

FEWEST_POINTS = 200
"""Of a cloud that tells anything."""
SMALL = np.radians(20)
"""A step from point to point; a larger one passes over what gave no return."""
ORDERED = 0.9
"""Share of the way that has to go one way round."""
N_BLOCKS = 90
"""Of a cloud, each with points of many beams at nearly one time."""
MAX_TILT = np.radians(1.5)
"""By which the elevation of a beam may vary along its turn, half of it by less."""
LEAST_COVER = 0.45
"""Share of the turn that some point lies in; a lidar that does not turn sees less."""
N_SECTORS, N_FINE = 72, 20
MAX_ADVANCE = 1.5 * TURN
STEADY = np.radians(1.0)
"""Within which the cuts of all clouds may lie to be one."""
QUARTER = TURN / 4
LEAST_ASIDE = np.radians(0.5)
"""By which beams look aside if they do; less is what the time within a firing is."""
USUAL_ASIDE = np.radians(2.0)
"""By which beams may look aside where nothing tells; 3.2° of an Ouster's, up to 8° of a HDL-64E's."""
PERIODS = 0.01, 1.0
"""s, of clouds that one turn can last."""
FLOOR = 5e-5
"""s, of the likely error: what the time within a firing is."""


class Sweep(NamedTuple):
    """Valid points of a cloud (N, 3), m, lidar frame, in its order, and the ring or line of each."""

    points: Array
    groups: NDArray[np.uint16] | None


class _Way(NamedTuple):
    sense: int
    is_ordered: bool


def find_turn(sweeps: Sequence[Sweep], stamps: SweepStamps) -> TurnReading | str:
    """Return how points get their times, or why they cannot.

    Parameters
    ----------
    sweeps : consecutive clouds
    stamps : of these and more
    """
    usable = [sweep for sweep in sweeps if len(sweep.points) >= FEWEST_POINTS]
    period = stamps.period
    if len(usable) < 2 or period is None or not PERIODS[0] <= period <= PERIODS[1]:
        return "there are too few clouds at a steady rate"
    if _tilt(usable) > MAX_TILT:
        return (
            "the rings are no cones about the z axis, so the clouds are not in the lidar's own frame or "
            "were corrected for motion already"
        )
    way = _way(usable)
    if way is None:
        return "the order of the points does not follow the turn of a lidar"
    known = _aside(usable, way.sense)
    aside = known or ()
    turned = [rotor_angles(*sweep, way.sense, aside) for sweep in usable]
    cover = _cover(turned)
    if cover < LEAST_COVER:
        return f"the clouds cover {cover:.0%} of a turn only"
    begins, ends = _ends(usable, turned, way)
    advances = _advance(begins, ends)
    advance = float(np.median(advances))
    if not MARGIN < advance <= MAX_ADVANCE:
        return "a cloud is less than a part of a turn, or much more than one"
    if float(np.median(np.abs(advances - advance))) > MARGIN:
        return "the clouds do not follow each other in the turn"
    reference, evidence = stamps.meaning(period)
    turn = period * TURN / advance
    unknown = USUAL_ASIDE * turn / TURN if known is None else 0.0
    return TurnReading(
        way.sense,
        turn,
        advance,
        cut=_cut(begins, ends, advance),
        reference=reference,
        evidence=evidence,
        is_ordered=way.is_ordered,
        aside=aside,
        unseen=max(0.0, advance - float(np.median(ends - begins))),
        error=float(np.hypot(unknown, _error(advances, stamps, period))),
    )


def _tilt(sweeps: Sequence[Sweep]) -> float:
    """Return how much the elevation of a beam varies along its turn, rad; 0 without rings."""
    spreads = []
    for sweep in sweeps:
        if sweep.groups is None:
            return 0.0
        x, y, z = sweep.points.T
        elevations = np.arctan2(z, np.hypot(x, y))
        order = Order.of(sweep.groups, len(elevations))
        parts = np.split(elevations[order.index], order.begins[1:])
        spreads += [np.subtract(*np.quantile(part, [0.75, 0.25])) for part in parts]
    return float(np.median(spreads))


def _way(sweeps: Sequence[Sweep]) -> _Way | None:
    """Return which way the points go round, and whether their order is that of time."""
    angles = [rotor_angles(*sweep, sense=1) for sweep in sweeps]
    if sweeps[0].groups is not None:
        orders = [Order.of(sweep.groups, len(sweep.points)) for sweep in sweeps]
        way = _share(np.concatenate([_steps(*pair) for pair in zip(angles, orders, strict=True)]))
        return _Way(_sign(way), is_ordered=True) if abs(way) >= ORDERED else None
    blocks = [found for found in map(_blocks, angles) if found is not None]
    if len(blocks) == len(angles):
        way = _share(np.concatenate([wrapped(np.diff(found)) for found in blocks]))
        return _Way(_sign(way), is_ordered=True)
    way = _share(np.concatenate([wrapped(np.diff(each)) for each in angles]))
    return _Way(_sign(way), is_ordered=False) if abs(way) >= ORDERED else None


def _sign(way: float) -> int:
    return 1 if way > 0 else -1


def _steps(angles: Array, order: Order) -> Array:
    """Return the steps from point to point within the groups."""
    steps = wrapped(np.diff(angles[order.index]))
    return np.delete(steps, order.begins[1:] - 1)


def _share(steps: Array) -> float:
    """Return which share of the way goes round one way, with its sign."""
    small = steps[np.abs(steps) < SMALL]
    way = float(np.abs(small).sum())
    return float(small.sum()) / way if way > 0.0 else 0.0


def _blocks(angles: Array) -> Array | None:
    """Return where the rotor was block by block; None where the points do not follow it."""
    parts = np.array_split(np.exp(1j * angles), N_BLOCKS)
    means = np.array([part.mean() for part in parts])
    found = np.angle(means)
    is_close = (np.abs(means) > ORDERED).mean() > ORDERED
    return found if is_close and abs(_share(wrapped(np.diff(found)))) >= ORDERED else None


def _aside(sweeps: Sequence[Sweep], sense: int) -> tuple[float, ...] | None:
    """Return how far the beam of each ring looks ahead of the rotor; None where nothing tells."""
    aside: tuple[float, ...] = ()
    for _ in range(2):  # what is aside moves the means of blocks that lack a ring
        left = [_left_of(sweep, sense, aside) for sweep in sweeps]
        if any(each is None for each in left):
            return None
        rings, angles = (np.concatenate(parts) for parts in zip(*filter(None, left), strict=True))
        order = Order.of(rings, len(rings))
        parts = np.split(angles[order.index], order.begins[1:])
        found = np.zeros(int(rings.max()) + 1)
        found[rings[order.first]] = [np.median(part) for part in parts]
        before = np.zeros(len(found))
        before[: len(aside)] = aside
        aside = tuple((before + found).tolist())
    return aside if np.abs(aside).max() > LEAST_ASIDE else ()


def _left_of(
    sweep: Sweep,
    sense: int,
    aside: tuple[float, ...],
) -> tuple[NDArray[np.uint16], Array] | None:
    """Return rings and what the angles of points are off the rotor, which points around them tell."""
    angles = rotor_angles(*sweep, sense, aside)
    blocks = _blocks(angles)
    if blocks is None or sweep.groups is None:
        return None
    centres = (np.arange(N_BLOCKS) + 0.5) * (len(angles) / N_BLOCKS)
    inner = np.arange(int(centres[0]) + 1, int(centres[-1]))
    rotor = np.interp(inner, centres, np.unwrap(blocks))
    return sweep.groups[inner], wrapped(angles[inner] - rotor)


def _cover(turned: Sequence[Array]) -> float:
    """Return in which share of the turn there are points."""
    sectors = ((np.concatenate(turned) % TURN) * (N_SECTORS / TURN)).astype(int)
    return len(np.unique(sectors)) / N_SECTORS


def _ends(sweeps: Sequence[Sweep], turned: Sequence[Array], way: _Way) -> tuple[Array, Array]:
    """Return where each cloud begins and ends, rad, the ends beyond the beginnings."""
    begins, ends = [], []
    orders = [Order.of(sweep.groups, len(sweep.points)) for sweep in sweeps]
    for sweep, ahead, order in zip(sweeps, turned, orders, strict=True):
        if not way.is_ordered:
            begins.append(_seam(sweep.points, ahead))
            ends.append(begins[-1] + TURN)
            continue
        firsts = ahead[order.first]
        begin = beginning(firsts, float(np.angle(np.exp(1j * firsts).mean())))
        angles = since(ahead, order, begin)
        begins.append(begin)
        ends.append(begin + float(np.quantile(angles[order.last], 1 - EDGE)))
    return np.array(begins), np.array(ends)


def _seam(points: Array, ahead: Array) -> float:
    """Return where the rings begin of a cloud that has them one after the other, rad.

    Between two passes of the right place there is one ring, so one elevation.
    """
    x, y, z = points.T
    elevations = np.arctan2(z, np.hypot(x, y))

    def spread(place: float) -> float:
        ring = np.cumsum(np.diff((ahead - place) % TURN, prepend=0.0) < -np.pi)
        n, total, squares = (
            np.bincount(ring, weights) for weights in (None, elevations, elevations**2)
        )
        return float((squares - total**2 / np.maximum(n, 1)).sum())

    coarse = min(np.arange(N_SECTORS) * (TURN / N_SECTORS), key=spread)
    fine = coarse + np.linspace(-1.0, 1.0, 2 * N_FINE + 1) * (TURN / N_SECTORS)
    return float(min(fine, key=spread))


def _advance(begins: Array, ends: Array) -> Array:
    """Return how far the rotor went from each cloud to the next, rad."""
    least = float(np.median(ends - begins)) - MARGIN
    one = begins[0]
    starts, lasts = wrapped(begins - one), wrapped(ends - one)
    if lasts.max() < starts.min() + STEADY and least > 0.5 * TURN:
        return np.full(len(begins) - 1, TURN)
    return np.asarray(least + (np.diff(begins) - least) % TURN)


def _cut(begins: Array, ends: Array, advance: float) -> float:
    """Return where clouds begin, rad, as far as their points do not tell.

    It is no later than any beginning, and no earlier than a cloud before any end. Where that leaves a
    part of the turn, from which nothing returned, drivers cut at a quarter of the turn, most of them.
    """
    late = float(begins[0] + wrapped(begins - begins[0]).min())
    early = late + float(wrapped(ends - advance - late).max())
    if late - early < STEADY:
        return late
    middle = 0.5 * (early + late)
    quarter = np.rint(middle / QUARTER) * QUARTER
    return float(quarter) if early <= quarter <= late else middle


def _error(advances: Array, stamps: SweepStamps, period: float) -> float:
    """Return what turns and stamps do not agree in, s, one standard deviation."""
    steps = np.diff(stamps.stamps[: len(advances) + 1])
    left = steps - advances * (period / np.median(advances))
    left -= period * np.rint(left / period)  # of clouds that were lost
    deviation = 1.4826 * float(np.median(np.abs(left - np.median(left))))
    return max(FLOOR, deviation / 2**0.5)
