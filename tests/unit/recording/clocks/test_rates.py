# SPDX-License-Identifier: MIT OR Apache-2.0
"""The rate of a sensor's clock beside that of the recorder."""

import numpy as np
import pytest

from bentwing.recording import Recording
from bentwing.recording.clocks.rates import clock_rate, run_apart
from support.recordings import HEAD


def stream(gain, seconds=24.0, waits=0.003, seed=1):
    """Stamps of a sensor at 40 Hz and of the recorder, ns; one message in twenty waits for long."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, 1 / 40)
    late = rng.exponential(waits, len(times)) + 0.2 * (rng.random(len(times)) < 0.05)
    recorder = np.maximum.accumulate(times + late)
    return [
        (round(1e9 * (1 + gain) * t), round(1e9 * r)) for t, r in zip(times, recorder, strict=True)
    ]


@pytest.mark.parametrize("gain", [0.0, 0.01, -0.004])
def test_a_rate_is_found_though_messages_wait(gain):
    found = clock_rate("/scan", stream(gain))
    assert found.gain == pytest.approx(gain, abs=2e-4)
    assert run_apart(found, clock_rate("/imu", stream(0.0, seed=2))) == (gain != 0.0)


def test_a_queue_that_grows_and_empties_is_no_rate():
    growing = [
        (sensor, recorder + round(1e9 * 0.3 * np.sin(np.pi * sensor / 24e9) ** 2))
        for sensor, recorder in stream(0.0)
    ]
    assert not run_apart(clock_rate("/scan", growing), clock_rate("/imu", stream(0.0, seed=2)))


def test_a_short_stream_has_no_rate():
    assert clock_rate("/scan", stream(0.01, seconds=8.0)) is None
    assert clock_rate("/scan", []) is None


def test_the_sentence_names_the_clock_that_is_fast(tmp_path, ros1):
    entries = [("/scan", i / 10, ros1.scan(1.01 * i / 10)) for i in range(200)]
    entries += [("/imu", i / 10, ros1.imu(i / 10)) for i in range(200)]
    path = ros1.write(tmp_path / "a.bag", sorted(entries, key=lambda entry: entry[1]))
    with Recording(path, HEAD, strict=False) as recording:
        assert (
            "clock of /scan gains 10.0 ms a second on that of /imu"
            in recording.clock_rate_problem()
        )
