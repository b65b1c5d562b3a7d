# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a head can do before it flies: acceptable spin rates, point spacing, coverage, time."""

from bentwing.flight.plan.plan import Intent, Plan, plan_flight

__all__ = ["Intent", "Plan", "plan_flight"]
