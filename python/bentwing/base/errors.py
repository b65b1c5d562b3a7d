# SPDX-License-Identifier: MIT OR Apache-2.0
"""What can go wrong, by what the caller can do about it.

Every message says what was found, where, and what to do.
"""

from __future__ import annotations


class BentwingError(Exception):
    """Base of all errors raised by bentwing; `exit_code` is what a command ends with."""

    exit_code = 1


class UsageError(BentwingError):
    """The call itself is wrong: an option, a combination of options, an output that exists."""

    exit_code = 2


class FolderBusyError(UsageError):
    """Another process writes into the folder."""


class InputError(BentwingError):
    """An input cannot be used."""

    exit_code = 3


class RecordingError(InputError):
    """A recording cannot be used: unreadable, a topic missing, no time per point, wrong units."""


class PayloadError(InputError):
    """The description of the sensor head is invalid."""


class EstimationError(BentwingError):
    """The estimate failed; what was computed until then is kept."""

    exit_code = 4


class NotEnoughDataError(EstimationError):
    """Too few points or inertial samples to estimate anything."""


class SingularSystemError(EstimationError):
    """The normal equations have no unique solution."""


class DivergedError(EstimationError):
    """The estimate left the range in which it can be right."""


class PartialError(BentwingError):
    """Of several recordings, some were not mapped; the others were."""

    exit_code = 5
