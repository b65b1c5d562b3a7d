# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which joint turns the lidar, in which unit and direction, and about which axis.

The lidar is followed by itself, as if nothing were known of the motor. Its rate is that of the motor
about a fixed direction of the lidar, and the little that the carrier adds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from bentwing.base import geometry
from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.errors import NotFoundError
from bentwing.calibrate.set_up.motion import HALF

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.calibrate.set_up.motion import LidarMotion
    from bentwing.recording import EncoderBatch, Payload

DELAYS = np.arange(-0.1, 0.1005, 0.005)  # s
SAME_AXIS = np.radians(10.0)
# More of the lidar's turn is not left to the carrier.
CARRIER = 0.6
ROUNDS = 5
Joint: TypeAlias = tuple[str | None, Literal["rad", "deg"]]
"""Name, None for the only one, and unit in which its positions are read."""
UNITS: tuple[Literal["rad", "deg"], ...] = ("rad", "deg")
SLOW = 0.05  # rad/s; a motor that stands shows nothing


@dataclass(frozen=True, slots=True)
class Turn:
    """How the lidar turns with a joint.

    Attributes
    ----------
    axis : (3,) unit vector, lidar frame
    scale : turn of the lidar by turn of the joint, not negative
    delay : s, the angle at a stamp of the lidar is that of this much earlier
    left : median rate that remains, as a share of the lidar's
    """

    axis: NDArray[np.float64]
    scale: float
    delay: float
    left: float

    @property
    def cost(self) -> float:
        """What remains unexplained, and how far the scale is from that of a lidar on the motor."""
        return self.left + abs(self.scale - 1.0)


def turn_with(motion: LidarMotion, encoder: EncoderBatch) -> Turn | None:
    """Return how the lidar turns with a joint; None if the joint stands."""
    turns = [turn for delay in DELAYS if (turn := _turn(motion, encoder, delay)) is not None]
    return min(turns, key=lambda turn: turn.left, default=None)


def _turn(motion: LidarMotion, encoder: EncoderBatch, delay: float) -> Turn | None:
    times = motion.times - delay
    inside = (times - HALF > encoder.times[0]) & (times + HALF < encoder.times[-1])
    angles = [np.interp(times[inside] + s, encoder.times, encoder.angles) for s in (-HALF, HALF)]
    rates = (angles[1] - angles[0]) / (2 * HALF)
    if not len(rates) or np.percentile(np.abs(rates), 90) < SLOW:
        return None
    seen = motion.rates[inside]
    weights = np.ones(len(rates))
    for _ in range(ROUNDS):
        along = (weights * rates) @ seen / max(float((weights * rates) @ rates), 1e-12)
        left = np.linalg.norm(seen - rates[:, None] * along, axis=1)
        weights = 1.0 / (1.0 + (left / max(float(np.median(left)), 1e-6)) ** 2)
    scale = float(np.linalg.norm(along))
    share = float(np.median(left) / max(float(np.median(np.linalg.norm(seen, axis=1))), 1e-9))
    return Turn(along / max(scale, 1e-12), scale, delay, share)


def describe_motor(
    motion: LidarMotion, joints: Mapping[Joint, EncoderBatch], payload: Payload, topic: str
) -> Payload:
    """Return the payload with joint, unit, sign and axis of the encoder as the lidar shows them.

    Parameters
    ----------
    motion : of the lidar by itself
    joints : angles of each joint, read in each unit, rad

    Raises
    ------
    NotFoundError
        The lidar turns with none of them.
    """
    assert payload.encoder is not None
    turns = {joint: turn_with(motion, angles) for joint, angles in joints.items()}
    known = {joint: turn for joint, turn in turns.items() if turn is not None}
    if not known:
        msg = f"{topic}: no joint turns, so none is the motor that turns the lidar"
        raise NotFoundError(msg)
    # As the payload has it, unless another reading leaves half of what that leaves.
    said = (payload.encoder.joint, payload.encoder.unit)
    best = min(known, key=lambda joint: known[joint].cost * (0.5 if joint == said else 1.0))
    turn = known[best]
    if turn.cost > CARRIER:
        raise NotFoundError(_unlike(topic, turn))
    described = payload.encoder.T_motor_lidar.pose.R.T @ np.array(payload.encoder.axis)
    sign = 1 if float(described @ turn.axis) >= 0.0 else -1
    found = edits.with_encoder(payload, joint=best[0], unit=best[1], sign=sign)
    if float(described @ turn.axis) * sign >= np.cos(SAME_AXIS):
        return found
    return _with_axis(found, sign * turn.axis)


def _unlike(topic: str, turn: Turn) -> str:
    return (
        f"{topic}: the lidar does not turn as the encoder says: of one turn of the motor it makes "
        f"{turn.scale:.2f}, and {turn.left:.0%} of its own turn is not the motor's; check that it is the "
        "motor of this lidar, its gear ratio and its unit"
    )


def _with_axis(payload: Payload, axis: NDArray[np.float64]) -> Payload:
    """Return the payload with an axis that is `axis` (3,) in the lidar's frame."""
    assert payload.encoder is not None
    in_motor = payload.encoder.T_motor_lidar.pose.R @ axis
    nearest = np.zeros(3)
    largest = int(np.argmax(np.abs(in_motor)))
    nearest[largest] = np.sign(in_motor[largest])
    if float(nearest @ in_motor) > np.cos(SAME_AXIS):
        in_motor = nearest
    return edits.with_encoder(payload, axis=tuple(float(x) for x in in_motor))


def zero_between(
    described: NDArray[np.float64], found: NDArray[np.float64], axis: NDArray[np.float64]
) -> float | None:
    """Return the turn about the motor's axis that lies between two rotations (3, 3), rad.

    Parameters
    ----------
    described, found : R_imu_motor
    axis : (3,) motor frame

    Returns
    -------
    None where they differ about another axis.
    """
    between = geometry.log(geometry.from_matrices((described.T @ found)[None])).reshape(3)
    about = float(between @ axis)
    across = np.linalg.norm(between - about * axis)
    return about if across < SAME_AXIS / 2 else None
