# SPDX-License-Identifier: MIT OR Apache-2.0
"""Packets of turning lidars that consist of blocks, decoded by a table of the model.

A block has the azimuth of the rotor and, of each channel, range and intensity. The table of a model says
how its packets are laid out, and where and when each channel looks. `hesai` and `robosense` have the tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.value import Value
from bentwing.recording.attributes import NO_ATTRIBUTES
from bentwing.recording.batches import LidarBatch

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bentwing.recording.attributes import Attributes

TURN = 36000  # hundredths of a degree
MAX_STEP = 200  # between firings; 20 turns per second of the slowest block are 120
US = 1e-6
BEGIN = 0xEEFF  # of a block: FF EE as a little-endian number
DATE = [(name, "u1") for name in ("year", "month", "day", "hour", "minute", "second")]


@dataclass(frozen=True, slots=True, eq=False)
class BlockModel(Value):
    """How a model's packets are laid out, and where and when its channels look.

    Attributes
    ----------
    name : of the model
    layout : of a packet; `blocks` have `azimuth` (0.01°, clockwise from above) and `channels` with
        `distance` and `intensity`, and may have `begin`
    sizes : of packets, bytes; what is behind the layout does not matter
    unit : m per count of the distance
    block_us : from the beginning of a firing to that of the next
    firing_us : (C,) of each channel after the moment of its block's azimuth; may be negative
    elevations, azimuths : (C,) degrees; azimuths clockwise from above, added to the rotor's
    rings : (C,) number of each channel in the points
    ahead : which axis of the points the azimuth 0 is on; the frame is that of the maker's driver
    lens : m, from the axis to where the rays begin
    stamp_us : of a packet, the sensor's time of its first firing; None for no such packet
    n_returns : of a packet, how many blocks behind each other are of the same firing
    returns_in_block : how many returns of all C channels a block has, one behind the other
    blocks_of_return : how many blocks behind each other have the C channels of a return
    range_bits : of a distance; those above are flags
    height : m, of where the rays begin
    """

    name: str
    layout: np.dtype[np.void]
    sizes: tuple[int, ...]
    unit: float
    block_us: float
    firing_us: NDArray[np.float64]
    elevations: NDArray[np.float64]
    azimuths: NDArray[np.float64]
    rings: NDArray[np.uint16]
    ahead: str
    lens: float
    stamp_us: Callable[[np.void], float | None]
    n_returns: Callable[[np.void], int]
    returns_in_block: int = 1
    blocks_of_return: int = 1
    range_bits: int = 0xFFFF
    height: float = 0.0


class BlockPackets:
    """The packets of one lidar in their order."""

    period_ns: int | None = None

    def __init__(
        self,
        model: BlockModel,
        *,
        attributes: Attributes = NO_ATTRIBUTES,  # noqa: ARG002 - there are none, see `fields`
    ) -> None:
        self._model = model

    def fields(self, packet: bytes) -> dict[str, np.dtype[Any]]:  # noqa: ARG002 - of no packet
        """Return the further fields that a map can carry: none."""
        return {}

    def stamp_ns(self, packet: bytes) -> int | None:
        """Return the sensor's time of the first firing in ns; None for no such packet."""
        model = self._model
        if len(packet) not in model.sizes:
            return None
        one = np.frombuffer(packet, model.layout, 1)[0]
        blocks = one["blocks"]
        if (blocks["azimuth"] >= TURN).any():
            return None
        if "begin" in (blocks.dtype.names or ()) and (blocks["begin"] != BEGIN).any():
            return None
        found = model.stamp_us(one)
        return None if found is None else round(found * 1000)

    def points(
        self, packets: Sequence[bytes], times: NDArray[np.float64], counts: Counter[str]
    ) -> LidarBatch:
        """Return the returns of consecutive packets, of two of a firing the stronger.

        Parameters
        ----------
        times : (N,) s, of each packet's first firing
        counts : receives `returns` (all firings of a channel) and `zero` (those without a return)
        """
        layout = self._model.layout
        table = np.frombuffer(b"".join(one[: layout.itemsize] for one in packets), layout)
        n_returns = np.array([self._model.n_returns(one) for one in table])
        found = [
            self._of_mode(table["blocks"][n_returns == n], times[n_returns == n], n, counts)
            for n in np.unique(n_returns).tolist()
        ]
        batch = LidarBatch.joined(found)
        return batch.where(np.argsort(batch.times, kind="stable"))

    def _of_mode(
        self,
        blocks: NDArray[np.void],
        times: NDArray[np.float64],
        n_returns: int,
        counts: Counter[str],
    ) -> LidarBatch:
        """Return the returns of packets (N, B) that have `n_returns` blocks of each firing."""
        model = self._model
        n, n_blocks = blocks.shape
        n_all = n_returns * model.returns_in_block
        n_together = n_returns * model.blocks_of_return
        per_firing = blocks["channels"].reshape(n, n_blocks // n_together, n_all, -1)
        ranges, intensities = _strongest(
            per_firing["distance"] & np.uint16(model.range_bits), per_firing["intensity"]
        )
        rotor = blocks["azimuth"][:, ::n_together].astype(np.float64)
        starts, steps = _firings(rotor, model.block_us)
        shifts = steps[:, None, None] * (model.firing_us / model.block_us)
        angles = np.radians((rotor[:, :, None] + shifts) / 100)
        points = self._points(ranges * model.unit, angles)
        firing = starts[:, :, None] + (model.firing_us - model.firing_us.min())
        stamps = times[:, None, None] + firing * US
        keep = ranges.ravel() > 0
        counts["returns"] += keep.size
        counts["zero"] += int((~keep).sum())
        return LidarBatch(
            points.reshape(-1, 3),
            stamps.ravel(),
            intensities.astype(np.float32).ravel(),
            np.broadcast_to(model.rings, ranges.shape).ravel().astype(np.uint16),
        ).where(keep)

    def _points(
        self, ranges: NDArray[np.float64], angles: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the points (…, 3) of ranges at angles of the rotor, rad clockwise."""
        model = self._model
        elevations = np.radians(model.elevations)
        looks = angles + np.radians(model.azimuths)
        level = ranges * np.cos(elevations)
        ahead = level * np.cos(looks) + model.lens * np.cos(angles)
        right = level * np.sin(looks) + model.lens * np.sin(angles)
        up = ranges * np.sin(elevations) + model.height
        axes = (ahead, -right, up) if model.ahead == "x" else (right, ahead, up)
        return np.stack(axes, axis=-1)


def _strongest(
    distances: NDArray[np.uint16], intensities: NDArray[np.uint8]
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Return distance and intensity of the stronger return, axis 2 being the returns of a firing."""
    if distances.shape[2] == 1:
        return distances[:, :, 0].astype(np.float64), intensities[:, :, 0]
    strength = np.where(distances > 0, intensities.astype(np.int64) + 1, 0)
    best = strength.argmax(axis=2, keepdims=True)
    distance = np.take_along_axis(distances, best, axis=2)[:, :, 0]
    return distance.astype(np.float64), np.take_along_axis(intensities, best, axis=2)[:, :, 0]


def _firings(
    rotor: NDArray[np.float64], block_us: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the beginnings (N, F) of firings in µs after the first, and the turn (N,) between them.

    Parameters
    ----------
    rotor : (N, F) hundredths of a degree; it jumps over a sector that the sensor leaves out
    """
    if rotor.shape[1] == 1:
        return np.zeros_like(rotor), np.zeros(len(rotor))
    turned = np.diff(rotor, axis=1) % TURN
    steps = np.median(turned, axis=1)
    steps[steps > MAX_STEP] = 0.0
    is_jump = (turned > MAX_STEP) & (steps > 0)[:, None]
    ratio = np.divide(turned, steps[:, None], out=np.ones_like(turned), where=is_jump)
    starts = np.zeros_like(rotor)
    np.cumsum(ratio * block_us, axis=1, out=starts[:, 1:])
    return starts, steps
