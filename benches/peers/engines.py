# SPDX-License-Identifier: MIT OR Apache-2.0
"""The engines, their settings, and which moment of a scan their poses belong to.

Settings are the same for all recordings: the engine's own defaults but for what is listed here,
which flatters it. Every pose stamp was found by the shift of time that fits the truth best on
simulated flights; `--stamps` prints what is left of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Engine:
    """One engine.

    Attributes
    ----------
    name : as on the command line
    adapter : module in `benches.peers.adapters`; None for bentwing's own command
    package : what pip installs
    pipeline : class in `evalio.pipelines`
    settings : where they differ from the engine's defaults
    threads : as asked for; None where it cannot be told, then it is counted
    pose_scan, pose_share : its pose belongs to the scan so many after the one whose start is
        nearest to its stamp, at that share of the scan's duration
    """

    name: str
    adapter: str | None = None
    package: str = ""
    pipeline: str = ""
    settings: dict[str, bool | int | float | str] = field(default_factory=dict)
    threads: int | None = 1
    pose_scan: int = 0
    pose_share: float = 1.0
    needs_imu: bool = False
    needs_rings: bool = False
    needs_raw_points: bool = False


def _evalio(name: str, pipeline: str, **choices) -> Engine:
    return Engine(name, "evalio_engine", "evalio", pipeline, **choices)


ENGINES = {
    engine.name: engine
    for engine in (
        Engine("bentwing", package="bentwing"),
        _evalio("kiss-icp", "KissICP", settings={"deskew": True, "max_num_threads": 1}),
        _evalio(
            "kiss-icp-fine",
            "KissICP",
            settings={"voxel_size": 0.5, "deskew": True, "max_num_threads": 1},
        ),
        Engine(
            "genz-icp",
            "genz_icp_engine",
            "genz_icp",
            settings={"deskew": True, "voxel_size": 0.3},
            threads=None,
            pose_share=0.5,
        ),
        _evalio(
            "mad-icp", "MadICP", settings={"deskew": True, "num_threads": 1, "realtime": False}
        ),
        _evalio("ct-icp", "CTICP", settings={"ls_num_threads": 1}, pose_share=0.0),
        _evalio(
            "lio-sam",
            "LioSAM",
            settings={"numberOfCores": 1, "mappingProcessInterval": 0.0},
            pose_scan=-2,
            pose_share=0.5,
            needs_imu=True,
            needs_rings=True,
        ),
        _evalio("dlio", "DLIO", threads=None, pose_share=0.5, needs_imu=True),
        _evalio("form", "FORM", settings={"num_threads": 1}, pose_share=0.5, needs_rings=True),
        _evalio("loam", "LOAM", threads=None, pose_share=0.0, needs_rings=True),
        Engine(
            "rko-lio",
            "rko_lio_engine",
            "rko_lio",
            settings={"max_num_threads": 1},
            needs_imu=True,
        ),
        Engine(
            "small-gicp",
            "small_gicp_engine",
            "small_gicp",
            settings={"voxel_size": 1.0},
            needs_imu=True,
        ),
        Engine(
            "bentwing-evalio",
            "evalio_engine",
            "evalio",
            "bentwing",
            pose_share=0.0,
            needs_raw_points=True,
        ),
    )
}
