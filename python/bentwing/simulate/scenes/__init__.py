# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scenes by name; each is built from a seed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.simulate.scenes.campus import campus
from bentwing.simulate.scenes.carpark import carpark
from bentwing.simulate.scenes.cave import cave
from bentwing.simulate.scenes.compound import compound
from bentwing.simulate.scenes.courtyard import courtyard
from bentwing.simulate.scenes.dam import dam
from bentwing.simulate.scenes.forest import forest
from bentwing.simulate.scenes.mine import mine
from bentwing.simulate.scenes.mocap import mocap
from bentwing.simulate.scenes.office import office
from bentwing.simulate.scenes.street import street
from bentwing.simulate.scenes.town import town
from bentwing.simulate.scenes.walls import walls
from bentwing.simulate.scenes.world import Site, Survey, World

if TYPE_CHECKING:
    from collections.abc import Callable


__all__ = ["SCENES", "Site", "Survey", "World"]

SCENES: dict[str, Callable[..., Site]] = {
    "courtyard": courtyard,
    "compound": compound,
    "office": office,
    "forest": forest,
    "cave": cave,
    "mine": mine,
    "town": town,
    "walls": walls,
    "dam": dam,
    "mocap": mocap,
    "carpark": carpark,
    "campus": campus,
    "street": street,
}
