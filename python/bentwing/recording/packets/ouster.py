# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ouster's packets → points and inertial samples, decoded by ouster-sdk.

The frames are the ROS driver's: points in `os_lidar` (x towards the connector, z up), the IMU in
`os_imu`. Of two returns of one firing the first is kept, which is the strongest unless the sensor
was told otherwise.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bentwing.base.errors import PayloadError, RecordingError
from bentwing.base.regular_file import require_regular
from bentwing.recording.attributes import NO_ATTRIBUTES, selectable
from bentwing.recording.batches import LidarBatch

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Sequence
    from types import ModuleType

    from numpy.typing import NDArray

    from bentwing.recording.attributes import Attributes

_MOST_OF_METADATA = 2**24  # bytes
IS_VALID = 1  # bit of a column's status
MAX_OFFSET_NS = 1_000_000_000  # of a column from its packet; more is damage
INTENSITIES = ("SIGNAL", "REFLECTIVITY")  # the first that the profile has, as the ROS driver


def sensor_info(core: ModuleType, text: str, origin: str) -> Any:  # noqa: ANN401 - not our type
    """Return the sensor's description from its metadata (JSON).

    Parameters
    ----------
    origin : where the text is from, for messages

    Raises
    ------
    RecordingError
        It is none.
    """
    try:
        return core.SensorInfo(text)
    # The SDK raises RuntimeError and ValueError with several lines.
    except Exception as error:
        reason = " ".join(str(error).split())
        msg = f"{origin}: not the metadata of an Ouster sensor ({reason}); save it with `curl http://SENSOR/api/v1/sensor/metadata`"
        raise RecordingError(msg) from None


def read_metadata(path: Path | str) -> str:
    """Return the text of the metadata file that the payload names.

    Raises
    ------
    PayloadError
        It cannot be read.
    """
    require_regular(Path(path), _MOST_OF_METADATA, PayloadError)
    try:
        return Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        msg = f"lidar.metadata: {path} cannot be read ({error}); give the sensor's metadata as JSON"
        raise PayloadError(msg) from None


def check(core: ModuleType, info: Any, packet: bytes, topic: str) -> None:  # noqa: ANN401
    """Refuse metadata that are not of the sensor, or not of the mode, that sent a packet.

    Raises
    ------
    RecordingError
        With what they disagree about.
    """
    form = core.PacketFormat(info)
    packet = _trimmed(packet, form)
    if len(packet) != form.lidar_packet_size:
        found = f"packets of {len(packet)} bytes where the metadata say {form.lidar_packet_size}"
    elif (serial := form.prod_sn(packet)) and info.sn and serial != info.sn:
        found = f"packets of the sensor {serial} where the metadata are of {info.sn}"
    elif (rate := _column_rate(core, form, packet)) and not _is_near(rate, info.format):
        found = (
            f"packets of {rate:.0f} columns per second where the metadata say "
            f"{info.format.columns_per_frame} x {info.format.fps}"
        )
    else:
        return
    msg = f"{topic}: {found}; give the metadata saved from this sensor in the mode of the recording"
    raise RecordingError(msg)


def _column_rate(core: ModuleType, form: Any, packet: bytes) -> float | None:  # noqa: ANN401
    stamps = form.packet_header(core.ColHeader.TIMESTAMP, packet)
    steps = np.diff(stamps[_is_valid(core, form, packet)].astype(np.int64))
    return 1e9 / float(np.median(steps)) if len(steps) and np.median(steps) > 0 else None


def _is_near(rate: float, turn: Any) -> bool:  # noqa: ANN401 - not our type
    """Whether columns per second are those of a mode; modes differ by a factor of two."""
    expected = turn.columns_per_frame * turn.fps
    return bool(0.75 < rate / expected < 1.5)


def _trimmed(packet: bytes, form: Any) -> bytes:  # noqa: ANN401 - not our type
    """Return a lidar packet without the byte that older ROS drivers put behind it."""
    size = int(form.lidar_packet_size)
    return packet[:size] if len(packet) == size + 1 else packet


def _is_valid(core: ModuleType, form: Any, packet: bytes) -> NDArray[np.bool_]:  # noqa: ANN401
    status = form.packet_header(core.ColHeader.STATUS, packet)
    return np.asarray(status & IS_VALID, dtype=np.bool_)


class _Columns(NamedTuple):
    """Columns of one packet: the turn they belong to, their place in it, their times in s."""

    turn: int
    places: NDArray[np.intp]
    times: NDArray[np.float64]
    fields: dict[str, NDArray[np.uint32]]


