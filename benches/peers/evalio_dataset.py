# SPDX-License-Identifier: MIT OR Apache-2.0
"""Simulated recordings as a dataset of evalio: those in `$EVALIO_DATA/simulated/`.

`EVALIO_CUSTOM=benches.peers.evalio_dataset evalio run -d 'simulated/*' -p dlio …`
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from evalio.datasets import Dataset, DatasetIterator, get_data_dir
from evalio.types import SE3, ImuMeasurement, ImuParams, LidarMeasurement, LidarParams, Trajectory

from benches.peers import evalio_types
from benches.peers.feed import Feed, open_feed
from benches.peers.prepare import prepare
from bentwing.evaluate.simulated import true_calibration
from bentwing.recording import Payload

if TYPE_CHECKING:
    from collections.abc import Iterator

FILES = ["recording.bag", "payload.yaml", "truth_trajectory.txt", "truth_calibration.yaml"]
COLUMNS = ["sec", "x", "y", "z", "qx", "qy", "qz", "qw"]


class Samples(DatasetIterator):
    """Over the samples of one recording."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed

    def __len__(self) -> int:
        return len(self._feed.head.starts_ns)

    def __iter__(self) -> Iterator[ImuMeasurement | LidarMeasurement]:
        return evalio_types.measurements(self._feed)

    def imu_iter(self) -> Iterator[ImuMeasurement]:
        """Inertial samples only."""
        return (m for m in self if isinstance(m, ImuMeasurement))

    def lidar_iter(self) -> Iterator[LidarMeasurement]:
        """Scans only."""
        return (m for m in self if isinstance(m, LidarMeasurement))


class _Folder(Dataset):
    def feed(self) -> Feed:
        """The scans, cut at the first use and kept beside the recording."""
        folder = self.folder / "feed"
        if (folder / "head.json").exists():
            return open_feed(folder)
        payload = Payload.load(self.folder / "payload.yaml")
        return prepare(
            self.folder / "recording.bag", payload, folder, true_calibration(self.folder).latency
        )

    def data_iter(self) -> DatasetIterator:
        """All samples."""
        return Samples(self.feed())

    def ground_truth_raw(self) -> Trajectory:
        """True poses of the IMU."""
        return Trajectory.from_csv(self.folder / "truth_trajectory.txt", COLUMNS, delimiter=" ")

    def imu_T_lidar(self) -> SE3:
        """The mount as the payload gives it."""
        return evalio_types.mount(self.feed().head)

    def imu_T_gt(self) -> SE3:
        """The truth is that of the IMU."""
        return SE3.identity()

    def imu_params(self) -> ImuParams:
        """From the payload."""
        return evalio_types.imu_params(self.feed())

    def lidar_params(self) -> LidarParams:
        """From the payload."""
        return evalio_types.lidar_params(self.feed().head)

    def files(self) -> list[str | Path]:
        """What `bentwing simulate` writes."""
        return list(FILES)


def _recordings() -> dict[str, str]:
    root = Path(get_data_dir()) / "simulated"
    return {path.name: path.name for path in sorted(root.glob("*/")) if path.is_dir()}


# The members of an enumeration are given with it, so they are what is there on import.
Simulated = _Folder("Simulated", _recordings())
Simulated.__module__ = __name__
