# SPDX-License-Identifier: MIT OR Apache-2.0
"""The section `project`: what a report says of the job, besides what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal
from zoneinfo import ZoneInfo

from pydantic import ConfigDict, Field, ValidationError, field_validator

from bentwing.base.errors import InputError
from bentwing.base.validation import describe
from bentwing.base.yaml_files import read_yaml
from bentwing.recording.sections.section import Section

if TYPE_CHECKING:
    from collections.abc import Mapping

_KEY = "project"
_ADVICE = "give a YAML file with name, number, site, client, contractor, operator, instrument, time_zone, language or remarks"

Words = Annotated[str, Field(max_length=200)]


class Project(Section):
    """What the first page of the report names; all of it is optional.

    Attributes
    ----------
    name, number : of the project
    site : where it is
    client : for whom it is
    contractor : who made it
    operator : who recorded it
    instrument : the sensor head with its serial number; default: the name in payload.yaml
    time_zone : in which times are told, such as Europe/Berlin
    language : of the report, `en` or `de`
    remarks : anything else in a sentence or two
    """

    # A number such as 2024-117 or 4711 is a name, however YAML reads it.
    model_config = ConfigDict(coerce_numbers_to_str=True)

    name: Words = ""
    number: Words = ""
    site: Words = ""
    client: Words = ""
    contractor: Words = ""
    operator: Words = ""
    instrument: Words = ""
    time_zone: Words = "UTC"
    language: Literal["en", "de"] = "en"
    remarks: Annotated[str, Field(max_length=1000)] = ""

    @field_validator("*")
    @classmethod
    def _is_one_line(cls, value: str) -> str:
        line = " ".join(value.split())
        if not line.isprintable():
            msg = "holds control characters; give plain text"
            raise ValueError(msg)
        return line

    @field_validator("time_zone")
    @classmethod
    def _is_a_zone(cls, value: str) -> str:
        try:
            ZoneInfo(value)
        except (KeyError, OSError, ValueError):
            msg = f"{value!r} is no time zone; give one such as Europe/Berlin, or UTC"
            raise ValueError(msg) from None
        return value

    @classmethod
    def load(cls, path: Path | str) -> Project:
        """Read a file that holds these keys, by themselves or below `project:`.

        Raises
        ------
        InputError
        """
        values = read_yaml(Path(path), _ADVICE, InputError)
        if isinstance(values, dict) and set(values) == {_KEY}:
            values = values[_KEY]
        if not isinstance(values, dict) or not values:
            msg = f"{path}: says nothing of a project; {_ADVICE}"
            raise InputError(msg)
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            raise InputError(describe(error, cls, path)) from None

    @property
    def zone(self) -> ZoneInfo:
        """The time zone."""
        return ZoneInfo(self.time_zone)


def as_project(value: Project | Path | str | None) -> Project | None:
    """Return the project, from its file if need be.

    Raises
    ------
    InputError
    """
    return Project.load(value) if isinstance(value, (str, Path)) else value


def project_in(record: Mapping[str, Any]) -> Project | None:
    """Return the project that a run's record names: its own, or the payload's."""
    settings = record.get("settings") or {}
    said = record.get(_KEY) or settings.get(_KEY) or (settings.get("payload") or {}).get(_KEY)
    return Project.model_validate(said) if said else None
