# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where the clock of a sensor was set, or began again, while it was recorded."""

from __future__ import annotations

import statistics
from typing import NamedTuple

NS_PER_S = 1_000_000_000
MIN_STEP_NS = 10 * NS_PER_S  # header against recorder; less is transport delay
ALIKE_NS = NS_PER_S  # by which offsets behind a step may differ
CONFIRMED = 5  # messages; fewer may be damaged stamps
SAME_NS = NS_PER_S // 2  # between the steps of two sensors of one device


class ClockStep(NamedTuple):
    """From the message that reached the recorder at `recorder_ns` on, `shift_ns` is added to the stamps.

    `stamp_ns` is the first stamp so shifted.
    """

    recorder_ns: int
    shift_ns: int
    stamp_ns: int


class ClockSteps:
    """Finds steps of a stream's stamps by the recorder's clock, which goes on.

    Parameters
    ----------
    offset_ns : header's minus recorder's time where the stamps are not shifted
    of_device : the steps of all streams of a pass; those of two sensors of one device are made equal
    """

    def __init__(self, offset_ns: int, of_device: list[ClockStep]) -> None:
        self.found: list[ClockStep] = []
        self._offset_ns, self._of_device = offset_ns, of_device
        self._suspects: list[tuple[int, int]] = []
        self._last_header_ns: int | None = None

    @property
    def is_suspect(self) -> bool:
        """Whether the newest stamp is none of the clock as it is known."""
        return bool(self._suspects)

    def notice(self, header_ns: int, recorder_ns: int) -> None:
        """Take the stamps of a message before `shift_ns` is asked for it."""
        shift_ns = self.found[-1].shift_ns if self.found else 0
        offset_ns = header_ns + shift_ns - recorder_ns
        if abs(offset_ns - self._offset_ns) <= MIN_STEP_NS:
            self._offset_ns, self._last_header_ns = offset_ns, header_ns
            self._suspects.clear()
            return
        if self._suspects and abs(offset_ns - self._suspects[-1][1]) > ALIKE_NS:
            self._suspects.clear()
        self._suspects.append((recorder_ns, offset_ns))
        if len(self._suspects) >= CONFIRMED and not self._goes_on(header_ns):
            self._confirm(shift_ns)
            self._last_header_ns = header_ns

    def _goes_on(self, header_ns: int) -> bool:
        """Whether the header's clock goes on, so that the recorder's was set."""
        return (
            self._last_header_ns is not None
            and 0 <= header_ns - self._last_header_ns <= MIN_STEP_NS
        )

    def _confirm(self, shift_ns: int) -> None:
        begin_ns = self._suspects[0][0]
        step_ns = statistics.median_low(offset for _, offset in self._suspects) - self._offset_ns
        shift_ns -= step_ns
        near = [
            step.shift_ns
            for step in self._of_device
            if abs(step.shift_ns - shift_ns) <= SAME_NS
            and abs(step.recorder_ns - begin_ns) <= MIN_STEP_NS
        ]
        step = ClockStep(begin_ns, near[0] if near else shift_ns, begin_ns + self._offset_ns)
        self.found.append(step)
        self._of_device.append(step)
        self._suspects.clear()

    def shift_ns(self, recorder_ns: int) -> int:
        """Return what is added to the header stamp of a message."""
        return next((s.shift_ns for s in reversed(self.found) if s.recorder_ns <= recorder_ns), 0)
