# SPDX-License-Identifier: MIT OR Apache-2.0
"""Loops that a user names: two times of a recording at which the carrier was in the same place, or was not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field, ValidationError, model_validator

from bentwing.base.errors import InputError
from bentwing.base.settings import Settings
from bentwing.base.transform import from_poses
from bentwing.base.units import Unit
from bentwing.base.validation import describe
from bentwing.base.yaml_files import read_yaml
from bentwing.recording.sections.section import Transform  # noqa: TC001 - pydantic reads it

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray
    from typing_extensions import Self

_Time = Annotated[float, Field(ge=0, le=1e9), Unit("s")]


class NamedLoop(Settings):
    """Two times that belong together, or do not."""

    times: tuple[_Time, _Time] = Field(description="since the recording's start")
    same: bool = Field(default=True, description="whether both times saw the same place")
    transform: Transform | None = Field(
        default=None,
        description="pose of the IMU at the second time as seen from that at the first; default: what is "
        "seen at both times tells it",
    )

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        first, second = self.times
        if first == second:
            msg = f"times [{first:g}, {second:g}] are one; give two"
            raise ValueError(msg)
        if self.transform is not None and not self.same:
            msg = (
                "has a transform, and says that the places are not the same: leave one of them out"
            )
            raise ValueError(msg)
        if self.transform is not None and self.transform.from_tf is not None:
            msg = "transform: from_tf says nothing of two times; give translation and rotation"
            raise ValueError(msg)
        return self

    @property
    def T_first_second(self) -> NDArray[np.float64] | None:
        """The transform as matrix (4, 4)."""
        if self.transform is None:
            return None
        given = self.transform
        return from_poses(np.array(given.translation), np.array(given.quaternion))

    def __str__(self) -> str:
        first, second = self.times
        return f"{first:g} s and {second:g} s"


class _LoopFile(Settings):
    loops: tuple[NamedLoop, ...] = Field(min_length=1)


def read_loops(path: Path) -> tuple[NamedLoop, ...]:
    """Read the file of --loops.

    Raises
    ------
    InputError
        If it cannot be read, or names no loops.
    """
    held = read_yaml(path, "give a YAML file of loops", InputError)
    try:
        return _LoopFile.model_validate(held).loops
    except ValidationError as error:
        msg = (
            f"{describe(error, _LoopFile, path)}; give loops as `loops: [{{times: [12.0, 95.5]}}]`"
        )
        raise InputError(msg) from None
