# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of a run chosen by a file, options and assignments, as `--settings` and `--set` give them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from bentwing.base.errors import InputError, UsageError
from bentwing.base.plain import plain
from bentwing.base.yaml_files import parse_yaml, read_yaml
from bentwing.odometry import ESTIMATORS
from bentwing.odometry.registry import require_settings
from bentwing.recording.payload import Payload, PayloadLike, as_payload
from bentwing.run.settings import RunSettings, validated

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from bentwing.odometry import EstimatorName, EstimatorSettings

PAYLOAD = "payload"


def choose(
    file: Path | None,
    assignments: Iterable[str],
    payload: PayloadLike,
    options: Mapping[str, Any],
) -> RunSettings:
    """Return the settings of a run: defaults, under a file, under options, under assignments.

    Parameters
    ----------
    file : of --settings
    assignments : of --set
    payload : the sensor head, or its file; None where a settings file may describe it
    options : nested settings that other options give

    Raises
    ------
    InputError
        If the settings file or the payload cannot be used.
    UsageError
        If an assignment names no setting or a value that cannot be, or options contradict the file.
    """
    held = {} if file is None else read_settings(file)
    values = merged(held, options)
    values["estimator"] = estimator = _estimator(held, options.get("estimator"), file)
    values = merged(values, changes_of(assignments, estimator))
    if payload is not None:
        values[PAYLOAD] = _payload(held, payload, file)
    return validated(RunSettings, values, "--set")


def as_run_settings(
    *,
    estimator: EstimatorName | None = None,
    payload: PayloadLike = None,
    settings: EstimatorSettings | Path | str | None = None,
    **values: Any,  # noqa: ANN401 - the model checks them
) -> RunSettings:
    """Return the settings of a run from the arguments of a call, in which None is the default.

    Parameters
    ----------
    settings : of the estimator, or a file as of `--settings`
    """
    options = given(estimator=estimator, **values)
    if isinstance(settings, (str, Path)):
        return choose(Path(settings), [], payload, options)
    if settings is not None:
        name = estimator or RunSettings().estimator
        require_settings(name, settings)
        options[name] = settings
    return choose(None, [], payload, options)


def read_settings(path: Path) -> dict[str, Any]:
    """Return what a settings file says, which may be a part of what --print-settings prints."""
    advice = "give settings as `bentwing map --print-settings` prints them"
    values = read_yaml(path, advice, InputError)
    if not isinstance(values, dict):
        msg = f"{path}: holds no settings; {advice}"
        raise InputError(msg)
    validated(RunSettings, values, path, InputError)
    return values


def changes_of(assignments: Iterable[str], estimator: str) -> dict[str, Any]:
    """Return assignments as nested settings; values are YAML.

    `loop_closure.stretch=4` becomes `{"loop_closure": {"stretch": 4}}`. Names that are none of the run's
    are those of the estimator: `window=4` becomes `{"continuous": {"window": 4}}`.
    """
    changes: dict[str, Any] = {}
    for text in assignments:
        name, _, value = text.partition("=")
        keys = [key.strip() for key in name.split(".")]
        if not all(keys) or not value.strip():
            msg = f"--set {text!r}: give a name and a value, such as --set window=4"
            raise UsageError(msg)
        if keys[0] not in RunSettings.model_fields:
            keys.insert(0, estimator)
        if keys[0] in {PAYLOAD, "estimator", *ESTIMATORS} - {estimator}:
            msg = f"--set {text!r}: give --payload and --estimator instead, and settings of {estimator}"
            raise UsageError(msg)
        try:
            change: Any = parse_yaml(value)
        except yaml.YAMLError:
            msg = f"--set {text!r}: the value is not valid YAML"
            raise UsageError(msg) from None
        for key in reversed(keys):
            change = {key: change}
        changes = merged(changes, change)
    return changes


def merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested mappings with changes: a mapping is changed within, anything else replaced."""
    new = dict(base)
    for key, value in changes.items():
        old = base.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            new[key] = merged(old, value)
        else:
            new[key] = value
    return new


def given(**values: Any) -> dict[str, Any]:  # noqa: ANN401 - of any option
    """Return the options that were given: those that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def _estimator(held: Mapping[str, Any], asked: str | None, file: Path | None) -> str:
    """Return the estimator that is asked for, or whose settings a file holds."""
    sections = [name for name in ESTIMATORS if name in held]
    default = sections[0] if len(sections) == 1 else RunSettings().estimator
    chosen: str = asked or held.get("estimator", default)
    if sections and chosen not in sections:
        msg = (
            f"{file} holds settings of {' and '.join(sections)}, but the estimator is {chosen}: "
            "leave one of them out"
        )
        raise UsageError(msg)
    return chosen


def _payload(held: Mapping[str, Any], payload: PayloadLike, file: Path | None) -> Payload:
    """Return the sensor head, which a settings file must not describe in another way."""
    head = as_payload(payload)
    if PAYLOAD in held and plain(Payload.model_validate(held[PAYLOAD])) != plain(head):
        msg = f"{file} describes another sensor head than the payload given: leave one of them out"
        raise UsageError(msg)
    return head
