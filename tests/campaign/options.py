# SPDX-License-Identifier: MIT OR Apache-2.0
"""Values that options and settings should not have, for every option that there is."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from bentwing.cli.commands import COMMANDS, load
from bentwing.odometry import ESTIMATORS
from bentwing.run.settings import RunSettings

if TYPE_CHECKING:
    import random
    from collections.abc import Callable, Iterator

    from campaign.faults import Healthy

VALUES = (
    "nan", "inf", "-inf", "-1", "-0.0", "1e308", "-1e308", "1e-308", "1e999", "9" * 400, "", " ",
    "é", "\u202ehtap", "0x10", "1_000", "[]", "{}", "null", "a" * 5000, "a=b=c", "%s%n", "../..",
    "{a: [1, {b: 2}]}", "*a", "&a [*a]", "!!python/object:os.system", "-- --",
)  # fmt: skip
# What runs for hours where a value is fit is tried with the others only.
_LONG = frozenset({"reproduce"})


def hostile_option(healthy: Healthy, folder: Path, draw: random.Random) -> list[Any]:
    """A command with one value that does not fit."""
    if draw.random() < 0.5:
        return _setting(healthy, folder, draw)
    named = [(name, option) for name in COMMANDS if name not in _LONG for option in _valued(name)]
    name, option = draw.choice(named)
    return [*whole(name, healthy, folder), option, draw.choice(VALUES)]


def _valued(command: str) -> list[str]:
    """The options of a command that take a value, but for the folder of its results."""
    params = [p for p in load(command).params if p.param_type_name == "option"]
    return [p.opts[0] for p in params if not p.is_flag and p.name not in {"out", "help"}]


def whole(name: str, healthy: Healthy, folder: Path) -> list[Any]:
    """A command that ends well and soon, and writes into a folder."""
    bag, run, out = healthy.folder / "recording.bag", healthy.run, folder / "out"
    described = ["-p", healthy.payload]
    short = ["--set", "duration=4"]
    arguments: dict[str, Callable[[], list[Any]]] = {
        "map": lambda: [bag, *described, "-o", out, *short],
        "localize": lambda: [bag, *described, "--map", run, "-o", out, "--set", "duration=12"],
        "fleet": lambda: [
            _one_recording(bag, folder),
            *described,
            "-o",
            out,
            "--workers",
            "1",
            *short,
        ],
        "merge": lambda: [run, healthy.later(), "-o", out],
        "export": lambda: [run, "-o", folder / "out.ply"],
        "info": lambda: [bag, *described],
        "live": lambda: ["--ros2", *described, "--patience", "1", "--duration", "1"],
        "payload": lambda: ["init", bag, "-o", folder / "out.yaml"],
        "calibrate": lambda: [bag, *described, "-o", out],
        "plan": lambda: [healthy.payload],
        "evaluate": lambda: [run, "-o", out],
        "report": lambda: [_copied(run, folder)],
        "section": lambda: [run, "-o", folder / "out.svg"],
        "terrain": lambda: [run, "-o", folder / "out.tif"],
        "volume": lambda: [run, "--area", _area(folder)],
        "mesh": lambda: [run, "--spacing", "0.2", "-o", folder / "out.ply"],
        "view": lambda: [run, "--save", folder / "out.rrd"],
        "simulate": lambda: ["office", "--duration", "22", "-o", out],
        "reproduce": lambda: ["kaul2015", "--quick", "--part", "flight", "-o", out],
    }
    return [name, *arguments[name]()]


def _copied(run: Path, folder: Path) -> Path:
    return Path(shutil.copytree(run, folder / "given"))


def _one_recording(bag: Path, folder: Path) -> Path:
    (folder / "flights.csv").write_text(f"recording\n{bag}\n", encoding="utf-8")
    return folder / "flights.csv"


def _area(folder: Path) -> Path:
    ring = "[[-1, -1], [1, -1], [1, 1], [-1, -1]]"
    area = f'{{"type": "Polygon", "coordinates": [{ring}]}}'
    (folder / "area.geojson").write_text(area, encoding="utf-8")
    return folder / "area.geojson"


def _setting(healthy: Healthy, folder: Path, draw: random.Random) -> list[Any]:
    """A setting at an end of its range, beyond it, or of another type."""
    estimator = draw.choice([*ESTIMATORS])
    names = [n for n in settings() if n.split(".")[0] not in {*ESTIMATORS} - {estimator}]
    name = draw.choice(names)
    field = _field(name)
    ends = [
        getattr(mark, end)
        for mark in getattr(field, "metadata", [])
        for end in ("ge", "gt", "le", "lt")
        if hasattr(mark, end)
    ]
    value = draw.choice([*map(str, ends), *map(str, ends), draw.choice(VALUES)])
    command = whole("map", healthy, folder)
    return [*command, "--estimator", estimator, "--set", f"{name}={value}"]


def settings(model: type[BaseModel] = RunSettings, before: str = "") -> Iterator[str]:
    """The names of all settings of a run but for the head's."""
    for name in model.model_fields:
        inner = _model(model, name)
        if name == "payload":
            continue
        if inner is None:
            yield before + name
        else:
            yield from settings(inner, f"{before}{name}.")


def _model(model: type[BaseModel], name: str) -> type[BaseModel] | None:
    default = model.model_fields[name].get_default(call_default_factory=True)
    return type(default) if isinstance(default, BaseModel) else None


def _field(name: str) -> Any:
    model: type[BaseModel] = RunSettings
    *parents, last = name.split(".")
    for parent in parents:
        found = _model(model, parent)
        assert found is not None
        model = found
    return model.model_fields[last]
