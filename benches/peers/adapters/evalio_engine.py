# SPDX-License-Identifier: MIT OR Apache-2.0
"""The pipelines that evalio carries, and bentwing as one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from evalio import pipelines

from benches.peers import evalio_types

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np

    from benches.peers.engines import Engine
    from benches.peers.feed import Feed


def run(feed: Feed, engine: Engine) -> Iterator[tuple[int, np.ndarray]]:
    """Poses of the body as the pipeline stamps them."""
    pipeline = _pipeline(engine.pipeline)
    # Without its own defaults set some pipelines run on zeros.
    pipeline.set_params({**type(pipeline).default_params(), **engine.settings})
    pipeline.set_imu_params(evalio_types.imu_params(feed))
    pipeline.set_lidar_params(evalio_types.lidar_params(feed.head))
    pipeline.set_imu_T_lidar(evalio_types.mount(feed.head))
    pipeline.initialize()
    for measurement in evalio_types.measurements(feed):
        if isinstance(measurement, evalio_types.ImuMeasurement):
            pipeline.add_imu(measurement)
        else:
            pipeline.add_lidar(measurement)
        yield from _saved(pipeline)
    if hasattr(pipeline, "finish"):
        pipeline.finish()
        yield from _saved(pipeline)


def _pipeline(name: str) -> pipelines.Pipeline:
    if name == "bentwing":
        from benches.peers.evalio_pipeline import Bentwing

        return Bentwing()
    return getattr(pipelines, name)()


def _saved(pipeline: pipelines.Pipeline) -> Iterator[tuple[int, np.ndarray]]:
    for stamp, pose in pipeline.saved_estimates():
        yield stamp.to_nsec(), pose.to_mat()
