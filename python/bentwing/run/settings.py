# SPDX-License-Identifier: MIT OR Apache-2.0
"""What decides a result: the settings of a run and of a merging, defaults included."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - pydantic reads the annotations
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import yaml
from pydantic import BaseModel, Field, ValidationError, field_validator, model_validator

from bentwing.base.errors import BentwingError, UsageError
from bentwing.base.plain import plain
from bentwing.base.settings import Settings
from bentwing.base.threads import MOST_THREADS
from bentwing.base.units import Metres, Unit
from bentwing.base.validation import describe
from bentwing.closing.georeference.settings import GeoreferenceSettings
from bentwing.closing.global_registration.settings import GlobalSettings
from bentwing.closing.loop_file import NamedLoop  # noqa: TC001 - pydantic reads it
from bentwing.map.clean import CleanSettings
from bentwing.map.formats import MapFormat, require_format, require_room
from bentwing.odometry import (
    ESTIMATORS,
    ContinuousSettings,
    EstimatorName,
    EstimatorSettings,
    KalmanSettings,
    NdtSettings,
    require_estimator,
)
from bentwing.recording import Payload
from bentwing.recording.sections.project import Project  # noqa: TC001 - pydantic reads it

if TYPE_CHECKING:
    from typing_extensions import Self

MOST_SECONDS = 1e9
"""No recording lasts for thirty years."""
SMALLEST_SPACING = 0.001
"""Finer voxels than a millimetre's tell no points apart, m."""

_Model = TypeVar("_Model", bound=BaseModel)


class MapSettings(Settings):
    """How a map is written, of one run or of several."""

    map_format: MapFormat = Field(default="laz", description="file format of the map")
    map_spacing: Metres = Field(
        default=0.0,
        ge=0,
        le=1000,
        description="edge of the voxels that keep one point each; 0 keeps all points",
    )
    cleaning: CleanSettings = Field(default=CleanSettings(), description="what the map leaves out")
    refine: bool = Field(
        default=True,
        description="whether points are moved along their beams to the surface that they measured "
        "together; turn off for the returns as they are",
    )
    normals: bool = Field(
        default=False,
        description="whether points have the normal of their surface, towards the lidar",
    )
    georeferencing: GeoreferenceSettings = Field(
        default=GeoreferenceSettings(), description="how GNSS fixes and control points are used"
    )
    project: Project | None = Field(
        default=None, description="what the first page of the report names; default: the payload's"
    )
    threads: int | None = Field(
        default=None, ge=1, le=MOST_THREADS, description="number of threads; default: all cores"
    )

    @field_validator("map_format", mode="before")
    @classmethod
    def _can_be_written(cls, name: str) -> str:
        return require_format(name)

    @field_validator("map_spacing")
    @classmethod
    def _is_none_or_a_length(cls, spacing: float) -> float:
        if 0 < spacing < SMALLEST_SPACING:
            msg = f"give 0 for all points, or {SMALLEST_SPACING:g} m and more, not {spacing:g} m"
            raise ValueError(msg)
        return spacing

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        require_room(self.map_format, normals=self.normals, attributes=False)
        return self

    def to_json(self) -> dict[str, Any]:
        """Return the settings in plain JSON types, as run.json has them."""
        described: dict[str, Any] = plain(self.model_dump())
        return described


class MergeSettings(MapSettings):
    """What decides a merged map."""

    runs: tuple[Path, ...] = Field(default=(), description="folders of the runs")
    flights: dict[str, tuple[Path, ...]] = Field(
        default_factory=dict,
        description="files of each flight by its name, where the flights are mapped first",
    )
    loop_closure: GlobalSettings = Field(
        default=GlobalSettings(), description="how the runs are registered with each other"
    )


