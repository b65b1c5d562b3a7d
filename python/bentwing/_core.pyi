# SPDX-License-Identifier: MIT OR Apache-2.0
# The compiled core. Arrays must be C-contiguous and must not be modified during a call.

import numpy as np
from numpy.typing import NDArray

__version__: str

class Scene:
    def __init__(self, vertices: NDArray[np.float64], triangles: NDArray[np.uint32]) -> None: ...
    @property
    def n_triangles(self) -> int: ...
    def cast(
        self, origins: NDArray[np.float64], directions: NDArray[np.float64], max_range: float
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]: ...
    def distance(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]: ...
