# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sizes, masses and coefficients of the carrier and its spun head, each with where it is from.

What Kaul 2015 states is taken from there (section 3); the rest is estimated from it, from textbook
aerodynamics, or from data sheets of such parts, and says so. The vanes' exposure and the drag of
their frame were estimated anew after first runs had shown more stalls than expected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

GRAVITY = 9.80665
AIR_DENSITY = 1.2
"""kg/m³, at 20 °C near sea level."""


@dataclass(frozen=True, slots=True)
class Carrier:
    """The quadrotor as the vanes feel it.

    Attributes
    ----------
    mass : kg; ideal induced power is then 43 % of the 550 W that hover takes (section 5.1), as
        propeller (0.6), motor and ESC (0.75) together let through
    rotor_radius : m, 15-inch propellers, usual at this mass
    hub_distance : m, rotor axes from the centre; neighbours leave a gap of 0.16 m, the "larger
        gaps" of section 5
    wake_depth : m, of the vanes below the rotor discs (Figs. 2 and 5)
    """

    mass: float = 4.0
    rotor_radius: float = 0.19
    hub_distance: float = 0.38
    wake_depth: float = 0.25

    @property
    def hover_induced(self) -> float:
        """Induced velocity at the discs in hover, m/s: momentum theory, √(T / 2ρA)."""
        area = 4 * math.pi * self.rotor_radius**2
        return math.sqrt(self.mass * GRAVITY / (2 * AIR_DENSITY * area))

    @property
    def development(self) -> float:
        """Wake speed at the vanes in units of that at the disc: vortex tube, 1 + z/√(R² + z²)."""
        return 1.0 + self.wake_depth / math.hypot(self.rotor_radius, self.wake_depth)

    @property
    def wake_radius(self) -> float:
        """Of the contracted wake at the vanes, m: continuity."""
        return self.rotor_radius / math.sqrt(self.development)


@dataclass(frozen=True, slots=True)
class Vanes:
    """One arm's vanes, as flat plates.

    Attributes
    ----------
    area : m², of all blades of an arm: five of 0.16 × 0.03 m (Fig. 7)
    exposure : share of the area that a horizontal flow meets: of five blades that stand behind
        each other in one frame the first; all of a single flap (section 3.2.2)
    frame_area : m², of the frame around them as seen along the circle
    frame_drag_nose, frame_drag_back : drag coefficients of its convex nose and concave back: half
        tubes (1.2 and 2.3 in two dimensions, Hoerner 1965) times 0.62 for their aspect ratio of 5
    normal_most : normal force coefficient of a plate across the flow, aspect ratio 5 (Hoerner 1965)
    normal_slope : 1/rad, its slope at small angles; thin plates of this aspect ratio give 4.5
        (Prandtl), a cascade of small ones at Reynolds number 20,000 less
    friction : coefficient along the plate, laminar, both sides
    """

    area: float = 0.024
    exposure: float = 0.2
    frame_area: float = 0.005
    frame_drag_nose: float = 0.75
    frame_drag_back: float = 1.4
    normal_most: float = 1.2
    normal_slope: float = 3.0
    friction: float = 0.03


SINGLE_FLAP = Vanes(exposure=1.0, frame_area=0.0)
"""The first, "rather large, single flaps": the same area in one plate, no frame (Fig. 4)."""


@dataclass(frozen=True, slots=True)
class Head:
    """The turning part.

    Attributes
    ----------
    arm : m, from the axis to the middle of the vanes: under the rotors' hubs
    inertia : kg m²: 94 g of vanes at the arm's end (0.0136), two booms of 15 g (0.0014) and
        615 g of sensors within 0.06 m (0.0022), masses from section 3.2.2
    friction : N m, of a single-row ball bearing in thin oil and a slip ring with 12 wires;
        data sheets of such rings give 0.01
    breakaway : at rest the friction is this many times larger
    servo_rate : rad/s, hobby servo, 0.12 s for 60°
    servo_lag : s, of its loop
    """

    arm: float = 0.38
    inertia: float = 0.0172
    friction: float = 0.012
    breakaway: float = 1.5
    servo_rate: float = math.radians(500.0)
    servo_lag: float = 0.05


@dataclass(frozen=True, slots=True)
class Flow:
    """How the wakes spread.

    Attributes
    ----------
    edge : m, half-width of the wake's edge: its shear layer (0.1 z) and the extent of the vanes
    hub_loss : share of the speed that is missing under a hub
    hub_radius : of that, in rotor radii: root cut-out and motor
    gap : share of the speed between the wakes ("virtually no vertical airflow")
    turbulence : standard deviation of each wake's speed, share; free jets at z/D < 1
    turbulence_time : s, passage of an eddy of the rotor's size
    ring_state : additional share per share of descent in units of the induced velocity: the
        vortex ring state shakes thrust by 30 % and more (Leishman 2006, section 2.13)
    """

    edge: float = 0.045
    hub_loss: float = 0.6
    hub_radius: float = 0.2
    gap: float = 0.03
    turbulence: float = 0.1
    turbulence_time: float = 0.08
    ring_state: float = 0.6


@dataclass(frozen=True, slots=True)
class PlantSettings:
    """A carrier with a spun head; `arm_separation` in rad, π in the first design, 3π/4 in the last."""

    carrier: Carrier = Carrier()
    vanes: Vanes = Vanes()
    head: Head = Head()
    flow: Flow = Flow()
    arm_separation: float = 0.75 * np.pi
