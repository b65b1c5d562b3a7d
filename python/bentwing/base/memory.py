# SPDX-License-Identifier: MIT OR Apache-2.0
"""Memory of this process and of the machine, on any system."""

from __future__ import annotations

import ctypes
import os
import sys
from contextlib import suppress

if sys.platform != "win32":
    import resource


def give_back() -> None:
    """Give memory that is free back to the system, where its C library can.

    Each thread that works leaves free memory behind that no other thread gets: after a pass over a large
    recording several times as much as what is in use.
    """
    with suppress(AttributeError, OSError, TypeError):  # glibc alone has it
        ctypes.CDLL(None).malloc_trim(0)


if sys.platform == "win32":
    from ctypes import wintypes

    class _OfProcess(ctypes.Structure):
        """PROCESS_MEMORY_COUNTERS of psapi.h."""

        _fields_ = (
            ("cb", wintypes.DWORD),
            ("page_faults", wintypes.DWORD),
            ("peak_working_set", ctypes.c_size_t),
            ("others", ctypes.c_size_t * 7),
        )

    class _OfMachine(ctypes.Structure):
        """MEMORYSTATUSEX of sysinfoapi.h."""

        _fields_ = (
            ("length", wintypes.DWORD),
            ("load", wintypes.DWORD),
            ("total", ctypes.c_uint64),
            ("available", ctypes.c_uint64),
            ("others", ctypes.c_uint64 * 5),
        )

    def peak_memory() -> int:
        """Return the most bytes that this process ever held in memory."""
        kernel = ctypes.WinDLL("kernel32")
        kernel.GetCurrentProcess.restype = wintypes.HANDLE
        found = _OfProcess(cb=ctypes.sizeof(_OfProcess))
        process = wintypes.HANDLE(kernel.GetCurrentProcess())
        kernel.K32GetProcessMemoryInfo(process, ctypes.byref(found), found.cb)
        return int(found.peak_working_set)

    def memory_of_machine() -> int:
        """Return the bytes of memory that the machine has."""
        found = _OfMachine(length=ctypes.sizeof(_OfMachine))
        ctypes.WinDLL("kernel32").GlobalMemoryStatusEx(ctypes.byref(found))
        return int(found.total)

else:

    def peak_memory() -> int:
        """Return the most bytes that this process ever held in memory."""
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak if sys.platform == "darwin" else peak * 1024

    def memory_of_machine() -> int:
        """Return the bytes of memory that the machine has."""
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
