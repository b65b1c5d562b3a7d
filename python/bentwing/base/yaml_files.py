# SPDX-License-Identifier: MIT OR Apache-2.0
"""YAML files that users write."""

from __future__ import annotations

from typing import TYPE_CHECKING

import yaml

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.base.errors import InputError


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
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        msg = f"{path}: no such file; {advice}"
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); give a YAML text file"
    except UnicodeDecodeError as error:
        msg = f"{path}: cannot be read ({error}); give a YAML text file"
    except yaml.YAMLError as error:
        msg = f"{path}: not valid YAML ({' '.join(str(error).split())})"
    raise kind(msg)
