# SPDX-License-Identifier: MIT OR Apache-2.0
"""ROS 2's message types as DDS knows them, made from the definitions that `rosbags` has.

Messages are not taken apart here: a sample is its bytes, which `recording.messages` reads and writes.
"""

from __future__ import annotations

import functools
import importlib
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from bentwing.base.errors import UsageError

_NUMBERS = {
    "bool": bool, "string": str, "int8": "int8", "uint8": "uint8", "byte": "uint8", "char": "uint8",
    "int16": "int16", "uint16": "uint16", "int32": "int32", "uint32": "uint32", "int64": "int64",
    "uint64": "uint64", "float32": "float32", "float64": "float64",
}  # fmt: skip


def topic_name(name: str) -> str:
    """Return the name of a ROS topic in DDS."""
    return f"rt{name if name.startswith('/') else f'/{name}'}"


def type_name(kind: str) -> str:
    """Return the name of a type, such as sensor_msgs/msg/Imu, in DDS."""
    package, _, name = kind.partition("/msg/")
    return f"{package}::msg::dds_::{name}_"


def kind_of(dds_name: str) -> str | None:
    """Return the type of ROS by its name in DDS, None for one that is not ROS's."""
    package, found, name = dds_name.partition("::msg::dds_::")
    return f"{package}/msg/{name.removesuffix('_')}" if found else None


@functools.cache
def dds_type(kind: str) -> Any:  # noqa: ANN401 - made at run time
    """Return the type of a message for the DDS binding, whose samples `raw_sample` makes."""
    made = _structure(kind)
    # The binding makes and reads the bytes of its samples through these two.
    made.serialize = lambda sample, **_: sample.raw
    made.deserialize = classmethod(lambda cls, data, **_: _of_bytes(cls, bytes(data)))
    return made


def raw_sample(kind: str, raw: bytes) -> Any:  # noqa: ANN401 - of a type made at run time
    """Return a sample with the bytes of a message, CDR with its head, in `raw`."""
    return _of_bytes(dds_type(kind), raw)


def _of_bytes(made: Any, raw: bytes) -> Any:  # noqa: ANN401
    sample = object.__new__(made)
    sample.raw = raw
    return sample


@functools.cache
def _structure(kind: str) -> Any:  # noqa: ANN401 - likewise
    idl: Any = importlib.import_module("cyclonedds.idl")
    _, fields = get_typestore(Stores.ROS2_HUMBLE).fielddefs[kind]
    members = {name: _member(description) for name, description in fields}
    name = type_name(kind)
    made: Any = idl.make_idl_struct(name.rpartition("::")[2], name, members)
    return made


def _member(description: Any) -> Any:  # noqa: ANN401 - as rosbags nests them
    types: Any = importlib.import_module("cyclonedds.idl.types")
    node, value = description
    if node == Nodetype.NAME:
        return _structure(value)
    if node == Nodetype.BASE:
        number = _NUMBERS[value[0]]
        return getattr(types, number) if isinstance(number, str) else number
    inner, count = value
    if node == Nodetype.ARRAY:
        return types.array[_member(inner), count]
    return types.sequence[_member(inner)]


def require_dds() -> None:
    """Refuse to go on without the binding of DDS.

    Raises
    ------
    UsageError
        It is not installed.
    """
    try:
        importlib.import_module("cyclonedds")
    except ImportError as error:
        msg = f"ROS 2 needs cyclonedds, which cannot be loaded ({error}); install it with `pip install cyclonedds`"
        raise UsageError(msg) from None
