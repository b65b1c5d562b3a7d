# SPDX-License-Identifier: MIT OR Apache-2.0
"""All effects of a recording: which are asked for, what was drawn, and where they act."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from bentwing._core import Scene
from bentwing.simulate.ranging import Body, RangeEffect, Surfaces
from bentwing.simulate.realism.beams import BeamErrors, draw_beams
from bentwing.simulate.realism.divergence import draw_divergence
from bentwing.simulate.realism.effect import recorded
from bentwing.simulate.realism.glass import draw_glass
from bentwing.simulate.realism.inertial import InertialResponse, draw_response
from bentwing.simulate.realism.motor import AskewEncoder, draw_encoder, draw_wobble
from bentwing.simulate.realism.mount import draw_mount
from bentwing.simulate.realism.ranges import Clutter, FarNoise, Grazing, Patches, Reading
from bentwing.simulate.realism.samples import Samples
from bentwing.simulate.realism.shocks import Shocks, draw_shocks
from bentwing.simulate.realism.stamps import Host, draw_host
from bentwing.simulate.realism.wind import draw_wind
from bentwing.simulate.scenes.mesh import FOLIAGE, GLASS
from bentwing.simulate.scenes.world import face_normals

if TYPE_CHECKING:
    from bentwing.simulate.lidars.interface import Lidar
    from bentwing.simulate.names import RealismGroup
    from bentwing.simulate.rig import Rig
    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.scenes import World

Effect = TypeVar("Effect")


@dataclass(frozen=True, slots=True)
class Realism:
    """Draws the effects of one scenario, each from random numbers of its own.

    Attributes
    ----------
    duration : s, from the start of the motion to the end of the recording
    draws : by group and name, what was drawn so far
    """

    scenario: Scenario
    duration: float
    draws: dict[str, dict[str, Any]] = field(default_factory=dict)

    def truth(self) -> dict[str, Any]:
        """Return the level, and what was drawn."""
        return {"level": self.scenario.realism, **self.draws}

    def samples(self, rig: Rig) -> Samples | None:
        """Collect true places of returns wherever there is any effect."""
        return Samples(rig) if self.scenario.realism else None

    def rig(self, rig: Rig) -> Rig:
        """Return the rig with an elastic mount, a shaft that wobbles and an encoder askew."""
        head = rig.head
        if self._level("mount"):
            mount = draw_mount(*self._draw("mount"), rig.carrier, self.duration)
            self._keep("mount", "elastic_mount", mount)
            head = replace(head, to_lidar=[*mount.joints(), *head.to_lidar])
        if self._level("motor") and head.encoder is not None:
            rng, level = self._draw("motor")
            errors = self._keep("motor", "encoder", draw_encoder(rng, level))
            wobble = draw_wobble(rng, level, head.encoder.angle, self.duration)
            self._keep("motor", "wobble", wobble)
            # The shaft is the last joint but one: behind it only the lidar is mounted.
            joints = [*head.to_lidar[:-2], *wobble.joints(), *head.to_lidar[-2:]]
            head = replace(head, to_lidar=joints, encoder=AskewEncoder.of(head.encoder, errors))
        return replace(rig, head=head)

    def bodies(self, world: World, max_range: float) -> list[Body]:
        """Return the surfaces of the world."""
        body: Body = Surfaces(world.scene, world.normals, max_range)
        others: list[Body] = []
        if self._level("scene"):
            rng, level = self._draw("scene")
            mesh = world.site.mesh
            sways = mesh.of(FOLIAGE)
            still = mesh.only(~sways)
            surfaces = Scene(still.vertices, still.triangles), face_normals(still)
            glass = draw_glass(rng, level, surfaces, still.of(GLASS), max_range)
            body = self._keep("scene", "glass", glass)
            if sways.any():
                wind = draw_wind(rng, level, mesh.only(sways), max_range)
                others.append(self._keep("scene", "wind", wind))
        if self._level("ranges"):
            body = self._keep(
                "ranges", "divergence", draw_divergence(*self._draw("divergence"), body)
            )
        return [body, *others]

    def beams(self, lidar: Lidar) -> BeamErrors | None:
        """Return the errors of each beam of a multi-beam lidar."""
        if not self._level("ranges") or not lidar.rings:
            return None
        drawn = draw_beams(*self._draw("beams"), lidar.rings, lidar.beam_sigma)
        return self._keep("ranges", "beams", drawn)

    def ranges(self, beams: BeamErrors | None) -> list[RangeEffect]:
        """Return what makes ranges wrong."""
        if not self._level("ranges"):
            return []
        rng, level = self._draw("ranges")
        named: dict[str, RangeEffect] = {
            "reading": Reading.draw(rng, level),
            "grazing": Grazing.draw(rng, level),
            "patches": Patches.draw(rng, level),
            "far_noise": FarNoise(1e-3 * level, np.random.default_rng(rng.integers(2**63))),
            "clutter": Clutter.draw(rng, level),
        }
        for name, effect in named.items():
            self._keep("ranges", name, effect)
        return [*([beams] if beams else []), *named.values()]

    def response(self) -> InertialResponse | None:
        """Return how the IMU answers."""
        if not self._level("imu"):
            return None
        return self._keep("imu", "response", draw_response(*self._draw("imu")))

    def shocks(self) -> Shocks | None:
        """Return what shakes the IMU."""
        if not self._level("shocks"):
            return None
        return self._keep("shocks", "shocks", draw_shocks(*self._draw("shocks"), self.duration))

    def host(self) -> Host | None:
        """Return the computer that gives the stamps."""
        if not self._level("stamps"):
            return None
        host = draw_host(*self._draw("stamps"), self.duration)
        for name in ("lidar", "imu", "encoder"):
            self._keep("stamps", name, getattr(host, name))
        self.draws["stamps"]["gaps"] = [[round(t, 6) for t in gap] for gap in host.gaps]
        return host

    def _level(self, group: RealismGroup) -> float:
        return self.scenario.realism_of(group)

    def _draw(self, purpose: str) -> tuple[np.random.Generator, float]:
        return self.scenario.rng(f"real {purpose}"), self.scenario.realism

    def _keep(self, group: RealismGroup, name: str, effect: Effect) -> Effect:
        self.draws.setdefault(group, {})[name] = recorded(effect)
        return effect