class RunSettings(MapSettings):
    """What decides a run.

    The field named as an estimator has its settings; those of `estimator` count.
    """

    estimator: EstimatorName = Field(default="continuous", description="name of the estimator")
    writes_map: bool = Field(
        default=True, description="whether there is a map; false ends with the trajectory"
    )
    loop_closure: GlobalSettings | Literal[False] = Field(
        default=GlobalSettings(),
        description="how loops are closed; false leaves the trajectory open-loop",
    )
    loops: tuple[NamedLoop, ...] = Field(
        default=(), description="times at which the same place was seen, or not, as a user knows"
    )
    prior_map: Path | None = Field(
        default=None, description="map in which the recording is localized"
    )
    start: Annotated[float | None, Unit("s")] = Field(
        default=None,
        ge=0,
        le=MOST_SECONDS,
        description="time to skip at the start of the recording",
    )
    duration: Annotated[float | None, Unit("s")] = Field(
        default=None,
        ge=0,
        le=MOST_SECONDS,
        description="length of the part to use; default: all of the recording",
    )
    force: bool = Field(
        default=False,
        description="whether a recording that `bentwing info` calls unfit is mapped all the same",
    )
    trust_payload: bool = Field(
        default=False,
        description="whether the payload holds even where the recording shows another set-up",
    )
    continuous: ContinuousSettings = Field(
        default=ContinuousSettings(), description="settings of the continuous estimator"
    )
    kalman: KalmanSettings = Field(
        default=KalmanSettings(), description="settings of the Kalman filter"
    )
    ndt: NdtSettings = Field(default=NdtSettings(), description="settings of the NDT odometry")
    payload: Payload = Field(default_factory=Payload.default, description="the sensor head")

    @model_validator(mode="after")
    def _closes_its_loops(self) -> Self:
        if self.loops and (self.loop_closure is False or self.prior_map is not None):
            what = "loop closure is off" if self.prior_map is None else "a given map closes them"
            msg = f"loops are named, but {what}: leave one of them out"
            raise ValueError(msg)
        return self

    @field_validator("estimator", mode="before")
    @classmethod
    def _is_known(cls, name: str) -> str:
        require_estimator(name)
        return name

    @property
    def of_estimator(self) -> EstimatorSettings:
        """Settings of the estimator that is used."""
        chosen: EstimatorSettings = getattr(self, self.estimator)
        return chosen

    def carrying(self, attributes: tuple[str, ...]) -> Self:
        """Return the same with these further fields of the lidar's points in the map."""
        require_room(self.map_format, normals=False, attributes=bool(attributes))
        return self.model_copy(update={"payload": self.payload.carrying(attributes)})

    @property
    def closing(self) -> GlobalSettings:
        """Settings of the registration that corrects the trajectory."""
        return self.loop_closure or GlobalSettings()

    @property
    def closes_loops(self) -> bool:
        """Whether the trajectory is corrected by places seen again, or by a given map."""
        return self.loop_closure is not False or self.prior_map is not None

    def to_json(self) -> dict[str, Any]:
        """Return the settings in plain JSON types, without those of other estimators."""
        described = super().to_json()
        if self.payload.imu is not None and not self.payload.describes_imu:
            # Its mention would say that the head carries one.
            del described["payload"]["imu"]
        return {k: v for k, v in described.items() if k == self.estimator or k not in ESTIMATORS}

    def to_yaml(self) -> str:
        """Return the settings as YAML that says the same when it is read again."""
        described = self.to_json()
        return yaml.safe_dump(described, sort_keys=False, allow_unicode=True)


def run_settings(**values: Any) -> RunSettings:  # noqa: ANN401 - the model checks them
    """Return the settings of a run.

    Raises
    ------
    UsageError
        If a value is not possible; the sentence names it.
    """
    return validated(RunSettings, values)


def merge_settings(**values: Any) -> MergeSettings:  # noqa: ANN401 - the model checks them
    """Return the settings of a merging; raises as `run_settings` does."""
    return validated(MergeSettings, values)


def validated(
    model: type[_Model],
    values: dict[str, Any],
    source: Path | str = "settings",
    kind: type[BentwingError] = UsageError,
) -> _Model:
    """Return the settings in `values`, or raise an error whose sentence names source and setting."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise kind(describe(error, model, source)) from None
