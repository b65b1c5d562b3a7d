# SPDX-License-Identifier: MIT OR Apache-2.0
"""The ways in which a payload.yaml may give a rigid transform, turned into translation and quaternion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.recording.urdf import urdf_transform

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

OTHER_FORMS = ("rpy", "rpy_deg", "matrix", "from_urdf")
ROTATIONS = ("quaternion", *OTHER_FORMS, "from_tf")
COMPLETE = ("matrix", "from_tf", "from_urdf")  # these have the translation in them
URDF_KEYS = ("file", "parent", "child")
MAX_SKEW = 2e-3  # of RᵀR from the identity; rounding to three digits is repaired, worse is refused
MAX_ROW_ERROR = 1e-6  # of the last row of a matrix
MAX_TURN = 2 * np.pi  # rad; beyond it an angle is in degrees


def as_quaternion(given: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return the keys of a transform with its rotation as quaternion; what else is there stays.

    Parameters
    ----------
    folder : of the payload file, from which the files that it names are found

    Raises
    ------
    ValueError
        A form cannot be a rigid transform, or two of them are given; the sentence names the figure.
    """
    forms = [name for name in ROTATIONS if name in given]
    if len(forms) > 1:
        msg = f"gives the rotation as {' and as '.join(forms)}: leave all but one out"
        raise ValueError(msg)
    form = forms[0] if forms else ""
    if form in COMPLETE and "translation" in given:
        msg = f"has translation beside {form}, which has it already: leave translation out"
        raise ValueError(msg)
    if form not in OTHER_FORMS:
        return given
    rest = {name: value for name, value in given.items() if name != form}
    if form == "from_urdf":
        return rest | _of_urdf(given[form], folder)
    if form == "matrix":
        R, t = _rigid(given[form])
        return rest | {"translation": t.tolist(), "quaternion": _listed(geometry.from_matrices(R))}
    return rest | {"quaternion": _listed(geometry.from_rpy(_angles(form, given[form])))}


def _of_urdf(given: Any, folder: Path) -> dict[str, list[float]]:  # noqa: ANN401 - whatever the file holds
    is_whole = isinstance(given, dict) and set(given) == set(URDF_KEYS)
    if not is_whole or not all(isinstance(word, str) and word for word in given.values()):
        msg = f"from_urdf names file, parent and child, found {str(given)[:60]}"
        raise ValueError(msg)
    return urdf_transform(folder / given["file"], given["parent"], given["child"])


def _angles(form: str, given: Any) -> NDArray[np.float64]:  # noqa: ANN401 - whatever the file holds
    """Return roll, pitch and yaw, rad."""
    unit, scale = ("deg", np.pi / 180) if form == "rpy_deg" else ("rad", 1.0)
    expected = f"{form} is [roll, pitch, yaw] in {unit} about the fixed axes x, y, z"
    angles = _numbers(given, (3,), expected) * scale
    if (largest := np.abs(angles).max()) > MAX_TURN:
        hint = "; give degrees as rpy_deg" if form == "rpy" else ""
        msg = f"{form} has an angle of {largest / scale:.4g} {unit}, more than a whole turn{hint}"
        raise ValueError(msg)
    return angles


def _rigid(given: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # noqa: ANN401 - as above
    """Return rotation (3, 3) and translation (3,), m, of a matrix of four rows."""
    T = _numbers(given, (4, 4), "matrix is 4 rows of 4 numbers")
    last = T[3]
    if np.abs(last - (0.0, 0.0, 0.0, 1.0)).max() > MAX_ROW_ERROR:
        msg = f"matrix has the last row {last.tolist()}, expected [0, 0, 0, 1]: give it by rows"
        raise ValueError(msg)
    R, t = T[:3, :3], T[:3, 3]
    # Damage of any size must not overflow on the way to the sentence that says so.
    skew = np.abs(R.T @ R - np.eye(3)).max() if np.abs(R).max() < 1e3 else np.abs(R).max()
    if not skew <= MAX_SKEW:
        msg = (
            f"matrix is no rotation: its columns are off being unit and at right angles by {skew:.3g}, "
            f"at most {MAX_SKEW:g} is rounding"
        )
        raise ValueError(msg)
    if (det := np.linalg.det(R)) < 0:
        msg = f"matrix mirrors (determinant {det:.3g}): one axis is reversed, a rotation has +1"
        raise ValueError(msg)
    U, _, Vh = np.linalg.svd(R)  # the rotation that is nearest to what was rounded
    return U @ Vh, t


def _numbers(given: Any, shape: tuple[int, ...], expected: str) -> NDArray[np.float64]:  # noqa: ANN401
    try:
        numbers = np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        numbers = np.full(shape, np.nan)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        msg = f"{expected}, found {str(given)[:60]}"
        raise ValueError(msg)
    return numbers


def _listed(quat: NDArray[np.float64]) -> list[float]:
    return [float(x) for x in quat]
