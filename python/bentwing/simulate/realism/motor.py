# SPDX-License-Identifier: MIT OR Apache-2.0
"""A motor whose encoder sits askew, whose shaft wobbles and whose gears have play."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.heads.joints import Joint, Turn
from bentwing.simulate.realism.effect import of_about
from bentwing.simulate.rig import Encoder
from bentwing.simulate.splines import Spline, knot_times

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

STEP = 0.02
"""s, between the controls of the wobble."""
N_STEPS = 4096
"""Of the encoder in a turn."""


@dataclass(frozen=True, slots=True)
class EncoderErrors:
    """What an encoder reads.

    Attributes
    ----------
    eccentricity : rad, error once a turn
    phase : rad, where it is zero
    backlash : rad, between the angles read at one place in both directions
    delay : s, by which the angle is older than its stamp
    n_steps : of a turn
    """

    eccentricity: float
    phase: float
    backlash: float
    delay: float
    n_steps: int = N_STEPS


@dataclass(frozen=True, slots=True)
class AskewEncoder(Encoder):
    """An encoder with errors."""

    errors: EncoderErrors

    @classmethod
    def of(cls, encoder: Encoder, errors: EncoderErrors) -> AskewEncoder:
        """Return an encoder with errors on the same motor."""
        return cls(encoder.angle, encoder.zero, encoder.sigma, errors)

    def read(self, times: Array) -> Array:
        """Return the angle (N,), rad, that it reads without noise."""
        e, then = self.errors, times - self.errors.delay
        true, rate = self.angle(then)[:, 0], self.angle(then, 1)[:, 0]
        askew = e.eccentricity * np.sin(true + e.phase)
        step = 2 * np.pi / e.n_steps
        read = true - self.zero + askew - 0.5 * e.backlash * np.sign(rate)
        return np.asarray(np.round(read / step) * step)


@dataclass(frozen=True, slots=True)
class Wobble:
    """Tilt of the shaft about x and y of the motor's frame, once and twice a turn.

    Attributes
    ----------
    sizes, phases : (2, 2) rad; of the two axes, once and twice a turn
    tilts : about x and y
    """

    sizes: Array
    phases: Array
    tilts: tuple[Spline, ...] = field(repr=False)

    def joints(self) -> list[Joint]:
        """Return joints to be followed by the motor's own."""
        return [Turn(axis, tilt) for axis, tilt in zip(np.eye(3)[:2], self.tilts, strict=True)]


def draw_encoder(rng: np.random.Generator, level: float) -> EncoderErrors:
    """Draw 0.05° once a turn, a play of 0.07° and 0.3 ms, times the level."""
    return EncoderErrors(
        abs(of_about(rng, float(np.radians(0.05)) * level)),
        float(rng.uniform(0.0, 2 * np.pi)),
        abs(of_about(rng, float(np.radians(0.07)) * level)),
        of_about(rng, 3e-4 * level),
    )


def draw_wobble(rng: np.random.Generator, level: float, angle: Spline, duration: float) -> Wobble:
    """Draw tilts of about 0.03° times the level."""
    sizes = np.radians(0.03) * level * rng.uniform(0.7, 1.3, (2, 2))
    phases = rng.uniform(0.0, 2 * np.pi, (2, 2))
    turned = angle(knot_times(STEP, duration))
    tones = np.cos(turned[:, None] * np.array([1.0, 2.0]) + phases)
    tilts = (sizes * tones).sum(axis=-1)
    return Wobble(sizes, phases, tuple(Spline(STEP, tilt[:, None]) for tilt in tilts.T))
