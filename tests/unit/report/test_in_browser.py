# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report in a real browser: nothing fails to load, nothing complains, the view turns."""

import shutil

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.report.page import write_report

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: apt install chromium")
# WebGL by software, for machines without a graphics card.
OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    rng = np.random.default_rng(0)
    points = rng.uniform([0, 0, 0], [20, 10, 4], (60_000, 3))
    points[np.arange(60_000), rng.integers(0, 3, 60_000)] = 0.0  # floor and two walls
    times = np.linspace(0.0, 30.0, 300)
    way = np.column_stack([2 + times / 2, 4 + np.sin(times), np.full(300, 1.5)])
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(
        path,
        run_json={"windows": [{"time": t, "degenerate": t > 20} for t in range(1, 31)]},
        trajectory=Trajectory(times, way, np.tile([0.0, 0.0, 0.0, 1.0], (300, 1))),
        map_sample=(points, np.linspace(0, 30, 60_000)),
    )
    return path


@pytest.fixture
def opened(report):
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.trouble = []
        page.on("console", lambda m: m.type in {"error", "warning"} and page.trouble.append(m.text))
        page.on("pageerror", lambda e: page.trouble.append(str(e)))
        page.on("requestfailed", lambda r: page.trouble.append(r.url))
        page.asked = []
        page.on("request", lambda r: page.asked.append(r.url))
        page.goto(report.as_uri())
        page.locator("#scene").scroll_into_view_if_needed()
        page.wait_for_function("document.getElementById('scene').dataset.drawn > 0")
        yield page
        browser.close()


def picture(page):
    return page.locator("#scene canvas").screenshot()


def drawn(page, act):
    """What the canvas shows once the act has made it draw again."""
    count = page.evaluate("Number(document.getElementById('scene').dataset.drawn)")
    act()
    page.wait_for_function(f"document.getElementById('scene').dataset.drawn > {count}")
    return picture(page)


def test_the_view_turns_zooms_and_changes_colour(opened, report):
    page = opened
    canvas = page.locator("#scene canvas")
    canvas.scroll_into_view_if_needed()
    first = picture(page)
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 300, box["y"] + 200)

    def turn():
        page.mouse.down()
        page.mouse.move(box["x"] + 420, box["y"] + 230)
        page.mouse.up()

    acts = (
        turn,
        lambda: page.mouse.wheel(0, -300),
        page.locator("#scene button[value=time]").click,
        page.locator("#scene button[value=top]").click,
    )
    seen = [first, *(drawn(page, act) for act in acts)]
    page.screenshot(path=report.with_name("report.png"), full_page=True)
    assert len(set(seen)) == len(seen)
    assert page.trouble == []
    assert all(url.startswith("file:") for url in page.asked)
