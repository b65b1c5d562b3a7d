# SPDX-License-Identifier: MIT OR Apache-2.0
"""E57 maps through the optional package pye57."""

from __future__ import annotations

import uuid
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.map.formats import require_package
from bentwing.map.writer import MapWriter, round_offset

if TYPE_CHECKING:
    from bentwing.map.chunk import MapChunk

# pye57 writes one scan per call; a map is a few large scans so that memory stays bounded.
POINTS_PER_SCAN = 5_000_000


def _file_in(pye57: Any, crs_wkt: str) -> Any:  # noqa: ANN401 - the package has no types
    """Return pye57's file for a coordinate system, which its own header leaves empty for good."""
    lib = pye57.libe57

    class File(pye57.E57):  # type: ignore[misc] # the package has no types
        def write_default_header(self) -> None:
            image, root = self.image_file, self.root
            image.extensionsAdd("", lib.E57_V1_0_URI)
            texts = {
                "formatName": "ASTM E57 3D Imaging Data File",
                "guid": f"{{{uuid.uuid4()}}}",
                "e57LibraryVersion": lib.E57_LIBRARY_ID,
                "coordinateMetadata": crs_wkt,
            }
            for name, text in texts.items():
                root.set(name, lib.StringNode(image, text))
            root.set("versionMajor", lib.IntegerNode(image, lib.E57_FORMAT_MAJOR))
            root.set("versionMinor", lib.IntegerNode(image, lib.E57_FORMAT_MINOR))
            created = lib.StructureNode(image)
            created.set("dateTimeValue", lib.FloatNode(image, 0.0))
            created.set("isAtomicClockReferenced", lib.IntegerNode(image, 0))
            root.set("creationDateTime", created)
            root.set("data3D", lib.VectorNode(image, True))  # noqa: FBT003 - its only form
            root.set("images2D", lib.VectorNode(image, True))  # noqa: FBT003

    return File


class E57Writer(MapWriter):
    """Writer of E57, as scans of `POINTS_PER_SCAN` points in one frame."""

    def _begin(self, first: MapChunk) -> None:
        pye57 = require_package("e57")
        self._has_intensity = first.intensity is not None
        self._file = _file_in(pye57, self.crs_wkt or "")(str(self._temporary), mode="w")
        self._waiting: list[MapChunk] = []
        self._n_waiting = 0

    def _append(self, chunk: MapChunk) -> None:
        self._waiting.append(chunk)
        self._n_waiting += len(chunk)
        if self._n_waiting >= POINTS_PER_SCAN:
            self._write_scan()

    def _finish(self) -> None:
        if self._n_waiting:
            self._write_scan()
        self._file.close()

    def _abandon(self) -> None:
        self._file.close()

    def _write_scan(self) -> None:
        points = np.concatenate([chunk.points for chunk in self._waiting])
        # pye57 stores single precision, so the scan's pose takes what is large.
        offset = round_offset(points)
        points -= offset
        columns = {f"cartesian{axis}": points[:, i].copy() for i, axis in enumerate("XYZ")}
        if self._has_intensity:
            intensity = [
                np.zeros(len(chunk), np.float32) if chunk.intensity is None else chunk.intensity
                for chunk in self._waiting
            ]
            columns["intensity"] = np.concatenate(intensity)
        self._file.write_scan_raw(columns, name="bentwing map", translation=offset)
        self._waiting, self._n_waiting = [], 0
