# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording: files and payload in, batches of lidar, IMU and encoder samples out."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.clock import NS_PER_S, Clock
from bentwing.base.errors import PayloadError, RecordingError
from bentwing.base.log import get_logger
from bentwing.recording import imu_units, problems
from bentwing.recording.attributes import Attributes
from bentwing.recording.clocks.look_ahead import look_ahead
from bentwing.recording.clocks.rates import rate_of, run_apart
from bentwing.recording.containers.source import open_source
from bentwing.recording.fixes import Fixes, read_fixes
from bentwing.recording.frames import placed
from bentwing.recording.joints import peek_joints, unclear_joint
from bentwing.recording.messages.gps_fix import GPS_FIX, gps_fix
from bentwing.recording.open_streams import open_streams
from bentwing.recording.packets.peek import peek_imu, peek_lidar
from bentwing.recording.payload import as_payload
from bentwing.recording.peek import Peek, peek
from bentwing.recording.point_times import TimeReading
from bentwing.recording.readings import Readings
from bentwing.recording.slots import group_into_slots, trimmed
from bentwing.recording.stream_warnings import stream_warnings
from bentwing.recording.tf_joint import first_link
from bentwing.recording.tf_mount import TfMount, tf_mount
from bentwing.recording.topics import NAV_SAT_FIX, PACKET_TYPES, resolve

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from types import TracebackType

    import numpy as np
    from typing_extensions import Self

    from bentwing.recording.batches import Batch, ImuBatch
    from bentwing.recording.clocks.findings import ClockFindings
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.payload import PayloadLike
    from bentwing.recording.streams import Stream

_log = get_logger(__name__)

SEEK_MARGIN = 5.0  # s by which messages may reach the recorder late


