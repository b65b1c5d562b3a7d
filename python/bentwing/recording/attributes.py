# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fields of a lidar's points that nothing here needs, carried to the map where they are asked for."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import PayloadError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

_LONGEST = 32  # characters of a name in LAS
_TYPES = frozenset(("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"))
_TAKEN = frozenset((
    "x", "y", "z", "intensity", "return_number", "number_of_returns", "synthetic", "key_point", "withheld",
    "overlap", "scanner_channel", "scan_direction_flag", "edge_of_flight_line", "classification",
    "raw_classification", "classification_flags", "bit_fields", "user_data", "scan_angle", "scan_angle_rank",
    "point_source_id", "gps_time", "red", "green", "blue", "nir", "time", "range", "ring", "incidence",
    "thickness", "shift", "sigma", "run_id", "height", "normal_x", "normal_y", "normal_z", "nx", "ny", "nz",
))  # fmt: skip
"""Names of the columns of a map, in lower case, and of those that LAS has in every file."""


def stored_name(name: str) -> str:
    """Return the name of a field in a map: that of the recording, unless a map has another such column."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return (f"sensor_{plain}" if plain.lower() in _TAKEN else plain)[:_LONGEST]


def selectable(fields: Mapping[str, Any]) -> dict[str, np.dtype[Any]]:
    """Return the fields that can be carried, of all those of a message with their types."""
    dtypes = {name: np.dtype(kind).newbyteorder("=") for name, kind in fields.items()}
    return {name: dtype for name, dtype in dtypes.items() if dtype.str[1:] in _TYPES}


@dataclass(frozen=True, slots=True)
class Attributes:
    """The fields that are carried.

    Attributes
    ----------
    sources : their names in the messages
    dtype : of the structure that they become
    """

    sources: tuple[str, ...] = ()
    dtype: np.dtype[np.void] = np.dtype([])  # noqa: RUF009 - types are never changed

    @classmethod
    def of(
        cls, wanted: Sequence[str], fields: Mapping[str, np.dtype[Any]], topic: str
    ) -> Attributes:
        """Find the fields that are asked for, whether in upper or in lower case.

        Parameters
        ----------
        wanted : names
        fields : that the first messages of the topic have, see `selectable`

        Raises
        ------
        PayloadError
            If there is no such field.
        """
        by_name = {name.lower(): name for name in fields}
        lacking = [name for name in wanted if name not in fields and name.lower() not in by_name]
        if lacking:
            msg = (
                f"{topic}: its points have no field {' or '.join(lacking)}; attributes can be "
                f"{', '.join(fields) or 'none'}"
            )
            raise PayloadError(msg)
        sources = tuple(name if name in fields else by_name[name.lower()] for name in wanted)
        columns = [(stored_name(n), fields[s]) for n, s in zip(wanted, sources, strict=True)]
        return cls(sources, np.dtype(columns))

    def gathered(self, n: int, column: Callable[[str], NDArray[Any]]) -> NDArray[np.void] | None:
        """Return the fields of points (N,); None where none is asked for.

        Parameters
        ----------
        column : returns the values (N,) of a field by its name in the messages
        """
        if not self.sources:
            return None
        table = np.empty(n, self.dtype)
        for source, name in zip(self.sources, self.dtype.names or (), strict=True):
            table[name] = column(source)
        return table


NO_ATTRIBUTES = Attributes()
