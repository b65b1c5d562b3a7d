# SPDX-License-Identifier: MIT OR Apache-2.0
"""The pose of one link in another by a robot's URDF: what its fixed joints say, and no more.

Only the joints are read, with the standard library: libraries for URDF load meshes and bring tens of
packages. XML with a DOCTYPE, which alone can hold entities, is refused before it is parsed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular
from bentwing.recording.link_chain import Link, along, chain, listed

if TYPE_CHECKING:
    from pathlib import Path

MOST_BYTES = 16 * 2**20
FIXED = "fixed"
INSTEAD = "give translation and quaternion (or rpy, or matrix) instead of from_urdf"


def urdf_transform(path: Path, parent: str, child: str) -> dict[str, list[float]]:
    """Return translation, m, and quaternion, x y z w, of the pose of link `child` in link `parent`.

    Raises
    ------
    ValueError
        The file cannot be read, or its fixed joints do not join the links; the sentence says why.
    """
    joints = _joints(path)
    fixed = {link.child: link for link, kind in joints if kind == FIXED}
    way = chain(fixed.values(), parent, child)
    if way is None:
        raise ValueError(_why_not(path, joints, parent, child))
    return along(fixed, way)


def _joints(path: Path) -> list[tuple[Link, str]]:
    """Return the joints and their types."""
    root = _root(path)
    found = []
    for joint in root.iter("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is None or child is None:  # as those of transmissions are
            continue
        origin = joint.find("origin")
        given = {} if origin is None else origin.attrib
        name = joint.get("name", "")
        xyz, rpy = (_numbers(path, name, given.get(key, "0 0 0")) for key in ("xyz", "rpy"))
        quat = geometry.from_rpy(np.array(rpy))
        link = Link(
            parent.get("link", ""),
            child.get("link", ""),
            (xyz[0], xyz[1], xyz[2]),
            (float(quat[0]), float(quat[1]), float(quat[2]), float(quat[3])),
        )
        found.append((link, joint.get("type", FIXED)))
    return found


def _root(path: Path) -> ET.Element:
    try:
        require_regular(path)
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
        text = data.decode("utf-8")
    except (OSError, UnicodeDecodeError, InputError) as error:
        msg = f"{path} cannot be read: {error}"
        raise ValueError(msg) from None
    if len(data) > MOST_BYTES:
        msg = f"{path} has more than {MOST_BYTES // 2**20} MiB: give the URDF itself"
        raise ValueError(msg)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        msg = f"{path} has a DOCTYPE, which is not read: remove it"
        raise ValueError(msg)
    try:
        root = ET.fromstring(text.lstrip("\ufeff"))
    except (ET.ParseError, RecursionError) as error:
        msg = f"{path} is no XML ({error}): give the robot's URDF"
        raise ValueError(msg) from None
    if root.tag != "robot":
        msg = f"{path} is no URDF: it begins with <{root.tag}>, not with <robot>"
        raise ValueError(msg)
    if "<xacro:" in text:
        msg = f"{path} has xacro in it: expand it with 'xacro {path.name} > robot.urdf'"
        raise ValueError(msg)
    return root


def _numbers(path: Path, joint: str, text: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        msg = f"{path}: the origin of joint {joint} is {text[:60]!r}, expected three numbers"
        raise ValueError(msg)
    return numbers


def _why_not(path: Path, joints: list[tuple[Link, str]], parent: str, child: str) -> str:
    known = sorted({name for link, _ in joints for name in (link.parent, link.child)})
    for name in (parent, child):
        if name not in known:
            return f"{path} has no joint of a link {name!r}; {listed(known, name, 'it')}"
    way = chain([link for link, _ in joints], parent, child)
    if way is None:
        return f"{path}: no chain of joints joins {parent} and {child}; {INSTEAD}"
    moving = [
        f"{link.parent} and {link.child} ({kind})"
        for link, kind in joints
        if kind != FIXED and link.parent in way and link.child in way
    ]
    return (
        f"{path}: {child} is not fixed on {parent}, a joint moves between {' and between '.join(moving)}; "
        "describe the motor that turns the lidar in the section encoder, with one transform on each side"
    )