class Recording:
    """One recording, opened.

    Parameters
    ----------
    paths : one file or folder, or the consecutive parts of one recording
    payload : the sensor head, or the payload.yaml that describes it; default: a generic lidar
        without IMU
    strict : refuse what cannot be mapped (no time per point, IMU in wrong units, …); False only
        reports, for inspection

    Raises
    ------
    RecordingError, PayloadError
        The recording cannot be read, or does not match the payload.
    """

    def __init__(
        self,
        paths: Path | str | Sequence[Path | str],
        payload: PayloadLike = None,
        *,
        strict: bool = True,
    ) -> None:
        listed = [paths] if isinstance(paths, (str, Path)) else list(paths)
        self.paths = [Path(path) for path in listed]
        self.payload = as_payload(payload)
        self._readings = Readings.of(self.payload)
        self.strict = strict
        self._source = open_source(self.paths)
        self._streams: dict[str, Stream] = {}
        self._opening_warnings: list[str] = []
        self._first_imu: tuple[float, list[ImuBatch]] = (0.0, [])
        try:
            self._survey()
        except BaseException:
            self.close()
            raise

    def _survey(self) -> None:
        self.payload = placed(self.payload, self._source)
        roles = resolve(self._source.topics, self.payload)
        found = {role: topic for role, topic in roles._asdict().items() if topic is not None}
        is_alone = all(topic.type in PACKET_TYPES for topic in found.values())
        self._peeks: dict[str, Peek] = {}
        for role, topic in found.items():
            offset_ns: int = getattr(self._readings, role).offset_ns
            self._peeks[role] = self._peek(role, topic, is_alone=is_alone).shifted(offset_ns)
        self._attributes = Attributes.of(
            self.payload.lidar.attributes, self.lidar_fields, self.lidar_topic
        )
        self.clock = Clock(min(found.first_ns for found in self._peeks.values()))
        for role, peeked in self._peeks.items():
            _log.info("%s: %s (%s)", role, peeked.topic.name, peeked.topic.type)
        if self.strict:
            self.check()

    def _peek(self, role: str, topic: TopicInfo, *, is_alone: bool) -> Peek:
        if role == "encoder" and (joint := self._readings.encoder.tf) is not None:
            recorder_ns, stamp_ns = first_link(self._source, topic, joint)
            return Peek(
                topic,
                use_recorder_time=False,
                first_ns=stamp_ns,
                offset_ns=stamp_ns - recorder_ns,
            )
        if role == "encoder":
            joints = peek_joints(self._source, topic, self._readings.encoder.joint)
            return replace(peek(self._source, topic), joints=joints)
        if topic.type not in PACKET_TYPES:
            return peek(self._source, topic, self._readings.lidar.times)
        if role == "lidar":
            self._readings.lidar.times.refuse(
                "are raw packets, which have the time of every firing",
                "time_field",
                "time_unit",
                "time_reference",
            )
            return peek_lidar(self._source, topic, self.payload.lidar, is_alone=is_alone)
        clock = self._peeks["lidar"].packet_clock
        return peek_imu(self._source, topic, self.payload.lidar, clock)

    def check(self) -> None:
        """Refuse what cannot be mapped, and be strict from now on.

        Raises
        ------
        RecordingError, PayloadError
        """
        self.strict = True
        if "imu" in self._peeks and not self.payload.places_lidar_on_imu:
            turned = self.payload.encoder is not None
            raise PayloadError(problems.mount(self.imu_topic or "", turned=turned))
        if self.point_times is None:
            raise RecordingError(self.point_times_problem)
        for problem in self.clock_problems():
            raise RecordingError(problem)
        if "imu" in self._peeks:
            self._check_imu()

    def _check_imu(self) -> None:
        samples = self.first_imu(imu_units.CHECKED)
        self._first_imu = (0.0, [])  # nobody asks again
        units = None if self.payload.imu is None else self.payload.imu.units
        if found := imu_units.problems(*samples, units):
            msg = f"{self.imu_topic}: {'; '.join(found)}"
            raise RecordingError(msg)
        if (mirrored := imu_units.mirrored_axis(*samples)) is not None:
            self._opening_warnings.append(f"{self.imu_topic}: {mirrored}")

    def clock_offsets(self) -> dict[str, float]:
        """Return by sensor what is to be added to stamps of a clock that the lidar does not share, s.

        By the recorder's times, so to its delays only: to some milliseconds.
        """
        lidar = self._peeks["lidar"]
        others = {role: self._peeks[role] for role in ("imu", "encoder") if role in self._peeks}
        return {
            role: (lidar.offset_ns - other.offset_ns) / NS_PER_S
            for role, other in others.items()
            if not problems.share_clock(lidar, other)
        }

    def clock_problems(self) -> list[str]:
        """Return a sentence for each sensor that does not share the lidar's clock."""
        found: list[str] = []
        for role, section in (("imu", self.payload.imu), ("encoder", self.payload.encoder)):
            if section is not None and role in self._peeks:
                offset = section.clock_offset
                problem = problems.clocks(self._peeks["lidar"], self._peeks[role], role, offset)
                found += [] if problem is None else [problem]
        return found

    def clock_rate_problem(self) -> str | None:
        """Return the sentence on a lidar and an IMU whose clocks run apart, by the recorder's times."""
        if "imu" not in self._peeks:
            return None
        lidar, imu = (rate_of(self._source, self._peeks[role]) for role in ("lidar", "imu"))
        if lidar is None or imu is None or not run_apart(lidar, imu):
            return None
        return problems.clock_rates(lidar, imu)

    def imu_batches(self) -> Iterator[Batch]:
        """Yield the IMU's samples alone, in a pass of their own that leaves the counts as is."""
        return self._alone("imu")

    def first_imu(self, seconds: float) -> imu_units.Samples:
        """Return times (M,), gyro (M, 3) and accel (M, 3) of the first seconds, read once until `check`."""
        known, batches = self._first_imu
        if seconds > known:
            batches = imu_units.beginning(self.imu_batches(), seconds)
            self._first_imu = (seconds, batches)
        return imu_units.collect(batches, seconds)

    def encoder_batches(self) -> Iterator[Batch]:
        """Yield the encoder's angles alone, in a pass of their own that leaves the counts as is."""
        return self._alone("encoder")

    def _alone(self, role: str) -> Iterator[Batch]:
        if role not in self._peeks:
            return iter(())
        streams = {self._peeks[role].topic.name: self._open_streams([role])[role]}
        messages = self._source.messages(streams)
        return group_into_slots(look_ahead(messages, streams), streams)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the files."""
        self._source.close()

    @property
    def topics(self) -> tuple[TopicInfo, ...]:
        """All topics of the recording: name, type, count."""
        return self._source.topics

    @property
    def lidar_topic(self) -> str:
        """The lidar's topic."""
        return self._peeks["lidar"].topic.name

    @property
    def imu_topic(self) -> str | None:
        """The IMU's topic, None without IMU."""
        return self._topic("imu")

    @property
    def encoder_topic(self) -> str | None:
        """The encoder's topic, None without encoder."""
        return self._topic("encoder")

    def tf_mount(self) -> TfMount | None:
        """Return what /tf_static says of the lidar on the IMU; None without, or where a motor turns it."""
        if "imu" not in self._peeks or "encoder" in self._peeks:
            return None
        return tf_mount(self._source, self._peeks["lidar"].topic, self._peeks["imu"].topic)

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints on the encoder's topic, of which the payload names one; none without encoder."""
        return self._peeks["encoder"].joints if "encoder" in self._peeks else ()

    @property
    def has_fixes(self) -> bool:
        """Whether the recording has the topic of GNSS fixes that the payload names."""
        return self._gnss_topic() is not None

    @property
    def lidar_fields(self) -> Mapping[str, np.dtype[Any]]:
        """Fields of the lidar's points that a map can carry as attributes, with their types."""
        return self._peeks["lidar"].fields

    @property
    def point_times(self) -> str | None:
        """A sentence on how the time of each point is known; None where it is not."""
        return self._peeks["lidar"].point_times

    @property
    def point_times_problem(self) -> str:
        """The sentence on a lidar whose points have no times."""
        return problems.point_times(self.lidar_topic, self.lidar_type, self._peeks["lidar"].lack)

    @property
    def start_ns(self) -> int:
        """Stamp of the earliest sample, ns UTC as in the source."""
        return self.clock.start_ns

    @property
    def end_ns(self) -> int:
        """Stamp of the end, ns; from the recorder's clock, exact to the messages' delay."""
        return self.start_ns + max(0, self._source.end_ns - self._source.start_ns)

    @property
    def duration(self) -> float:
        """Seconds from start to end."""
        return (self.end_ns - self.start_ns) / NS_PER_S

    @property
    def counts(self) -> Counter[str]:
        """What the latest pass over `batches` read and dropped so far, by `<stream>.<reason>`."""
        return Counter(
            {
                f"{role}.{name}": n
                for role, stream in self._streams.items()
                for name, n in stream.counts.items()
                if n
            }
        )

    @property
    def clocks(self) -> dict[str, ClockFindings]:
        """What the stamps of each sensor say of its clock, as far as the latest pass got.

        Sensors that stamp their packets themselves are not among them.
        """
        found = {role: stream.monitor.clock.findings for role, stream in self._streams.items()}
        return {role: clock for role, clock in found.items() if clock.n}

    @property
    def gaps(self) -> dict[str, list[tuple[float, float]]]:
        """Silences by topic as (start, length) in s; complete after a pass over `batches`."""
        return {
            self._peeks[role].topic.name: [
                ((gap.start_ns - self.start_ns) / NS_PER_S, (gap.end_ns - gap.start_ns) / NS_PER_S)
                for gap in stream.monitor.gaps
            ]
            for role, stream in self._streams.items()
        }

    @property
    def lidar_type(self) -> str:
        """The type of the lidar's topic, e.g. sensor_msgs/msg/LaserScan."""
        return self._peeks["lidar"].topic.type

    @property
    def warnings(self) -> list[str]:
        """What was found odd so far, as sentences; complete after a pass over `batches`."""
        sentences = [*self._source.warnings, *self._opening_warnings]
        lidar = self._peeks["lidar"]
        if lidar.are_times_made:
            sentences.append(f"{self.lidar_topic}: {lidar.point_times}")
        if isinstance(lidar.reading, TimeReading) and lidar.reading.origin == "sensor":
            sentences.append(
                f"{self.lidar_topic}: the points' times are on another clock than the header "
                "stamps, so each sweep's first point is put at its stamp; let the driver use one "
                "clock, or expect the stamps' jitter"
            )
        gnss = self.payload.gnss
        if gnss is not None and gnss.topic is not None and self._gnss_topic() is None:
            sentences.append(
                f"the payload names the gnss topic {gnss.topic}, which the recording does not have; "
                "the map stays in its own frame"
            )
        for role, found in self._peeks.items():
            if found.use_recorder_time:
                sentences.append(
                    f"{found.topic.name}: all header stamps are zero, the recorder's time is used "
                    "instead; let the driver stamp its messages, or expect jitter"
                )
            if len(found.joints) > 1 and self._readings.encoder.joint is None:
                sentences.append(unclear_joint(found.topic, found.joints))
            if role in self._streams:
                sentences += stream_warnings(found.topic.name, self._streams[role], self.clock)
        return sentences

    def batches(self, start: float | None = None, duration: float | None = None) -> Iterator[Batch]:
        """Yield the batches in the order of the recording, about 0.1 s of a stream in each.

        Parameters
        ----------
        start, duration : s, part of the recording to read, relative to its start

        Raises
        ------
        RecordingError
            (strict) Nothing of the lidar could be used.
        """
        begin = 0.0 if start is None else start
        end = float("inf") if duration is None else begin + duration
        order: tuple[str, ...] = ("encoder", "imu", "lidar")
        roles = [role for role in order if role in self._peeks]
        self._streams = streams = self._open_streams(roles)
        by_topic = {self._peeks[role].topic.name: stream for role, stream in streams.items()}
        messages = self._source.messages(set(by_topic), self._seek_ns(begin))
        n_points = 0
        foreseen = look_ahead(messages, by_topic)
        for batch in group_into_slots(foreseen, by_topic, self._stop_ns(end)):
            if (part := trimmed(batch, begin, end)) is not None:
                n_points += hasattr(part, "points")
                yield part
        if self.counts:
            _log.info("read and dropped: %s", dict(self.counts))
        if self.strict and n_points == 0:
            self._refuse_empty(begin, end)

    def fixes(self, start: float | None = None, duration: float | None = None) -> Fixes | None:
        """Read the GNSS fixes; None where the payload names no topic or the recording has it not.

        Parameters
        ----------
        start, duration : s, part of the recording to read, relative to its start

        Raises
        ------
        RecordingError
            The topic has another type.
        """
        topic = self._gnss_topic()
        if topic is None:
            return None
        if topic.type not in {NAV_SAT_FIX, *GPS_FIX}:
            msg = (
                f"topic {topic.name} has the type {topic.type or 'unknown'}, which cannot be read as "
                f"gnss; supported are {', '.join((NAV_SAT_FIX, *sorted(GPS_FIX)))}"
            )
            raise RecordingError(msg)
        begin = 0.0 if start is None else start
        end = float("inf") if duration is None else begin + duration
        messages = self._source.messages({topic.name}, self._seek_ns(begin))
        parse = gps_fix if topic.type in GPS_FIX else None
        cdr = self._source.cdr
        return read_fixes(messages, self.clock, cdr=cdr, parse=parse, begin=begin, end=end)

    def _gnss_topic(self) -> TopicInfo | None:
        gnss = self.payload.gnss
        if gnss is None or gnss.topic is None:
            return None
        name = gnss.topic.strip("/")
        return next((topic for topic in self.topics if topic.name.strip("/") == name), None)

    def _seek_ns(self, begin: float) -> int | None:
        if begin <= SEEK_MARGIN:
            return None
        return self._source.start_ns + int((begin - SEEK_MARGIN) * NS_PER_S)

    def _stop_ns(self, end: float) -> int | None:
        if end == float("inf"):
            return None
        return self._source.start_ns + int((end + SEEK_MARGIN) * NS_PER_S)

    def _open_streams(self, roles: Sequence[str]) -> dict[str, Stream]:
        cdr, strict = self._source.cdr, self.strict
        return open_streams(
            self._peeks,
            roles,
            self.clock,
            self._readings,
            cdr=cdr,
            needs_beam_times=strict,
            attributes=self._attributes,
        )

    def _topic(self, role: str) -> str | None:
        return self._peeks[role].topic.name if role in self._peeks else None

    def _refuse_empty(self, begin: float, end: float) -> None:
        lidar = self._streams["lidar"].counts
        dropped = ", ".join(f"{n} {name}" for name, n in lidar.items() if n and name != "messages")
        msg = (
            f"{self.lidar_topic}: no valid return between {begin:.1f} and "
            f"{min(end, self.duration):.1f} s ({lidar['messages']} messages; "
            f"{dropped or 'no returns'}); check that the lidar was not covered and that --start "
            "and --duration lie within the recording"
        )
        raise RecordingError(msg)
