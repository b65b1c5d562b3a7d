# SPDX-License-Identifier: MIT OR Apache-2.0
"""Write a recording and its payload again, with a fault."""

from __future__ import annotations

import shutil
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from bentwing.base.errors import PayloadError, UsageError
from bentwing.base.staged_folder import staged_folder
from bentwing.base.yaml_files import read_yaml
from bentwing.simulate.faults.fault import Subject
from bentwing.simulate.faults.messages import CLOUD, ENCODER, IMU, SCAN
from bentwing.simulate.faults.registry import fault_of
from bentwing.simulate.truth import write_yaml
from bentwing.simulate.write import PAYLOAD, require_no_recording

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

    from bentwing.simulate.faults.fault import Changes, Edit


def with_fault(
    recording: Path | str, payload: Path | str, fault: str, out: Path | str, *, seed: int = 0
) -> tuple[Path, Path]:
    """Write a recording as a head writes it that has a fault; all other bytes stay as they are.

    Truth beside the recording is copied: it is that of the head without the fault. Some faults
    need it. `truth_calibration.yaml` names the fault.

    Parameters
    ----------
    recording : ROS 1 bag file or ROS 2 bag folder
    payload : payload.yaml of the head
    fault : name, one of `FAULTS`
    out : folder for the new recording, its payload.yaml and the truth
    seed : of what the fault draws

    Returns
    -------
    The new recording and the new payload.yaml.

    Raises
    ------
    UsageError
        If there is no such fault, it cannot be put into this recording, or `out` has one already.
    """
    source, folder = Path(recording), Path(out)
    require_no_recording(folder)
    content = _payload(Path(payload))
    name = "recording.bag" if source.suffix == ".bag" else "recording"
    with staged_folder(folder, name) as stage:
        _write_all(source, content, fault, stage / name, seed)
    return folder / name, folder / PAYLOAD


def _write_all(source: Path, content: dict[str, Any], fault: str, target: Path, seed: int) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([source], default_typestore=store) as reader:
        rng = np.random.default_rng([seed, *fault.encode()])
        subject = Subject(reader, source.parent, rng)
        changes = fault_of(fault).change(subject)
        _require_sensors(changes, reader)
        if changes.payload is not None:
            changes.payload(content)
        _rewrite(subject, changes, target)
    write_yaml(target.parent / PAYLOAD, content)
    _copy_truth(source.parent, target.parent, fault)


def _payload(path: Path) -> dict[str, Any]:
    content = read_yaml(path, "give the payload.yaml of the head", PayloadError)
    if not isinstance(content, dict):
        msg = f"{path}: expected a mapping of sections, found {type(content).__name__}"
        raise PayloadError(msg)
    return content


def _require_sensors(changes: Changes, reader: AnyReader) -> None:
    """Refuse a fault of a sensor that the recording does not have."""
    present = {connection.msgtype for connection in reader.connections}
    # The encoder has the lidar's clock, but a fault of the clock needs no encoder.
    is_of_encoder = changes.encoder is not None and changes.lidar is None
    for sensor, is_needed, types in (
        ("IMU", changes.imu is not None, (IMU,)),
        ("encoder", is_of_encoder, (ENCODER,)),
        ("lidar", changes.lidar is not None, (SCAN, CLOUD)),
    ):
        if is_needed and present.isdisjoint(types):
            msg = (
                f"the recording has no {sensor} ({' or '.join(types)}) that this fault could change"
            )
            raise UsageError(msg)


def _rewrite(subject: Subject, changes: Changes, target: Path) -> None:
    edits = {
        IMU: changes.imu,
        ENCODER: changes.encoder,
        SCAN: changes.lidar,
        CLOUD: changes.lidar,
    }
    with ExitStack() as stack:
        writer = _Writer(stack, subject, target)
        for connection, stamp, raw in subject.reader.messages():
            writer.write(connection, stamp, raw, edits.get(connection.msgtype))


class _Writer:
    """Writes in the source's own format."""

    def __init__(self, stack: ExitStack, subject: Subject, target: Path) -> None:
        self._subject, self._reader = subject, subject.reader
        self._connections: dict[tuple[str, str], Any] = {}
        self._writer: Any
        if not self._reader.is2:
            self._writer = stack.enter_context(Ros1Writer(target))
            return
        is_sqlite = any(Path(str(self._reader.paths[0])).glob("*.db3"))
        plugin = StoragePlugin.SQLITE3 if is_sqlite else StoragePlugin.MCAP
        self._writer = stack.enter_context(Ros2Writer(target, version=9, storage_plugin=plugin))

    def write(self, connection: Any, stamp: int, raw: bytes, edit: Edit | None) -> None:  # noqa: ANN401
        """Append a message, changed by the edit if there is one."""
        kind = connection.msgtype
        if edit is not None:
            message = edit(self._reader.deserialize(raw, kind))
            if message is None:
                return
            kind = message.__msgtype__
            types = self._types_with(kind)
            encode = types.serialize_cdr if self._reader.is2 else types.serialize_ros1
            raw = bytes(encode(message, kind))
        key = connection.topic, kind
        if key not in self._connections:
            types = self._types_with(kind)
            self._connections[key] = self._writer.add_connection(*key, typestore=types)
        self._writer.write(self._connections[key], stamp, raw)

    def _types_with(self, kind: str) -> Typestore:
        own = self._reader.typestore
        return own if kind in own.types else self._subject.standard_types


def _copy_truth(source: Path, out: Path, fault: str) -> None:
    for path in [*source.glob("truth_*"), *source.glob("scenario.yaml")]:
        shutil.copyfile(path, out / path.name)
    truth = out / "truth_calibration.yaml"
    known = yaml.safe_load(truth.read_text(encoding="utf-8")) if truth.exists() else {}
    write_yaml(truth, {**known, "fault": fault})
