# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `lidar`."""

from __future__ import annotations

import os
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, ValidationInfo, field_validator, model_validator

from bentwing.base.units import Unit
from bentwing.recording.attributes import stored_name
from bentwing.recording.lidar_kinds import KIND_DEFAULTS, LidarKind, PacketModel
from bentwing.recording.sections.beams import Beams
from bentwing.recording.sections.ranges import Ranges
from bentwing.recording.sections.section import NonNegative, Offset, Positive, Section, Topic

# s; what is beyond is taken off the stamps when they are read. An estimator follows a latency from
# where it starts, but holds inertial samples for 50 ms beyond the newest point only.
MAX_ESTIMATED_LATENCY = 0.05


TimeUnit = Literal["s", "ms", "us", "ns"]
TimeReference = Literal["start", "middle", "end", "absolute"]
FARTHEST = 10_000.0  # m; beams are followed cell by cell to their ends


class Lidar(Section):
    """The lidar.

    Attributes
    ----------
    topic : None for the only topic of a lidar type in the recording
    kind : decides the defaults of ranges and noise
    model : of a Velodyne, where its raw packets do not identify it
    metadata : JSON file of an Ouster, relative to the payload file, where the recording has none
    min_range, max_range : m, closest and farthest return that is kept; default: by `kind`
    range_sigma : m, one standard deviation of a range; default: by `kind`
    time_field : of its clouds, with the time of each point; None: found by its name
    time_unit : of that field; None: found from its values
    time_reference : which moment of a sweep its stamp tells (start, middle or end), or absolute where the
        times count from the epoch or power-on and need no stamp; None: found
    latency : s, its stamps minus the IMU's clock; estimators start from it
    mirrored : its scans run the other way: y of every point is negated
    range_scale : m per unit of the ranges in the recording; 0.001 for millimetres
    beams : by how much each beam of a multi-beam lidar is off; None for not at all
    attributes : further fields of its points that the map carries, by their names in the messages
    ranges : by how much all ranges are too long; estimators start from it
    """

    topic: Topic | None = None
    kind: LidarKind = "generic"
    model: PacketModel | None = None
    metadata: Annotated[str, Field(min_length=1)] | None = None
    min_range: Annotated[NonNegative, Unit("m")] = 0.0
    max_range: Annotated[Positive, Field(le=FARTHEST), Unit("m")] = 0.0
    range_sigma: Annotated[Positive, Unit("m, one standard deviation")] = 0.0
    time_field: Annotated[str, Field(min_length=1)] | None = None
    time_unit: TimeUnit | None = None
    time_reference: TimeReference | None = None
    latency: Offset = 0.0
    mirrored: bool = False
    range_scale: Annotated[Positive, Unit("m per unit of the recording")] = 1.0
    beams: Beams | None = None
    attributes: tuple[Annotated[str, Field(min_length=1)], ...] = ()
    ranges: Ranges | None = None

    @model_validator(mode="before")
    @classmethod
    def _defaults_by_kind(cls, data: Any) -> Any:  # noqa: ANN401 - before validation
        if not isinstance(data, dict):
            return data
        kind = data.get("kind", "generic")
        # An unknown kind is reported by its own field.
        defaults = KIND_DEFAULTS[kind if kind in get_args(LidarKind) else "generic"]
        names = ("min_range", "max_range", "range_sigma")
        return {name: getattr(defaults, name) for name in names} | data

    @field_validator("metadata")
    @classmethod
    def _beside_payload(cls, value: str | None, info: ValidationInfo) -> str | None:
        folder = (info.context or {}).get("folder")
        return value if value is None or folder is None else os.path.normpath(folder / value)

    @model_validator(mode="after")
    def _ordered_ranges(self) -> Lidar:
        if self.min_range >= self.max_range:
            msg = f"min_range {self.min_range:g} m must be below max_range {self.max_range:g} m"
            raise ValueError(msg)
        return self

    @field_validator("attributes")
    @classmethod
    def _each_once(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        names = [stored_name(name).lower() for name in value]
        if twice := [v for v, name in zip(value, names, strict=True) if names.count(name) > 1]:
            msg = f"{twice[-1]} is named twice"
            raise ValueError(msg)
        return value

    def differing(self) -> dict[str, Any]:
        """Return the fields that differ from the defaults of this kind."""
        of_kind = type(self).model_validate({"kind": self.kind})
        defaults = dict(of_kind) | {"kind": "generic"}
        return {name: value for name, value in self if value != defaults[name]}

    @property
    def latency_read(self) -> float:
        """The latency that is taken off the stamps when they are read, s: all of a large one."""
        return self.latency if abs(self.latency) > MAX_ESTIMATED_LATENCY else 0.0

    @property
    def latency_left(self) -> float:
        """The latency that estimators start from, s: of stamps as they are read."""
        return self.latency - self.latency_read