class OusterPackets:
    """The lidar packets of one Ouster in their order.

    Parameters
    ----------
    core, info : the library, and the sensor's description
    attributes : further fields that are wanted, see `fields`
    """

    period_ns: int | None = None

    def __init__(
        self,
        core: ModuleType,
        info: Any,  # noqa: ANN401 - not our type
        *,
        attributes: Attributes = NO_ATTRIBUTES,
    ) -> None:
        self._core = core
        self._format = core.PacketFormat(info)
        self._attributes = attributes
        self._shape = (info.format.pixels_per_column, info.format.columns_per_frame)
        # The identity leaves the points in the lidar's own frame.
        info.lidar_to_sensor_transform = np.eye(4)
        self._project = core.XYZLut(info, use_extrinsics=False)
        names = set(self._format.fields)
        self._intensity = next(name for name in INTENSITIES if name in names)

    def fields(self, packet: bytes) -> dict[str, np.dtype[Any]]:
        """Return the fields of the sensor's profile."""
        packet = _trimmed(packet, self._format)
        found = self._format.packet_field
        return selectable({name: found(name, packet).dtype for name in self._format.fields})

    def stamp_ns(self, packet: bytes) -> int | None:
        """Return the sensor's time of the first column in ns; None for no such packet."""
        packet = _trimmed(packet, self._format)
        if len(packet) != self._format.lidar_packet_size:
            return None
        stamps = self._format.packet_header(self._core.ColHeader.TIMESTAMP, packet)
        is_valid = _is_valid(self._core, self._format, packet)
        # Outside the sensor's azimuth window no column is valid, and its stamp may be missing.
        stamps = stamps[is_valid if is_valid.any() else stamps > 0]
        return int(stamps[0]) if len(stamps) else None

    def points(
        self, packets: Sequence[bytes], times: NDArray[np.float64], counts: Counter[str]
    ) -> LidarBatch:
        """Return the returns of consecutive packets.

        Parameters
        ----------
        times : (N,) s, of each packet's first valid column
        counts : receives `returns` (all firings of a laser), `zero` (those without a return) and
            `bad_columns` (out of place or time)
        """
        columns = [
            self._columns(packet, start, counts)
            for packet, start in zip(packets, times.tolist(), strict=True)
        ]
        turns = itertools.groupby(columns, key=lambda part: part.turn)
        batches = [self._turn(list(parts), counts) for _, parts in turns]
        return LidarBatch.joined(batches)

    def _columns(self, packet: bytes, start: float, counts: Counter[str]) -> _Columns:
        packet = _trimmed(packet, self._format)
        header, core = self._format.packet_header, self._core
        places = header(core.ColHeader.MEASUREMENT_ID, packet)
        is_valid = _is_valid(core, self._format, packet)
        stamps = header(core.ColHeader.TIMESTAMP, packet).astype(np.int64)
        offsets_ns = stamps - (self.stamp_ns(packet) or 0)
        keep = is_valid & (places < self._shape[1]) & (np.abs(offsets_ns) < MAX_OFFSET_NS)
        counts["bad_columns"] += int((is_valid & ~keep).sum())
        return _Columns(
            self._format.frame_id(packet),
            places[keep].astype(np.intp),
            start + offsets_ns[keep] * 1e-9,
            {
                name: self._format.packet_field(name, packet)[:, keep]
                for name in {"RANGE", self._intensity, *self._attributes.sources}
            },
        )

    def _turn(self, parts: Sequence[_Columns], counts: Counter[str]) -> LidarBatch:
        """Project the columns of one turn, of which the SDK wants a whole image."""
        places = np.concatenate([part.places for part in parts])
        times = np.concatenate([part.times for part in parts])

        def field(name: str) -> NDArray[Any]:
            return np.concatenate([part.fields[name] for part in parts], axis=1)

        ranges = field("RANGE")
        image = np.zeros(self._shape, np.uint32)
        image[:, places] = ranges
        # Column by column, as they were measured.
        points = self._project(image)[:, places].transpose(1, 0, 2).reshape(-1, 3)
        keep = ranges.T.ravel() > 0
        n_beams = self._shape[0]
        counts["returns"] += len(keep)
        counts["zero"] += int((~keep).sum())
        return LidarBatch(
            np.ascontiguousarray(points, dtype=np.float64),
            np.repeat(times, n_beams),
            field(self._intensity).T.ravel().astype(np.float32),
            np.tile(np.arange(n_beams, dtype=np.uint16), len(places)),
            attributes=self._attributes.gathered(len(keep), lambda name: field(name).T.ravel()),
        ).where(keep)


class OusterImuPackets:
    """The IMU packets of one Ouster."""

    period_ns: int | None = None

    def __init__(self, core: ModuleType, info: Any) -> None:  # noqa: ANN401 - not our type
        self._core = core
        self._format = core.PacketFormat(info)
        self._is_legacy = info.format.udp_profile_imu == core.UDPProfileIMU.LEGACY

    def stamp_ns(self, packet: bytes) -> int | None:
        """Return the sensor's time of the first sample in ns; None for no such packet."""
        if len(packet) not in (self._format.imu_packet_size, self._format.imu_packet_size + 1):
            return None
        return int(self._stamps(self._parsed(packet))[0])

    def samples(
        self, packet: bytes
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return ns since the first sample (M,), gyro (M, 3) rad/s and accel (M, 3) m/s²."""
        parsed = self._parsed(packet)
        stamps = self._stamps(parsed)
        gyro, accel = parsed.gyro().astype(np.float64), parsed.accel().astype(np.float64)
        return stamps - stamps[0], gyro, accel

    def _parsed(self, packet: bytes) -> Any:  # noqa: ANN401 - not our type
        size = self._format.imu_packet_size
        parsed = self._core.ImuPacket(size)
        parsed.buf[:] = np.frombuffer(packet, np.uint8, size)
        parsed.format = self._format
        return parsed

    def _stamps(self, parsed: Any) -> NDArray[np.int64]:  # noqa: ANN401 - not our type
        # The first packets had one sample and three stamps, of which the ROS driver takes this.
        if self._is_legacy:
            return np.array([parsed.gyro_ts()], dtype=np.int64)
        return np.asarray(parsed.timestamp(), dtype=np.int64)
