# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the lidar sees of its own carrier, as boxes for the payload's `self_hits`."""

from bentwing.calibrate.carrier.watch import CarrierWatch, carrier_warnings

__all__ = ["CarrierWatch", "carrier_warnings"]
