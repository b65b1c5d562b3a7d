# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a recording holds, and what it lacks for mapping with how to repair it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.calibrate.carrier import CarrierWatch, carrier_warnings
from bentwing.calibrate.draft import draft_payload
from bentwing.calibrate.inspection import fitness
from bentwing.calibrate.inspection.spin import Spin, spin_from_encoder, spin_from_gyro
from bentwing.calibrate.inspection.structure import Structure, StructureMeter
from bentwing.calibrate.set_up import find_set_up
from bentwing.recording.batches import EncoderBatch, ImuBatch
from bentwing.recording.containers.source import open_source
from bentwing.recording.frames import placed_payload
from bentwing.recording.preprocess import Preprocessing
from bentwing.recording.preprocess.imu_limits import limit_sentences
from bentwing.recording.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.calibrate.inspection.fitness import Stretch
    from bentwing.calibrate.set_up import SetUp
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.payload import Payload, PayloadLike
    from bentwing.recording.sections.self_hits import SelfHit
    from bentwing.recording.tf_mount import TfMount


@dataclass(frozen=True, slots=True)
class TopicReport:
    """One topic; `role` is lidar, imu, encoder or empty, `gaps` are (start, length) in s."""

    name: str
    type: str
    count: int
    rate_hz: float
    role: str = ""
    gaps: list[tuple[float, float]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Inspection:
    """What a recording holds and whether it can be mapped.

    Attributes
    ----------
    paths : as given
    start_ns, duration : ns UTC, s
    topics : all of them
    point_times : how the time of each point is known, None where it is not
    spin : rate of turn over time, None without IMU and encoder
    static_start : (start, end) s, None where the recording starts in motion or has no IMU
    structure : what the lidar saw
    self_hits : boxes around what it saw of its own carrier, beyond those of the payload
    counts : everything read and dropped
    clocks : by sensor, what its stamps say of its clock
    defects : what prevents mapping, each with how to repair it
    warnings : what may make the map worse
    set_up : the sensor head as the motion shows it; None where there is no IMU and no encoder
    tf_mount : where the lidar is on the IMU by /tf_static; None without it
    fields : by name the types of what else the lidar says of each point, for `--attributes`
    """

    paths: list[str]
    start_ns: int
    duration: float
    topics: list[TopicReport]
    point_times: str | None = None
    spin: Spin | None = None
    static_start: Stretch | None = None
    structure: Structure | None = None
    self_hits: tuple[SelfHit, ...] = ()
    counts: dict[str, int] = field(default_factory=dict)
    defects: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    set_up: SetUp | None = None
    clocks: dict[str, str] = field(default_factory=dict)
    tf_mount: TfMount | None = None
    fields: dict[str, str] = field(default_factory=dict)

    @property
    def is_fit(self) -> bool:
        """Whether nothing found prevents mapping."""
        return not self.defects


def inspect(paths: Path | str | Sequence[Path | str], payload: PayloadLike = None) -> Inspection:
    """Read a recording, find how its head is set up, and report on both.

    Parameters
    ----------
    paths : one recording, or its consecutive parts
    payload : the sensor head, or the payload.yaml that describes it

    Raises
    ------
    RecordingError
        Nothing in it can be read at all; every lesser defect is part of the result.
    """
    listed = [Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths)]
    payload = None if payload is None else placed_payload(listed, payload)
    try:
        set_up = _set_up(listed, payload)
        is_known = set_up is not None and set_up.doubt is None
        described = set_up.payload if set_up is not None and is_known else payload
        with Recording(listed, described, strict=False) as recording:
            found = _inspect_recording(recording, has_payload=described is not None)
    except RecordingError as error:
        return _topics_only(listed, str(error))
    return replace(found, set_up=set_up)


def _set_up(paths: list[Path], payload: Payload | None) -> SetUp | None:
    described = draft_payload(paths).payload if payload is None else payload
    with Recording(paths, described, strict=False) as recording:
        moves = recording.imu_topic is not None or recording.encoder_topic is not None
        if not moves or recording.point_times is None:
            return None
    return find_set_up(paths, described)


