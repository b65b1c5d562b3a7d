# SPDX-License-Identifier: MIT OR Apache-2.0
"""Velodyne's packets → points, decoded by velodyne-decoder.

The frame is the ROS driver's: x forward, y left, z up. Of two returns of one firing the strongest
is kept.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.recording.attributes import NO_ATTRIBUTES, selectable
from bentwing.recording.batches import LidarBatch
from bentwing.recording.messages.wire_packets import VELODYNE_SIZE

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Sequence
    from types import ModuleType

    from numpy.typing import NDArray

    from bentwing.recording.attributes import Attributes
    from bentwing.recording.lidar_kinds import PacketModel, VelodyneModel

HOUR_NS = 3_600_000_000_000
FLAG, LOWER_FLAG = b"\xff\xee", b"\xff\xdd"  # of a block of firings
SINGLE_RETURN, DUAL_RETURN = 0x37, 0x39
STRONGEST = 1  # bit of the decoder's return_type
MAX_RANGE = 1e6  # m; the usable ranges are the payload's


class Model(NamedTuple):
    """Model by the number in its packets and its name in the decoder."""

    number: int
    name: str


MODELS: dict[VelodyneModel, Model] = {
    "hdl32e": Model(0x21, "HDL32E"),
    "vlp16": Model(0x22, "VLP16"),
    "vlp32a": Model(0x23, "VLP32A"),
    "vlp32b": Model(0x23, "VLP32B"),
    "puck-hires": Model(0x24, "PuckHiRes"),
    "vlp32c": Model(0x28, "VLP32C"),
    "vls128": Model(0xA1, "VLS128"),
}


def find_model(packet: bytes, told: PacketModel | None, topic: str) -> VelodyneModel:
    """Return the model that sent a packet.

    Parameters
    ----------
    told : by the payload, for packets that do not tell
    topic : for messages

    Raises
    ------
    RecordingError
        The packet does not tell and the payload neither, they disagree, or the model is none that
        can be read.
    """
    if packet[100:102] == LOWER_FLAG and packet[200:202] == FLAG:
        msg = (
            f"{topic}: packets of an HDL-64E, which need the calibration of that one sensor; let "
            "its ROS driver make clouds (PointCloud2 with a time per point) of them"
        )
        raise RecordingError(msg)
    if len(packet) != VELODYNE_SIZE:
        msg = (
            f"{topic}: packets of {len(packet)} bytes, where those of a Velodyne have {VELODYNE_SIZE}; "
            "record them whole"
        )
        raise RecordingError(msg)
    number = packet[-1]
    fitting = [name for name, model in MODELS.items() if model.number == number]
    for name in fitting or MODELS:
        if name == told:
            return name
    if told is None and len(fitting) == 1:
        return fitting[0]
    choice = ", ".join(fitting or MODELS)
    found = f"packets of model number 0x{number:02x} ({' or '.join(fitting) or 'unknown'})"
    if told is not None:
        msg = f"{topic}: {found}, but the payload says 'model: {told}'; remove it there"
    else:
        msg = f"{topic}: {found}; say which in the payload under 'lidar: {{model: ...}}' ({choice})"
    raise RecordingError(msg)


class VelodynePackets:
    """The packets of one Velodyne in their order.

    Parameters
    ----------
    decoder : the library
    model : the sensor's
    sent : number of the model in the packets, which the HDL-32E gives since 2016 only
    attributes : further fields that are wanted, see `fields`
    """

    period_ns: int | None = HOUR_NS

    def __init__(
        self,
        decoder: ModuleType,
        model: VelodyneModel,
        sent: int,
        *,
        attributes: Attributes = NO_ATTRIBUTES,
    ) -> None:
        self._library = decoder
        self._number, self._sent = MODELS[model].number, sent
        self._is_alpha = model == "vls128"
        config = decoder.Config(
            model=getattr(decoder.Model, MODELS[model].name),
            min_range=0.0,
            max_range=MAX_RANGE,
            timestamp_first_packet=True,
        )
        self._decoder = decoder.ScanDecoder(config)
        self._attributes = attributes

    def fields(self, packet: bytes) -> dict[str, np.dtype[Any]]:
        """Return the fields beside the coordinates."""
        dtype = self._table([packet], np.zeros(1)).dtype
        return selectable({n: dtype[n] for n in dtype.names or () if n not in {*"xyz"}})

    def stamp_ns(self, packet: bytes) -> int | None:
        """Return ns since the top of the hour of the first firing; None for no such packet."""
        if len(packet) != VELODYNE_SIZE or packet[:2] != FLAG:
            return None
        if packet[-1] != self._sent:
            return None
        (microseconds,) = struct.unpack_from("<I", packet, VELODYNE_SIZE - 6)
        stamp_ns = int(microseconds) * 1000
        return stamp_ns if stamp_ns <= HOUR_NS else None

    def points(
        self, packets: Sequence[bytes], times: NDArray[np.float64], counts: Counter[str]
    ) -> LidarBatch:
        """Return the returns of consecutive packets.

        Parameters
        ----------
        times : (N,) s, of each packet's first firing
        counts : receives `returns` (all firings of a laser) and `zero` (those without a return)
        """
        table = self._table(packets, times)
        table = table[(table["return_type"] & STRONGEST) != 0]
        n_fired = sum(map(self._n_fired, packets))
        counts["returns"] += n_fired
        counts["zero"] += n_fired - len(table)
        points = np.column_stack([table[axis] for axis in "xyz"]).astype(np.float64)
        batch = LidarBatch(
            points,
            times[0] + table["time"].astype(np.float64),
            table["intensity"].astype(np.float32),
            table["ring"].astype(np.uint16),
            attributes=self._attributes.gathered(len(table), table.__getitem__),
        )
        return batch.where(np.argsort(batch.times, kind="stable"))

    def _table(self, packets: Sequence[bytes], times: NDArray[np.float64]) -> NDArray[np.void]:
        """Decode consecutive packets."""
        library = self._library
        pair = library.velodyne_decoder_pylib.TimePair
        vector = library.PacketVector()
        for packet, t in zip(packets, (times - times[0]).tolist(), strict=True):
            vector.append(library.VelodynePacket(pair(t, t), self._normal(packet)))
        table: NDArray[np.void] = self._decoder.decode(vector, as_pcl_structs=True)[1]
        return table

    def _normal(self, packet: bytes) -> bytes:
        """Return the packet with the model's number, and its one return called the strongest.

        The decoder's result is undefined for the zeros of firmware from before dual returns, and the
        last return is the only one where the sensor was told to send that.
        """
        returns = DUAL_RETURN if packet[-2] == DUAL_RETURN else SINGLE_RETURN
        return packet[:-2] + bytes([returns, self._number])

    def _n_fired(self, packet: bytes) -> int:
        """Return how many lasers fired: 12 blocks of 32, in pairs where there are two returns."""
        if packet[-2] != DUAL_RETURN:
            return 384
        return 128 if self._is_alpha else 192
