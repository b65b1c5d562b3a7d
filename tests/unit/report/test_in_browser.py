# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report in a real browser: nothing fails to load, nothing overflows, the view turns."""

import csv
import re
import shutil

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.closing.georeference.control_point_file import read_control_points
from bentwing.report.page import write_report

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: apt install chromium")
# WebGL by software, for machines without a graphics card.
OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

RECORD = {
    "complete": True,
    "start_ns": 1_767_225_600 * 10**9,
    "versions": {"bentwing": "0.1.0", "platform": "Linux-6.18.44-fc-v657-x86_64-with-glibc2.36"},
    "settings": {
        "project": {"name": "A long name of a project in a town", "client": "Client" * 12},
        "georeferencing": {"mode": "rigid", "epsg": 32632},
        "loop_closure": {"surfels": {"min_incidence_cosine": 0.1}},
        "payload": {"self_hits": [{"box": {"min": [-0.3, -0.62, -0.62], "max": [0.32, 0.62, 0.62]}}]},
        "recordings": ["/a/path/that/is/long" * 6],
    },
    "inputs": [{"name": "recording.bag", "bytes": 10**6, "sha256": "ab" * 32, "hashed": "all"}],
    "counts": {"lidar.returns": 1_664_000, "lidar.nan": 23_729, "map.points": 60_000},
    "timings": {"estimate": 3.0, "estimate/register": 2.0, "total": 9.0},
    "peak_memory_mb": 541.2,
    "calibration": {
        "latency": 0.00213,
        "mount": {"T_imu_lidar": {"translation": [0.0312, 0, -0.05], "quaternion": [0, 0, 0, 1]}},
        "gyro_bias": [0.001, -0.01234, 0.0],
        "accel_bias": [0.02, 0.0, 0.0],
        "gravity": [0.0, 0.0, 9.81],
        "std": {"latency": [2e-5], "extrinsic_translation": [4e-4] * 3},
    },
    "georeference": {
        "epsg": 32632,
        "crs": "WGS 84 / UTM zone 32N",
        "mode": "rigid",
        "linear": {"map": [0, 0, 0], "projected": [631_015.0, 5_170_950.0, 497.0],
                   "matrix": [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]},
        "control_points": [
            {"id": f"M{i}", "use": "check", "points": 1884, "normal": [0, 0, 1], "before": -0.0056,
             "residual": 0.0001, "picked_off": 0.021, "in_map": [i, 3, 0]} for i in range(12)
        ],
    },
}  # fmt: skip
# What sticks out of its place, and what lies on a neighbour.
FAULTS = """() => {
  const wide = [...document.querySelectorAll('main *:not(svg *)')]
    .filter(e => e.scrollWidth > e.clientWidth + 1 && e.clientWidth && getComputedStyle(e).overflowX === 'visible')
    .map(e => e.tagName + '.' + e.className + ' ' + e.textContent.slice(0, 30));
  const on = [];
  for (const parent of document.querySelectorAll('main, main *:not(svg):not(svg *):not(.stage)')) {
    const boxes = [...parent.children].filter(e => !['SPAN', 'B', 'BUTTON', 'STRONG'].includes(e.tagName))
      .map(e => [e, e.getBoundingClientRect()]).filter(([, r]) => r.width && r.height);
    boxes.forEach(([a, r], i) => boxes.slice(i + 1).forEach(([b, q]) => {
      if (r.left < q.right - 1 && q.left < r.right - 1 && r.top < q.bottom - 1 && q.top < r.bottom - 1)
        on.push(a.tagName + '.' + a.className + ' on ' + b.tagName + '.' + b.className);
    }));
  }
  const texts = [];
  for (const svg of document.querySelectorAll('svg')) {
    const boxes = [...svg.querySelectorAll('text')].map(t => [t, t.getBoundingClientRect()]).filter(([, r]) => r.width);
    boxes.forEach(([a, r], i) => boxes.slice(i + 1).forEach(([b, q]) => {
      if (r.left < q.right - 1 && q.left < r.right - 1 && r.top < q.bottom - 2 && q.top < r.bottom - 2)
        texts.push(svg.getAttribute('aria-label') + ': ' + a.textContent + ' on ' + b.textContent);
    }));
  }
  return { page: document.documentElement.scrollWidth - innerWidth, wide, on, texts };
}"""


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
        run_json={
            **RECORD,
            "windows": [
                {"time": t, "degenerate": t > 20, "n_matches": 100 * t} for t in range(1, 31)
            ],
        },
        trajectory=Trajectory(times, way, np.tile([0.0, 0.0, 0.0, 1.0], (300, 1))),
        map_sample=(points, np.linspace(0, 30, 60_000)),
        map_values=np.column_stack([0.01 * points[:, 0], points[:, 1], 0.3 * points[:, 2]]).astype(
            np.float32
        ),
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

    cut = page.locator("#scene input[data-side=high][data-axis='2']")
    acts = (
        turn,
        lambda: page.mouse.wheel(0, -300),
        *(
            page.locator(f"#scene button[value={name}]").click
            for name in ("time", "sigma", "intensity", "incidence")
        ),
        page.locator("#scene button[value=top]").click,
        page.locator("#scene button[value=side]").click,
        lambda: cut.fill("1.5"),
        lambda: canvas.press("ArrowLeft"),
        lambda: canvas.press("+"),
        lambda: canvas.press("Shift+ArrowUp"),
    )
    seen = [first, *(drawn(page, act) for act in acts)]
    page.screenshot(path=report.with_name("report.png"), full_page=True)
    assert len(set(seen)) == len(seen)
    assert page.trouble == []
    assert all(url.startswith("file:") for url in page.asked)


