# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two flights over a compound with RTK and marks become one map in UTM: the commands of docs/two_flights.md."""

from __future__ import annotations

import json
import shutil

import laspy
import numpy as np
import pypdfium2
import pytest
import rasterio

from bentwing.cli.main import run_command
from bentwing.evaluate.simulated import Truth
from support.surveyed_marks import OnEarth, flat_places, write_marks

pytestmark = pytest.mark.slow

SEED, EPSG = 111, 25832
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


def command(*arguments):
    assert run_command([*map(str, arguments), "--quiet"]) == 0


@pytest.fixture(scope="module")
def flights(made_once):
    def make(number):
        def fill(folder):
            command("simulate", "compound", "--gnss", "rtk", "--seed", SEED, "--flight-seed", number,
                    "--duration", 30, "-o", folder)  # fmt: skip

        return made_once(f"compound-{number}", fill)

    return make(1), make(2)


@pytest.fixture(scope="module")
def runs(flights, made_once):
    def mapped(flight):
        def fill(folder):
            command(
                "map",
                flight / "recording.bag",
                "-p",
                flight / "payload.yaml",
                "-o",
                folder,
                "--epsg",
                EPSG,
            )

        return made_once(f"{flight.name}-mapped", fill)

    return [mapped(flight) for flight in flights]


@pytest.fixture(scope="module")
def marks(flights, runs):
    """Eight marks on floors and walls, every other pair of them to check."""
    earth = OnEarth(flights[0], EPSG)
    world = np.concatenate([
        earth.to_world(np.array(laspy.read(run / "map.laz").xyz)[::40]) for run in runs
    ])  # fmt: skip
    places = earth.of(
        flat_places(flights[0], world, np.random.default_rng(SEED), (True, False) * 4)
    )
    return [
        {"id": f"P{n + 1}", **dict(zip("xyz", place, strict=True)), "radius": 0.25,
         "use": ("control", "control", "check", "check")[n % 4]}
        for n, place in enumerate(places)
    ]  # fmt: skip


@pytest.fixture(scope="module")
def site(runs, marks, made_once):
    def fill(folder):
        path = write_marks(folder.parent / "compound.csv", marks)
        command("merge", *runs, "-o", folder, "--control-points", path)

    return made_once("compound-site", fill)


def record_of(run):
    return json.loads((run / "run.json").read_text())


def test_the_check_points_are_within_centimetres_and_the_map_is_where_the_world_is(flights, site):
    record = record_of(site)
    left = record["georeference"]["residuals"]
    assert (left["control"]["n"], left["check"]["n"]) == (4, 4)
    assert left["check"]["max"] < 0.015
    assert record["verdict"]["state"] == "good"
    points = np.array(laspy.read(site / "map.laz").xyz)[::20]
    off = np.abs(Truth(flights[0]).distances(OnEarth(flights[0], EPSG).to_world(points)))
    assert np.median(off) < 0.01


def test_others_read_cloud_and_terrain_where_they_are(site, tmp_path):
    las = laspy.read(site / "map.laz")
    assert las.header.parse_crs().to_epsg() == EPSG
    terrain = tmp_path / "terrain.tif"
    command("terrain", site, "-o", terrain)
    with rasterio.open(terrain) as raster:
        assert raster.crs.to_epsg() == EPSG
        heights = raster.read(1, masked=True)
        left, bottom, right, top = raster.bounds
    x, y, z = np.array(las.xyz).T
    assert left < np.median(x) < right
    assert bottom < np.median(y) < top
    assert abs(np.ma.median(heights) - np.percentile(z, 20)) < 1.0


def test_the_first_page_says_what_was_measured_with_what_and_what_was_left_out(site):
    page = (site / "report.html").read_text()
    for part in ("ETRS89 / UTM zone 32N (EPSG:25832). Heights are above the ellipsoid (GRS 80)".replace("80", "1980"),
                 "simulated-hokuyo-spin", "4 check points are off by", "returns of the lidar", "without an echo"):  # fmt: skip
        assert part in page, part


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: apt install chromium")
def test_the_residuals_are_on_the_first_printed_page_and_no_page_is_blank(site):
    command("report", site, "--pdf")
    with pypdfium2.PdfDocument(site / "report.pdf") as printed:
        texts = [page.get_textpage().get_text_bounded() for page in printed]
        inks = [float((page.render(scale=0.5).to_numpy() < 200).mean()) for page in printed]
    assert all(f"P{n}" in texts[0] for n in range(1, 9))
    assert "Left out of the map" in texts[0]
    assert min(inks) > 0.01


def test_a_third_flight_is_found_in_the_merged_map(site, made_once, tmp_path):
    """All flights were simulated at the same time, so only the numbers of the runs tell their points apart."""
    third = made_once(
        "compound-3",
        lambda folder: command("simulate", "compound", "--gnss", "rtk", "--seed", SEED,
                               "--flight-seed", 3, "--duration", 25, "-o", folder),
    )  # fmt: skip
    run = tmp_path / "third"
    command(
        "localize", third / "recording.bag", "--map", site, "-p", third / "payload.yaml", "-o", run
    )
    command("export", run, "-o", tmp_path / "third.laz", "--spacing", 0.2)
    las = laspy.read(tmp_path / "third.laz")
    assert las.header.parse_crs().to_epsg() == EPSG
    off = np.abs(Truth(third).distances(OnEarth(third, EPSG).to_world(np.array(las.xyz)[::5])))
    assert np.median(off) < 0.01
