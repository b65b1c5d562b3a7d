# SPDX-License-Identifier: MIT OR Apache-2.0
"""A fleet without sensors: recordings of a few bytes, and maps that take no time."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bentwing.base.plain import plain
from bentwing.base.yaml_files import parse_yaml
from bentwing.evaluate.verdict import verdict_of
from bentwing.fleet import process
from bentwing.fleet.process import BUSY, ProcessDiedError
from bentwing.run.request import inputs_of, request_of
from bentwing.run.settings import RunSettings
from support.finished_runs import finished_run

POINTS = np.random.default_rng(1).uniform(-5, 5, (50, 3))


class FakeWork:
    """Stands for the processes: maps what lies in a file, and merges what begins with the same letter.

    Attributes
    ----------
    calls : how often each recording was mapped, and how often the runs were merged
    deaths : how often the work of each name is still to die
    twins : names whose work another process does first
    """

    def __init__(self) -> None:
        self.calls: Counter[str] = Counter()
        self.deaths: Counter[str] = Counter()
        self.twins: set[str] = set()

    def __call__(self, work, order, name, _processes):
        self.calls[name] += 1
        if self.deaths[name]:
            self.deaths[name] -= 1
            msg = f"the process of {name} was killed"
            raise ProcessDiedError(msg)
        if name in self.twins:
            self._map({**order, "out": Path(order["out"]).parent / name})
            return {BUSY: "another process is writing there"}
        return self._map(order) if work == "map" else self._merge(order)

    def _map(self, order):
        recordings = [Path(path) for path in order["recordings"]]
        assert all(path.is_absolute() for path in recordings)  # a worker is in another folder
        content = recordings[0].read_text()
        if content.startswith("refused"):
            return {"refused": f"{recordings[0]}: no message could be read"}
        if content.startswith("failed"):
            return {"failed": "too few points"}
        settings = RunSettings.model_validate(parse_yaml(order["settings"]))
        marks = settings.georeferencing.control_points
        assert marks is None or marks.is_absolute()
        read = [*recordings, *([Path(order["payload"])] if order["payload"] else [])]
        request = request_of(settings, inputs_of(read))
        write_run(Path(order["out"]), request, recordings)
        return {}

    def _merge(self, order):
        letters: dict[str, list[str]] = {}
        for name, folder in order["runs"].items():
            assert Path(folder).is_dir()
            letters.setdefault(name[0], []).append(name)
        answers = []
        for names in letters.values():
            answer = {"runs": names, "n_links": len(names) - 1, "folder": None}
            answer["verdict"] = verdict_of([]).to_json()
            if len(names) > 1:
                request = "-".join(names)
                earlier = order["made"].get(request)
                answer["is_earlier"] = earlier is not None
                answer["folder"] = Path(earlier).name if earlier else names[0][0]
                if earlier is None:
                    self.calls[request] += 1
                    write_run(Path(order["out"]) / answer["folder"], request, [])
            answers.append(answer)
        return {"groups": answers, "places": {"parts": [], "candidates": []}}


def write_run(folder, request, recordings):
    """Write a run as a process leaves it."""
    finished_run(folder, POINTS)
    (folder / "report.html").write_text("a report")
    record = json.loads((folder / "run.json").read_text())
    record |= {
        "request": request,
        "recordings": [path.resolve() for path in recordings],
        "verdict": verdict_of([]),
        "counts": {"map.written": len(POINTS)},
        "files": [*record["files"], "report.html"],
    }
    (folder / "run.json").write_text(json.dumps(plain(record)))


@pytest.fixture
def work(monkeypatch):
    """Put the fake in the place of the processes."""
    fake = FakeWork()
    monkeypatch.setattr(process, "run_process", fake)
    monkeypatch.setattr(process, "_PAUSE", 0.0)
    return fake


@pytest.fixture
def manifest(tmp_path):
    """Write recordings and a manifest of them: names with what the files hold."""

    def write(**contents):
        rows = ["name,recording"]
        for name, content in contents.items():
            (tmp_path / f"{name}.bag").write_text(content)
            rows.append(f"{name},{name}.bag")
        (tmp_path / "flights.csv").write_text("\n".join(rows))
        return tmp_path / "flights.csv"

    return write
