# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a fault is: what it changes of the messages and of the payload, and by what it is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np
from rosbags.typesys import Stores, get_typestore

from bentwing.base import geometry
from bentwing.base.errors import UsageError
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.simulate.faults.messages import IMU, stamp_ns
from bentwing.simulate.names import HeadName

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray
    from rosbags.highlevel import AnyReader
    from rosbags.typesys.store import Typestore

    from bentwing.simulate.names import FaultName

Message = Any
"""A message, made by `rosbags` at run time from ROS's own definitions."""
Edit: TypeAlias = "Callable[[Message], Message | None]"
"""Return the message to write instead, the same one changed or another; None for none."""
Repair = Literal["mount", "axes", "units", "latency", "mirrored", "encoder", "none"]
"""What would have to be found to map the recording all the same."""

ALL: tuple[HeadName, ...] = get_args(HeadName)
PLANAR: tuple[HeadName, ...] = ("hokuyo-spin", "hokuyo-nod")
TURNED: tuple[HeadName, ...] = ("vlp16-motor",)
SOLID: tuple[HeadName, ...] = tuple(head for head in ALL if head not in PLANAR)
"""Heads with a 3D lidar."""


@dataclass(frozen=True)
class Subject:
    """The recording that a fault is put into.

    Attributes
    ----------
    reader : of the recording
    folder : where the truth of a simulated recording lies
    rng : for what is drawn
    """

    reader: AnyReader
    folder: Path
    rng: np.random.Generator

    def at_share(self, share: float) -> int:
        """Return the recorder's time, ns, when this share of the recording is over."""
        return int(self.reader.start_time + share * self.reader.duration)

    @cached_property
    def standard_types(self) -> Typestore:
        """The types of ROS, for messages of a type that the recording does not have."""
        return get_typestore(Stores.ROS2_HUMBLE if self.reader.is2 else Stores.ROS1_NOETIC)

    def imu(self) -> Iterator[Message]:
        """Yield the inertial messages, before the fault."""
        connections = [c for c in self.reader.connections if c.msgtype == IMU]
        if not connections:
            msg = f"the recording has no IMU ({IMU}) that this fault could change"
            raise UsageError(msg)
        for connection, _, raw in self.reader.messages(connections):
            yield self.reader.deserialize(raw, connection.msgtype)

    @cached_property
    def attitudes(self) -> Trajectory:
        """True poses of the IMU in the world; times in s since the recorder's start.

        Raises
        ------
        UsageError
            If the recording was not simulated.
        """
        path = self.folder / "truth_trajectory.txt"
        if not path.exists():
            msg = f"{path} is missing: this fault needs a simulated recording with its truth"
            raise UsageError(msg)
        return read_tum(path, self.reader.start_time)[0]

    def attitude(self, message: Message) -> NDArray[np.float64]:
        """Return the true rotation (3, 3) from the IMU's frame to the world at a message's stamp."""
        time = 1e-9 * (stamp_ns(message) - self.reader.start_time)
        first, last = self.attitudes.times[[0, -1]]
        _, quats = self.attitudes.interpolate(np.clip([time], first, last))
        R_world_imu: NDArray[np.float64] = geometry.to_matrices(quats)[0]
        return R_world_imu


@dataclass(frozen=True, slots=True)
class Changes:
    """What a fault changes of one recording; None leaves it as it is.

    Attributes
    ----------
    payload : changes the content of payload.yaml in place
    imu, lidar, encoder : change every message of these sensors, in the recorder's order
    """

    payload: Callable[[dict[str, Any]], None] | None = None
    imu: Edit | None = None
    lidar: Edit | None = None
    encoder: Edit | None = None


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that is wrong.

    Attributes
    ----------
    name : as `bentwing simulate --fault` takes it
    does : what it does, in one sentence
    change : what it changes of a recording
    repair : what would have to be found to map the recording all the same
    cause : pattern of the words, in any case, by which a refusal names this cause
    heads : it can be put into
    """

    name: FaultName
    does: str
    change: Callable[[Subject], Changes]
    repair: Repair
    cause: str
    heads: tuple[HeadName, ...] = ALL
