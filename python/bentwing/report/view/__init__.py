# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run in the rerun viewer, as still pictures, and as frames of a video."""

from bentwing.report.view.frames import write_frames
from bentwing.report.view.pictures import write_pictures
from bentwing.report.view.show import view_run

__all__ = ["view_run", "write_frames", "write_pictures"]