def test_the_legend_says_what_the_colours_are(opened):
    for name, words in (("sigma", "mm"), ("incidence", "°"), ("height", "height, m")):
        button = opened.locator(f"#scene button[value={name}]")
        drawn(opened, button.click)
        legend = opened.locator("#scene .legend").inner_text()
        assert words in legend
        assert len(re.findall(r"\d", legend)) >= 2
        assert button.get_attribute("aria-pressed") == "true"
        assert opened.locator("#scene button[aria-pressed=true]").count() == 1


def test_nothing_overflows_and_nothing_lies_on_anything_else(opened):
    opened.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    for width in (390, 768, 1400, 2000):
        opened.set_viewport_size({"width": width, "height": 900})
        found = opened.evaluate(FAULTS)
        assert found == {"page": 0, "wide": [], "on": [], "texts": []}, width


def test_the_page_scrolls_past_the_view_until_that_is_clicked(opened):
    box = opened.locator("#scene canvas").bounding_box()
    opened.mouse.move(box["x"] + 200, box["y"] + 200)
    before = opened.evaluate("scrollY")
    opened.mouse.wheel(0, -120)
    opened.wait_for_function(f"scrollY < {before}")
    opened.locator("#scene canvas").click()
    here = opened.evaluate("scrollY")
    drawn(opened, lambda: opened.mouse.wheel(0, -120))
    assert opened.evaluate("scrollY") == here


def test_two_fingers_zoom_and_one_turns(opened):
    canvas, cdp = opened.locator("#scene canvas"), opened.context.new_cdp_session(opened)
    canvas.click()
    box = canvas.bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def touch(kind, *gaps):
        points = [{"x": middle[0] + gap, "y": middle[1], "id": i} for i, gap in enumerate(gaps)]
        cdp.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def pinch():
        touch("touchStart", -40, 40)
        touch("touchMove", -90, 90)
        touch("touchEnd")

    def turn():
        touch("touchStart", 0)
        touch("touchMove", 70)
        touch("touchEnd")

    def metres():
        bar = opened.locator("#scene [data-part=bar]").bounding_box()["width"]
        return float(opened.locator("#scene [data-part=length]").inner_text().split()[0]) / bar

    before, first = metres(), picture(opened)
    zoomed = drawn(opened, pinch)
    assert metres() == pytest.approx(before * 40 / 90, rel=0.1)
    assert drawn(opened, turn) != zoomed != first


def test_the_map_fits_and_distances_are_those_of_the_scale_bar(opened):
    canvas = opened.locator("#scene canvas")
    drawn(opened, opened.locator("#scene button[value=top]").click)
    drawn(opened, opened.locator("#scene button[value=measure]").click)
    box, bar = (
        opened.locator(f"#scene {part}").bounding_box() for part in ("canvas", "[data-part=bar]")
    )
    metres = float(opened.locator("#scene [data-part=length]").inner_text().split()[0])
    scale = bar["width"] / metres
    # The room of 20 by 10 m is turned by 37° to grid north: it fills the view, and nothing is cut off.
    assert 0.8 < max(22 * scale / box["width"], 20 * scale / box["height"]) < 1.0
    middle = box["width"] / 2, box["height"] / 2
    drawn(opened, lambda: canvas.click(position={"x": middle[0] - 3 * scale, "y": middle[1]}))
    drawn(opened, lambda: canvas.click(position={"x": middle[0] + 3 * scale, "y": middle[1]}))
    told = opened.locator("#scene [data-part=distance]").inner_text()
    assert float(told.split()[0]) == pytest.approx(6.0, abs=14 / scale)
    assert opened.locator("#scene [data-part=measured] circle").count() == 2


def saved(page, tmp_path, what):
    with page.expect_download() as download:
        page.locator(f"#scene button[value={what}]").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    return path


def test_clicked_points_become_control_points_and_a_loop(opened, tmp_path):
    canvas = opened.locator("#scene canvas")
    opened.locator("#scene button[value=points]").click()
    assert "Measure" in opened.locator("#scene [data-part=distance]").inner_text()
    drawn(opened, opened.locator("#scene button[value=top]").click)
    drawn(opened, opened.locator("#scene button[value=measure]").click)
    drawn(opened, canvas.click)
    drawn(opened, lambda: canvas.press("Enter"))  # the middle again, by the keyboard
    path = saved(opened, tmp_path, "points")
    rows = list(csv.DictReader(path.read_text().splitlines()))
    places = np.array([[row[f"map_{axis}"] for axis in "xyz"] for row in rows], float)
    # The room is 20 by 10 m in the frame of the trajectory, whatever frame is shown.
    assert np.allclose(places[:, :2], [[10.0, 5.0]] * 2, atol=0.5)
    filled = path.read_text().replace(",,,,", ",1,2,3,")
    path.write_text(filled)
    listed = read_control_points(path).points
    assert [point.name for point in listed] == ["P1", "P2"]
    assert np.allclose(listed[0].picked, places[0])
    loops = saved(opened, tmp_path, "loop").read_text()
    assert re.fullmatch(r"loops:\n- times: \[[\d.]+, [\d.]+\]\n", loops)
