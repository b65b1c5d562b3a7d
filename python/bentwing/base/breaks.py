# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a recording breaks, and what became of the trajectory there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

HEAD: Literal["head"] = "head"
"""In place of a sensor: the head of a 2D lidar stood still."""
SCAN: Literal["scan"] = "scan"
"""In place of a sensor: the lidar's scans fit nothing that was seen before."""

Outcome = Literal["guessed", "bridged", "found", "not found", "left out"]


@dataclass(frozen=True, slots=True)
class Break:
    """A silence of one sensor, or what is as bad.

    Attributes
    ----------
    sensor : which one, or `HEAD` or `SCAN`
    start, stop : s, last stamp before the silence and first stamp after it
    outcome : the trajectory begins anew after it, where a `guessed` motion leads; or what was seen on
        both sides fits together, so that it was `bridged`; or closing has `found` or `not found` the
        place of what follows again; or what follows is `left out`
    n_places : by which it was found
    """

    sensor: Literal["lidar", "inertial", "head", "scan"]
    start: float
    stop: float
    outcome: Outcome = "guessed"
    n_places: int = 0

    def sentence(self) -> str:
        """Return the warning for the user."""
        if self.outcome == "left out":
            return (
                f"the {self.sensor} data end at {self.start:.2f} s, {self.stop - self.start:.1f} s "
                "before the lidar's: what the lidar saw after that is left out"
            )
        if self.outcome == "bridged":
            there = "the IMU's and single planes'" if self.sensor == HEAD else "a guess"
            return (
                f"{self._what()}: the trajectory there is {there}; what was seen before and after fits "
                "together"
            )
        how = "consistent" if self.sensor == SCAN else "accurate"
        fits = ""
        if self.sensor != SCAN:
            fits = ", and what was seen before and after does not fit together"
        return (
            f"{self._what()}{fits}: the trajectory begins anew there, in the direction of the last "
            f"motion; what follows is {how} in itself, but its place relative to what came before "
            f"{self._place()}"
        )

    def _what(self) -> str:
        span = f"from {self.start:.2f} to {self.stop:.2f} s"
        if self.sensor == HEAD:
            return f"the head stood still {span}"
        if self.sensor == SCAN:
            return f"no scan {span} fits what was seen before"
        return f"no {self.sensor} data {span}"

    def _place(self) -> str:
        if self.outcome == "found":
            return f"was found again by {self.n_places} places that more than one segment has seen"
        if self.outcome == "not found":
            return "is a guess: no place was found that both sides have seen"
        return "is a guess"
