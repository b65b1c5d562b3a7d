# SPDX-License-Identifier: MIT OR Apache-2.0
"""What an engine is given of a recording, kept in a folder so that each engine reads the same."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

KINDS = {
    "sweeps": "sweeps as recorded, lidar frame",
    "joined": "put into the IMU frame by the encoder, half seconds joined",
    "stabilized": "lines de-rotated by the gyro, one cloud per half turn",
}


@dataclass(frozen=True, slots=True)
class Head:
    """All but the samples.

    Attributes
    ----------
    kind : of the scans, see `KINDS`
    T_body_lidar : (4, 4) nested; the points' frame in the body's. The body is the IMU, or, of
        stabilized scans, where the IMU is but turned as at the first sample for ever
    rows, columns : of an organised sweep; one row of scans without rings
    period : s, from one scan to the next
    min_range, max_range : m
    noise : densities of the IMU by the names of payload.yaml; empty without IMU
    starts_ns, ends_ns : of the scans, IMU clock
    """

    kind: str
    T_body_lidar: list[list[float]]
    rows: int
    columns: int
    period: float
    min_range: float
    max_range: float
    noise: dict[str, float] = field(default_factory=dict)
    starts_ns: list[int] = field(default_factory=list)
    ends_ns: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Imu:
    """Inertial samples of the body, and the body's attitude.

    Attributes
    ----------
    stamps_ns : (M,)
    gyro, accel : (M, 3) rad/s, m/s²
    R_body_imu : (M, 4) quaternions; the identity but for stabilized scans
    turned : (M, 4) attitude of the IMU by its gyro, relative to the first sample
    """

    stamps_ns: np.ndarray
    gyro: np.ndarray
    accel: np.ndarray
    R_body_imu: np.ndarray
    turned: np.ndarray


@dataclass(frozen=True, slots=True)
class Feed:
    """An opened folder."""

    folder: Path
    head: Head
    imu: Imu | None

    def scans(self) -> Iterator[np.ndarray]:
        """One table of `POINT` after the other, so that memory stays that of the engine."""
        with (self.folder / "scans.npy").open("rb") as file:
            for _ in self.head.starts_ns:
                yield np.load(file)

    def events(self) -> Iterator[tuple[str, int]]:
        """("imu", row) and ("scan", number) in the order in which they become known.

        A scan is known when it is complete and the IMU has been heard once more, so that no
        engine has to extrapolate.
        """
        stamps = np.empty(0, np.int64) if self.imu is None else self.imu.stamps_ns
        row = 0
        for number, end in enumerate(self.head.ends_ns):
            known = min(len(stamps), int(np.searchsorted(stamps, end)) + 1)
            for sample in range(row, known):
                yield "imu", sample
            row = known
            yield "scan", number
        for sample in range(row, len(stamps)):
            yield "imu", sample


def write_feed(folder: Path, head: Head, imu: Imu | None, scans: Iterable[np.ndarray]) -> Feed:
    """Fill a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "scans.npy").open("wb") as file:
        for scan in scans:
            np.save(file, scan)
    if imu is not None:
        np.savez(folder / "imu.npz", **asdict(imu))
    # Written last: a folder with a head is complete.
    (folder / "head.json").write_text(json.dumps(asdict(head)))
    return Feed(folder, head, imu)


def open_feed(folder: Path) -> Feed:
    """Read what `write_feed` has left."""
    head = Head(**json.loads((folder / "head.json").read_text()))
    path = folder / "imu.npz"
    imu = Imu(**np.load(path)) if path.exists() else None
    return Feed(folder, head, imu)