def _topics_only(paths: list[Path], defect: str) -> Inspection:
    """Report on files whose sensors cannot be made out; raises where they cannot be opened."""
    source = open_source(paths)
    try:
        duration = max(0, source.end_ns - source.start_ns) / 1e9
        topics = [_topic_report(topic, duration) for topic in source.topics]
        return Inspection(
            [str(path) for path in paths],
            source.start_ns,
            duration,
            topics,
            defects=[defect],
            warnings=list(source.warnings),
        )
    finally:
        source.close()


def _topic_report(
    topic: TopicInfo,
    duration: float,
    role: str = "",
    gaps: Sequence[tuple[float, float]] = (),
) -> TopicReport:
    # n messages span n - 1 periods.
    rate_hz = max(0, topic.count - 1) / duration if duration > 0 else 0.0
    return TopicReport(topic.name, topic.type, topic.count, rate_hz, role, list(gaps))


def _inspect_recording(recording: Recording, *, has_payload: bool) -> Inspection:
    judgement = fitness.judge(recording, has_payload=has_payload)
    counts = Counter[str]()
    spin, structure, carrier = _read(recording, judgement.gyro_scale, counts)
    warnings = list(judgement.warnings) + carrier_warnings(recording.payload, carrier)
    warnings += limit_sentences({**recording.counts, **counts})
    if spin is not None:
        warnings += fitness.stall_warnings(spin)
    roles = {
        topic: role
        for role, topic in (
            ("lidar", recording.lidar_topic),
            ("imu", recording.imu_topic),
            ("encoder", recording.encoder_topic),
        )
        if topic is not None
    }
    gaps = recording.gaps
    topics = [
        _topic_report(
            topic, recording.duration, roles.get(topic.name, ""), gaps.get(topic.name, ())
        )
        for topic in recording.topics
    ]
    return Inspection(
        [str(path) for path in recording.paths],
        recording.start_ns,
        recording.duration,
        topics,
        recording.point_times,
        spin,
        judgement.static_start,
        structure,
        carrier,
        dict(recording.counts),
        judgement.defects,
        recording.warnings + warnings,
        clocks={role: str(clock) for role, clock in recording.clocks.items()},
        tf_mount=recording.tf_mount(),
        fields={name: kind.name for name, kind in recording.lidar_fields.items()},
    )


def _read(
    recording: Recording, gyro_scale: float, counts: Counter[str]
) -> tuple[Spin | None, Structure, tuple[SelfHit, ...]]:
    """Pass once over the recording, keeping the small streams whole and summing up the lidar's.

    What preprocessing would drop, and what it marks, is added to `counts`.
    """
    imu: list[ImuBatch] = []
    encoder: list[EncoderBatch] = []
    meter, carrier = StructureMeter(), CarrierWatch(recording.payload)
    preprocessing = Preprocessing(recording.payload, counts)
    for batch in recording.batches():
        for usable in preprocessing.add(batch):
            carrier.add(usable)
        if isinstance(batch, ImuBatch):
            imu.append(batch)
        elif isinstance(batch, EncoderBatch):
            encoder.append(batch)
        else:
            meter.add(batch)
    structure, boxes = meter.result(recording.counts["lidar.returns"]), carrier.boxes()
    if sum(len(batch.times) for batch in encoder) > 1:
        times, angles = (
            np.concatenate([getattr(b, n) for b in encoder]) for n in ("times", "angles")
        )
        return spin_from_encoder(times, angles), structure, boxes
    if sum(len(batch.times) for batch in imu) > 1:
        times, gyro = (np.concatenate([getattr(b, n) for b in imu]) for n in ("times", "gyro"))
        return spin_from_gyro(times, gyro_scale * gyro), structure, boxes
    return None, structure, boxes
