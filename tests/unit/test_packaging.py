# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is written twice for packages of several systems says the same."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from bentwing.base.memory import memory_of_machine, peak_memory
from bentwing.simulate.trajectories import _phases

tomllib = pytest.importorskip("tomllib", reason="Python 3.10 has no tomllib")

ROOT = Path(__file__).parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
# What PyPI and conda-forge call the same, and extras that are packages of their own there.
ON_CONDA = {"laspy[lazrs]": ("laspy", "lazrs-python")}
RELEASED = {
    "x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu", "x86_64-unknown-linux-musl",
    "aarch64-unknown-linux-musl", "x86_64-apple-darwin", "aarch64-apple-darwin", "x86_64-pc-windows-msvc",
}  # fmt: skip


def toml(name):
    return tomllib.loads((ROOT / name).read_text(encoding="utf-8"))


def recipe():
    return yaml.safe_load(
        (ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    )


def test_the_version_is_the_same_everywhere():
    version = toml("Cargo.toml")["workspace"]["package"]["version"]
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"]
    assert version == str(cited) == recipe()["context"]["version"]


def test_the_recipe_of_conda_needs_what_the_package_needs():
    project = toml("pyproject.toml")
    wanted = {f"python {project['project']['requires-python']}"}
    for line in project["project"]["dependencies"]:
        name, bounds = re.fullmatch(r"([\w.\-\[\]]+)(.*)", line.partition(";")[0].strip()).groups()
        first, *others = ON_CONDA.get(name, (name,))
        wanted |= {f"{first} {bounds}", *others}
    assert set(recipe()["requirements"]["run"]) == wanted
    (maturin,) = project["build-system"]["requires"]
    assert maturin.replace(">", " >", 1) in recipe()["requirements"]["host"]


def test_the_container_is_built_with_the_rust_that_is_promised():
    promised = toml("Cargo.toml")["workspace"]["package"]["rust-version"]
    text = (ROOT / "Containerfile").read_text(encoding="utf-8")
    assert f"FROM rust:{promised}-" in text
    extras = re.search(r"\$\{wheel\}\[([\w,]+)\]", text).group(1).split(",")
    assert set(extras) <= set(toml("pyproject.toml")["project"]["optional-dependencies"])


def test_licences_are_checked_for_every_system_with_a_wheel():
    assert set(toml("deny.toml")["graph"]["targets"]) == RELEASED


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_may_read_only_and_every_job_ends(path):
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert workflow["permissions"] == {"contents": "read"}
    for job in workflow["jobs"].values():
        assert job["timeout-minutes"] <= 360
        needed = job.get("needs", [])
        assert ({needed} if isinstance(needed, str) else set(needed)) <= set(workflow["jobs"])


def test_what_is_published_was_built_for_every_system_installed_and_tried():
    workflow = yaml.safe_load((ROOT / ".github/workflows/wheels.yml").read_text(encoding="utf-8"))
    jobs = workflow["jobs"]
    publish = jobs["publish"]
    assert publish["if"] == "github.ref_type == 'tag'"
    assert publish["permissions"]["id-token"] == "write"
    assert {"install", "install-musl", "source", "container"} <= set(publish["needs"])
    built = {
        f"{libc}-{target}"
        for libc in jobs["linux"]["strategy"]["matrix"]["libc"]
        for target in jobs["linux"]["strategy"]["matrix"]["target"]
    }
    built |= {f"macos-{target}" for target in jobs["macos"]["strategy"]["matrix"]["target"]}
    built.add("windows-x64")
    tried = jobs["install"]["strategy"]["matrix"]
    names = {*tried["wheel"], *(one["wheel"] for one in tried["include"])}
    assert names <= built
    assert built - names == {"musllinux-x86_64", "musllinux-aarch64"}  # the first in install-musl


def test_the_flights_with_which_packages_are_tried_are_long_enough():
    """Rest, climb, descent and landing of the slowest flight through the courtyard take up to 20 s."""
    files = [*WORKFLOWS, ROOT / "packaging" / "conda" / "recipe.yaml"]
    found = [
        float(duration)
        for path in files
        for duration in re.findall(
            r"bentwing simulate .*--duration (\d+)", path.read_text(encoding="utf-8")
        )
    ]
    assert len(found) == 4
    rng = np.random.default_rng(101)
    for duration in found:
        for _ in range(100):
            _phases(rng, duration, 3.0)  # refuses what is too short


def test_the_memory_of_the_process_is_part_of_that_of_the_machine():
    assert 1e7 < peak_memory() < memory_of_machine()
