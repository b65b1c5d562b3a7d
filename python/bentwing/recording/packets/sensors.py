# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which decoder reads the packets of a topic; its library is loaded where it is needed."""

from __future__ import annotations

import functools
import importlib
from typing import TYPE_CHECKING, Any, Protocol

from bentwing.base.errors import RecordingError
from bentwing.recording.messages import wire, wire_packets
from bentwing.recording.packets import hesai, ouster, robosense, velodyne
from bentwing.recording.packets.blocks import BlockPackets
from bentwing.recording.topics import (
    HESAI_TYPES,
    ROBOSENSE_TYPES,
    RSLIDAR_PACKET,
    STRING,
    UDP_ROBOSENSE_DEVICE,
    VELODYNE_TYPES,
)

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Callable, Sequence
    from types import ModuleType

    import numpy as np
    from numpy.typing import NDArray

    from bentwing.recording.batches import LidarBatch
    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.sections.lidar import Lidar

OUSTER_VERSION = "0.16.2"  # the newest whose wheels hold nothing but free software


class StampedPackets(Protocol):
    """Packets with the sensor's own stamps, which begin anew after `period_ns`."""

    period_ns: int | None

    def stamp_ns(self, packet: bytes) -> int | None:
        """Return the sensor's time of the first measurement in ns; None for no such packet."""


class LidarPackets(StampedPackets, Protocol):
    """Decoder of one lidar's packets; made anew for every pass over the recording."""

    def fields(self, packet: bytes) -> dict[str, np.dtype[Any]]:
        """Return the fields of its points that a map can carry, with their types."""

    def points(
        self, packets: Sequence[bytes], times: NDArray[np.float64], counts: Counter[str]
    ) -> LidarBatch:
        """Return the returns of consecutive packets, `times` being those of their first ones."""


class ImuPackets(StampedPackets, Protocol):
    """Decoder of the packets of a lidar's IMU."""

    def samples(
        self, packet: bytes
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return ns since the first sample (M,), gyro (M, 3) rad/s and accel (M, 3) m/s²."""


def lidar_packets(
    source: Source, topic: TopicInfo, lidar: Lidar, first: bytes
) -> Callable[..., LidarPackets]:
    """Return a maker of decoders for a lidar's packets, which takes the `attributes` that are wanted.

    Parameters
    ----------
    first : packet of the topic, which may tell the model

    Raises
    ------
    RecordingError, PayloadError
        The library is missing, or the sensor's model or metadata.
    """
    if topic.type in VELODYNE_TYPES:
        library = _velodyne_decoder(topic.name)
        model = velodyne.find_model(first, lidar.model, topic.name)
        return functools.partial(velodyne.VelodynePackets, library, model, first[-1])
    if topic.type in HESAI_TYPES:
        return functools.partial(BlockPackets, hesai.find_model(first, lidar.metadata, topic.name))
    if topic.type in ROBOSENSE_TYPES:
        device = _robosense_device(source, topic)
        table = robosense.find_model(first, device, lidar.model, topic.name)
        return functools.partial(BlockPackets, table)
    core = _ouster_core(topic.name)
    info = _ouster_info(core, source, topic, lidar)
    ouster.check(core, info, first, topic.name)
    return functools.partial(ouster.OusterPackets, core, info)


def imu_packets(source: Source, topic: TopicInfo, lidar: Lidar) -> Callable[[], ImuPackets]:
    """Return a maker of decoders for the packets of an Ouster's IMU; errors as above."""
    core = _ouster_core(topic.name)
    info = _ouster_info(core, source, topic, lidar)
    return functools.partial(ouster.OusterImuPackets, core, info)


def _velodyne_decoder(topic: str) -> ModuleType:
    try:
        return importlib.import_module("velodyne_decoder")
    except ImportError as error:
        msg = (
            f"{topic}: a Velodyne's packets need velodyne-decoder, which cannot be loaded "
            f'({error}); install it with `pip install "bentwing[packets]"`'
        )
        raise RecordingError(msg) from None


def _ouster_core(topic: str) -> ModuleType:
    try:
        return importlib.import_module("ouster.sdk.core")
    except ImportError as error:
        msg = (
            f"{topic}: an Ouster's packets need ouster-sdk, which cannot be loaded ({error}); "
            f"install it with `pip install --no-deps ouster-sdk=={OUSTER_VERSION}`"
        )
        raise RecordingError(msg) from None


def _ouster_info(core: ModuleType, source: Source, topic: TopicInfo, lidar: Lidar) -> Any:  # noqa: ANN401 - not our type
    if lidar.metadata is not None:
        return ouster.sensor_info(core, ouster.read_metadata(lidar.metadata), lidar.metadata)
    namespace = topic.name.rpartition("/")[0]
    names = [
        other.name
        for other in source.topics
        if other.type == STRING and other.name == f"{namespace}/metadata"
    ]
    for name, _, raw in source.messages(names):
        try:
            text = wire_packets.string(raw, cdr=source.cdr)
        except wire.BrokenMessageError:
            continue
        return ouster.sensor_info(core, text, name)
    msg = (
        f"{topic.name}: an Ouster's packets need the metadata of the sensor (angles of its beams), "
        f"which the recording has not as a topic {namespace}/metadata; save them with `curl "
        "http://SENSOR/api/v1/sensor/metadata` and name the file in the payload under "
        "'lidar: {metadata: ...}'"
    )
    raise RecordingError(msg)


def _robosense_device(source: Source, topic: TopicInfo) -> bytes | None:
    """Return the first whole packet about the device that sent a topic, None where there is none."""
    sender = topic.name.rpartition(":")[0]
    names = {
        other.name
        for other in source.topics
        if other.type == UDP_ROBOSENSE_DEVICE and other.name.rpartition(":")[0] == sender
    }
    is_of_driver = topic.type == RSLIDAR_PACKET
    for _, _, raw in source.messages({topic.name} if is_of_driver else names):
        data = raw
        if is_of_driver:
            try:
                is_of_device, data = wire_packets.rslidar_packet(raw, cdr=source.cdr)
            except wire.BrokenMessageError:
                continue
            if not is_of_device:
                continue
        if len(data) == robosense.SIZE and data[:4] == robosense.DEVICE:
            return data
    return None
