# SPDX-License-Identifier: MIT OR Apache-2.0
"""YAML files that users write."""

from __future__ import annotations

from typing import TYPE_CHECKING

import yaml
from yaml.constructor import ConstructorError

from bentwing.base.regular_file import require_regular

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.base.errors import InputError

MOST_OF_YAML = 2**20  # bytes; settings and heads have some thousand
_DEEPEST = 50  # sections in sections


class _Loader(yaml.SafeLoader):
    """Says where a value stands that is none: `2024-13-45`, `!!int x`, a text with a NUL."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> object:  # noqa: FBT001, FBT002 - as yaml calls it
        try:
            value = super().construct_object(node, deep)
        except (ArithmeticError, AttributeError, LookupError, ValueError) as error:
            kind = node.tag.rsplit(":", 1)[-1]
            problem = f"{str(node.value)[:40]!r} is no {kind} ({error})"
            raise ConstructorError(None, None, problem, node.start_mark) from error
        if isinstance(value, str) and "\0" in value:
            problem = f"{value[:40]!r} has a NUL, which no name can have"
            raise ConstructorError(None, None, problem, node.start_mark)
        return value


def parse_yaml(text: str) -> object:
    """Return what a text says.

    Raises
    ------
    yaml.YAMLError
        It is not YAML, has values that are none, repeats parts of itself by aliases, or is nested too deeply.
    """
    depth = 0
    # Events come without recursion, and before anything that an alias multiplies is made.
    for event in yaml.parse(text, yaml.SafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise _refused("an alias (*name) is not read; write the value itself", event)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            raise _refused(f"more than {_DEEPEST} sections in each other", event)
    return yaml.load(text, _Loader)


def _refused(problem: str, event: yaml.Event) -> yaml.YAMLError:
    line = event.start_mark.line + 1 if event.start_mark else 0
    return yaml.YAMLError(f"{problem}, line {line}")


def read_yaml(path: Path, advice: str, kind: type[InputError]) -> object:
    """Return what a file says.

    Parameters
    ----------
    path : the file
    advice : what to give instead of a file that does not exist
    kind : of the error

    Raises
    ------
    InputError
        Of this kind, if the file cannot be read or is not YAML.
    """
    try:
        require_regular(path, kind=kind)
        with path.open("rb") as file:
            data = file.read(MOST_OF_YAML + 1)
        if len(data) > MOST_OF_YAML:
            msg = f"{path}: has more than {MOST_OF_YAML} bytes; give a YAML text file of fewer"
            raise kind(msg)
        return parse_yaml(data.decode("utf-8"))
    except FileNotFoundError:
        msg = f"{path}: no such file; {advice}"
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); give a YAML text file"
    except UnicodeDecodeError as error:
        msg = f"{path}: cannot be read ({error}); give a YAML text file"
    except yaml.YAMLError as error:
        msg = f"{path}: not valid YAML ({' '.join(str(error).split())})"
    raise kind(msg)
