# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.calibrate.inspection.spin import spin_from_encoder, spin_from_gyro

TIMES = np.arange(0, 20, 0.005)


def gyro_of(rates):
    noise = np.random.default_rng(0).normal(0, 0.05, (len(TIMES), 3))
    return noise + np.column_stack([np.zeros_like(rates), -rates, np.zeros_like(rates)])


def test_a_steady_spin_is_measured_and_does_not_stall():
    spin = spin_from_gyro(TIMES, gyro_of(np.full(len(TIMES), 4.3)))
    assert spin.usual == pytest.approx(4.3, abs=0.05)
    assert spin.stalls == []


def test_rest_before_and_after_the_spin_is_no_stall():
    rates = np.where((TIMES > 5) & (TIMES < 15), 4.0, 0.0)
    assert spin_from_gyro(TIMES, gyro_of(rates)).stalls == []


def test_a_stall_is_found_where_it_is():
    rates = np.where((TIMES > 8) & (TIMES < 11), 0.1, 4.0)
    ((start, length),) = spin_from_gyro(TIMES, gyro_of(rates)).stalls
    assert start == pytest.approx(8.0, abs=0.3)
    assert length == pytest.approx(3.0, abs=0.5)


def test_a_carried_head_does_not_spin():
    spin = spin_from_gyro(TIMES, gyro_of(0.3 * np.sin(TIMES)))
    assert spin.usual == 0.0
    assert spin.stalls == []


def test_the_encoder_gives_the_rate_of_its_angle():
    spin = spin_from_encoder(TIMES, -2.0 * TIMES)
    assert spin.source == "encoder"
    assert spin.usual == pytest.approx(2.0)


def test_no_samples_are_no_spin():
    assert spin_from_gyro(np.zeros(0), np.zeros((0, 3))).rates == []
