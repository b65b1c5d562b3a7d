# SPDX-License-Identifier: MIT OR Apache-2.0
"""Long calls release the GIL, and the number of threads changes no bit of any result."""

import threading
import time

import numpy as np
import pytest

from bentwing import _core

COUNTS = [2, 4]


def surfel_bytes(surfels):
    return [
        a.tobytes() for a in (surfels.means, surfels.normals, surfels.stamps, surfels.voxel_sizes)
    ]


def result_bytes(result):
    slow = result.globals
    return [
        result.samples.positions.tobytes(),
        result.samples.quats_xyzw.tobytes(),
        result.covariance.tobytes(),
        slow.base_translation.tobytes(),
        slow.base_quat_xyzw.tobytes(),
        slow.gyro_bias.tobytes(),
        slow.gravity.tobytes(),
        slow.latency,
        result.n_matches,
        result.residual_rms,
        result.translation_eigenvalues,
    ]


def test_the_flight_is_rich_enough_to_tell(flight, drifted, extract, register):
    """Most of a drift of 3.7 cm goes; how accurate the rest is, is not for this suite to say."""

    def bend(samples):
        offsets = samples.positions[: len(flight.positions)] - flight.positions
        return np.linalg.norm(offsets[-6] - offsets[0])

    assert len(extract()) > 500
    result = register()
    assert result.n_matches > 200
    assert bend(result.samples) < 0.5 * bend(drifted)


@pytest.mark.parametrize("threads", COUNTS)
def test_surfels_are_the_same_with_any_number_of_threads(extract, threads):
    assert surfel_bytes(extract(threads=threads)) == surfel_bytes(extract(threads=1))


@pytest.mark.parametrize("threads", COUNTS)
def test_a_registration_is_the_same_with_any_number_of_threads(register, threads):
    assert result_bytes(register(threads=threads)) == result_bytes(register(threads=1))


def test_a_registration_with_views_is_the_same_with_any_number_of_threads(
    register, extract, samples, states
):
    view = _core.FixedView([extract()], 0.0, 0.8, samples, states())
    results = [register(views=[view], joined=True, threads=n) for n in (1, *COUNTS)]
    assert results[0].n_fixed_matches > 100
    assert all(result_bytes(r) == result_bytes(results[0]) for r in results[1:])


@pytest.mark.parametrize("threads", COUNTS)
def test_placed_points_are_the_same_with_any_number_of_threads(flight, samples, states, threads):
    placed = [
        samples.place(flight.points, flight.stamps, None, states(), threads=n) for n in (1, threads)
    ]
    assert placed[0].tobytes() == placed[1].tobytes()


@pytest.mark.parametrize("threads", COUNTS)
def test_shots_are_placed_points_with_the_beams_from_where_the_lidar_was(
    flight, samples, states, threads
):
    measured = (flight.points, flight.stamps, None, states())
    points, beams, lengths = samples.place_shots(*measured, threads=threads)
    assert points.tobytes() == samples.place(*measured, threads=1).tobytes()
    assert beams.tobytes() == samples.place_shots(*measured, threads=1)[1].tobytes()
    nowhere = np.zeros_like(flight.points)
    origins = samples.place(nowhere, flight.stamps, None, states(), threads=1)
    np.testing.assert_allclose(points - beams * lengths[:, None], origins, rtol=0, atol=1e-5)
    np.testing.assert_allclose(lengths, np.linalg.norm(flight.points, axis=1), rtol=1e-15)


def test_calls_from_several_threads_at_once_do_not_disturb_each_other(register):
    results = [None] * 3

    def run(i):
        results[i] = result_bytes(register(threads=1))

    workers = [threading.Thread(target=run, args=(i,)) for i in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert results[0] == results[1] == results[2]


def longest_pause(work):
    """Share of the time of `work` that passed in the longest pause of another Python thread."""
    stamps, done = [], threading.Event()

    def tick():
        while not done.is_set():
            stamps.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    while not stamps:
        time.sleep(0.001)
    start = time.perf_counter()
    work()
    stop = time.perf_counter()
    done.set()
    thread.join()
    inside = np.array([start, *[s for s in stamps if start < s < stop], stop])
    return np.diff(inside).max() / (stop - start)


@pytest.fixture(scope="module")
def long_calls(flight, room, samples, states, extract, register):
    """Calls that take long in the core; those that check and copy arrays do it with the GIL held."""
    many = np.tile(flight.points, (20, 1))
    late = np.repeat(flight.stamps, 20)
    return {
        "distance": lambda: room.distance(many),
        "place": lambda: samples.place(many, late, None, states(), threads=1),
        "extract_surfels": lambda: extract(points=many, stamps=late, threads=1),
        "register_window": lambda: register(threads=1),
    }


# A call that holds the GIL pauses the other thread for its whole duration. Other work on the same
# processor may do so too, but not every time.
@pytest.mark.parametrize("name", ["distance", "place", "extract_surfels", "register_window"])
def test_other_python_threads_go_on_during_a_long_call(long_calls, name):
    shares = []
    for _ in range(5):
        shares.append(longest_pause(long_calls[name]))
        if shares[-1] < 0.7:
            return
    pytest.fail(f"the longest pause was {min(shares):.0%} of the call at best")
