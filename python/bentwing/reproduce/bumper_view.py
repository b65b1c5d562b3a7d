# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fig. 26 of Kaul 2015: half a revolution of points, and the bumper's map with its springs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.flight.control import BumperSettings, CarrierState, VirtualBumper
from bentwing.report.colours import HEIGHT
from bentwing.report.picture import render
from bentwing.report.svg import GRID, INK, map_view, open_svg, text
from bentwing.reproduce.figure import Figure
from bentwing.simulate.push.places import free_start
from bentwing.simulate.push.quadrotor import Quadrotor, QuadrotorSettings
from bentwing.simulate.push.sensing import scan
from bentwing.simulate.scenes import SCENES, World

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_SPIN_RATE = np.radians(250.0)
_HALF_TURN = np.pi / _SPIN_RATE
_SWEEP = 0.01  # s
_SIZE, _SHOWN = 560, 4.0  # pixels, m from the carrier
_SCALE = 0.5  # m of green arrow per m/s²
_FREE, _TAKEN, _SPRING, _FORCE, _HEADING = "#f4f6f8", "#3c4653", "#e0a800", "#3a9d4f", "#7b4fa3"


def bumper_figures(seed: int) -> list[Figure]:
    """Hover in an office near structure and draw what is seen and what it does to the carrier."""
    rng = np.random.default_rng(seed)
    world = World(SCENES["office"](rng))
    carrier = Quadrotor(QuadrotorSettings(), free_start(world, rng, 0.85), np.zeros(3), 0.6)
    bumper, clouds = VirtualBumper(BumperSettings()), []
    times = _SWEEP * np.arange(1, round(_HALF_TURN / _SWEEP) + 1)
    for time in times:
        points = scan(world, carrier, np.array([_SPIN_RATE * time]), rng)
        bumper.add_points(float(time), carrier.position, points)
        clouds.append(points)
    dense = np.concatenate(clouds)
    below_ceiling = dense[dense[:, 2] < carrier.position[2] + 0.8]
    x, y, z = (below_ceiling - carrier.position).T
    view = render(x, y, z, z + carrier.position[2], width=800, max_height=800)
    map_a = map_view(view, "height, m", HEIGHT, name="points of half a revolution")
    return [
        Figure("fig26a", map_a, "Fig. 26a", "Points of half a revolution in an office, 0.72 s."),
        Figure(
            "fig26b",
            _springs(bumper, carrier, float(times[-1])),
            "Fig. 26b",
            "The bumper's map on a grid of 1 m: free space (pale), occupied cells (dark), the hull, "
            "springs (yellow), heading (purple), and the push that they add up to (green).",
        ),
    ]


def _springs(bumper: VirtualBumper, carrier: Quadrotor, time: float) -> str:
    state = CarrierState(time, carrier.position, carrier.velocity, carrier.yaw)
    command = bumper.command(time, state, pilot_roll=0.0, pilot_pitch=0.0)
    here, cell = carrier.position[:2], bumper.settings.grid.cell
    hull = bumper.settings.hull_radius
    parts = [open_svg(_SIZE, _SIZE, "the bumper's map with virtual springs")]
    parts.append(f'<rect width="{_SIZE}" height="{_SIZE}" fill="#d9dee4"/>')
    parts += _cells(bumper.grid.free(time) - here, cell, _FREE)
    parts += _grid_lines(here)
    parts += _cells(bumper.grid.occupied(time) - here, cell, _TAKEN)
    for direction, gap in zip(command.springs.directions, command.springs.gaps, strict=True):
        parts.append(_arrow(direction * (gap + hull), _SPRING, 1.4))
    middle, radius = _SIZE / 2, hull * _SIZE / (2 * _SHOWN)
    parts.append(
        f'<circle cx="{middle}" cy="{middle}" r="{radius:.1f}" fill="none" stroke="{INK}" '
        'stroke-width="1.5"/>'
    )
    parts.append(_arrow(np.array([np.cos(carrier.yaw), np.sin(carrier.yaw)]), _HEADING, 3.0))
    parts.append(_arrow(_SCALE * command.push, _FORCE, 4.0))
    size = float(np.linalg.norm(command.push))
    parts.append(text(8, _SIZE - 10, f"push {size:.2f} m/s²", "start", INK, 14))
    return "".join([*parts, "</svg>"])


def _pixel(place: Array) -> tuple[float, float]:
    scale = _SIZE / (2 * _SHOWN)
    return _SIZE / 2 + scale * float(place[0]), _SIZE / 2 - scale * float(place[1])


def _cells(centres: Array, cell: float, ink: str) -> list[str]:
    edge = cell * _SIZE / (2 * _SHOWN)
    corners = (_pixel(centre + np.array([-cell, cell]) / 2) for centre in centres)
    return [
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{edge + 0.3:.1f}" height="{edge + 0.3:.1f}" fill="{ink}"/>'
        for x, y in corners
    ]


def _grid_lines(here: Array) -> list[str]:
    parts = []
    for axis in (0, 1):
        first = np.ceil(here[axis] - _SHOWN)
        for at in np.arange(first, here[axis] + _SHOWN) - here[axis]:
            x, y = _pixel(np.array([at, at]))
            ends = f"M{x:.1f} 0V{_SIZE}" if axis == 0 else f"M0 {y:.1f}H{_SIZE}"
            parts.append(f'<path d="{ends}" stroke="{GRID}" stroke-width="1.2"/>')
    return parts


def _arrow(to: Array, ink: str, width: float) -> str:
    length = float(np.linalg.norm(to))
    if length < 0.05:
        return ""
    along, across = to / length, np.array([-to[1], to[0]]) / length
    head = min(0.05 * width, 0.4 * length)
    neck = to - head * along
    tip = " ".join(
        "{:.1f},{:.1f}".format(*_pixel(p))
        for p in (to, neck + 0.5 * head * across, neck - 0.5 * head * across)
    )
    (x0, y0), (x1, y1) = _pixel(np.zeros(2)), _pixel(neck)
    return (
        f'<path d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}" stroke="{ink}" stroke-width="{width}"/>'
        f'<polygon points="{tip}" fill="{ink}"/>'
    )
