# SPDX-License-Identifier: MIT OR Apache-2.0
"""What runs in the process of one piece of work."""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import write_text
from bentwing.base.errors import BentwingError, EstimationError, FolderBusyError
from bentwing.base.plain import plain
from bentwing.base.progress import LineProgress
from bentwing.base.yaml_files import parse_yaml
from bentwing.fleet.process import BUSY

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from bentwing.base.progress import Progress

_INTERRUPTED = 130


def map_one(order: dict[str, Any], progress: Progress) -> dict[str, str]:
    """Map a recording; return why there is no complete run, nothing where there is one."""
    from bentwing.run.pipeline import run_recording
    from bentwing.run.settings import RunSettings

    settings = RunSettings.model_validate(parse_yaml(order["settings"]))
    settings = settings.model_copy(update={"threads": order["threads"]})
    recordings = [Path(path) for path in order["recordings"]]
    try:
        run_recording(
            recordings, order["out"], settings, order["payload"], resume=True, progress=progress
        )
    except FolderBusyError as error:
        return {BUSY: str(error)}
    except EstimationError as error:
        return {"failed": str(error)}
    except BentwingError as error:
        return {"refused": str(error)}
    return {}


def merge_all(order: dict[str, Any], progress: Progress) -> dict[str, Any]:
    """Merge runs into a map for each group that belongs together."""
    from bentwing.fleet.grouping import merge_groups
    from bentwing.run.settings import MergeSettings

    settings = MergeSettings.model_validate_json(order["settings"])
    settings = settings.model_copy(update={"threads": order["threads"]})
    try:
        return merge_groups(
            order["runs"],
            Path(order["out"]),
            settings,
            order["made"],
            kept=Path(order["kept"]),
            recordings={n: [Path(p) for p in paths] for n, paths in order["recordings"].items()},
            progress=progress,
        )
    except FolderBusyError as error:
        return {BUSY: str(error)}
    except BentwingError as error:
        return {"failed": str(error)}


WORK: dict[str, Callable[[dict[str, Any], Progress], dict[str, Any]]] = {
    "map": map_one,
    "merge": merge_all,
}


def main() -> None:
    """Read an order, carry it out, and write the answer into the file that it names."""
    signal.signal(signal.SIGTERM, _interrupt)
    order = json.loads(sys.stdin.readline())
    Thread(target=_end_with_parent, daemon=True).start()
    try:
        answer = WORK[order["work"]](order, LineProgress())
    except KeyboardInterrupt:
        sys.exit(_INTERRUPTED)
    write_text(Path(order["answer"]), json.dumps(plain(answer)))


def _interrupt(number: int, frame: FrameType | None) -> None:
    del number, frame
    raise KeyboardInterrupt


def _end_with_parent() -> None:
    """End this process at once when its parent's end of the pipe closes; a checkpoint is kept."""
    os.read(0, 1)
    os._exit(1)
