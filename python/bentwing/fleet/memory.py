# SPDX-License-Identifier: MIT OR Apache-2.0
"""How much memory a recording takes, stated before it is mapped, and how much this machine has."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.memory import memory_of_machine

if TYPE_CHECKING:
    from bentwing.closing.global_registration.settings import GlobalSettings

# A process with nothing read, MB, and what each MB of a recording adds. Measured: 0.4 to 0.5 GB for
# 24 s of a spinning 2D scanner (10 MB), 0.73 GB where its head had to be found, 0.85 GB for 8 s of an
# HDL-32E (45 MB), 0.87 GB for 20 s of a VLP-16 (120 MB). In long recordings the closing's own
# limit decides.
_BASE_MB = 700.0
_PER_MB = 4.0
_MOST_BESIDE_MB = 1500.0


def megabytes_of(size: int, closing: GlobalSettings) -> float:
    """Return the memory to plan for one recording, MB.

    Parameters
    ----------
    size : of its files, bytes
    """
    most = _MOST_BESIDE_MB + closing.memory_mb
    return min(_BASE_MB + _PER_MB * size / 1e6, most)


def process_mb(held: float) -> float:
    """Return the memory of a process that holds this much for a registration, MB."""
    return _BASE_MB + 1.2 * held


def available_mb() -> float:
    """Return the memory that this process may still use, MB."""
    limits = [_free_of_machine(), _free_of_group()]
    return min(limit for limit in limits if limit is not None) / 1e6


def _free_of_machine() -> float:
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    except OSError:
        pass
    # Other systems do not say what is free; half of all is a modest guess.
    return 0.5 * memory_of_machine()


def _free_of_group() -> float | None:
    """Return what the limit of a container leaves, bytes."""
    group = Path("/sys/fs/cgroup")
    try:
        most = (group / "memory.max").read_text(encoding="ascii").strip()
        used = (group / "memory.current").read_text(encoding="ascii").strip()
        return None if most == "max" else float(most) - float(used)
    except (OSError, ValueError):
        return None


def n_side_by_side(megabytes: float, n_jobs: int, wanted: int | None) -> int:
    """Return how many pieces of work of this size run at the same time: at least one."""
    fit = int(available_mb() / megabytes) if megabytes > 0 else n_jobs
    most = wanted or min(2, os.cpu_count() or 1)
    return max(1, min(fit, most, n_jobs))
