# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is public is listed, documented, importable and cheap; everything else is internal.

After scipy's test of the same name: what is neither listed nor internal became public by accident there.
"""

from __future__ import annotations

import ast
import pickle
import re
import subprocess
import sys
from importlib import import_module
from types import ModuleType

import pytest

import bentwing
from support.structure import PACKAGE, ROOT

PUBLIC = ["bentwing", *(f"bentwing.{name}" for name in bentwing.PACKAGES)]
# The command line is public by its commands; the values of `base` are in `bentwing` itself.
INTERNAL = {"__main__", "_core", "base", "cli", "fleet", "report", "reproduce", "run"}
NAMES = [(module, name) for module in PUBLIC for name in import_module(module).__all__]


def init(module):
    """The syntax tree of a public package."""
    path = PACKAGE.joinpath(*module.split(".")[1:], "__init__.py")
    return ast.parse(path.read_text(encoding="utf-8"))


def test_every_package_is_public_or_internal_and_not_both():
    found = {path.name.split(".")[0] for path in PACKAGE.iterdir()}
    found -= {"__init__", "__pycache__", "py"}
    assert found == INTERNAL | set(bentwing.PACKAGES)
    assert not INTERNAL & set(bentwing.PACKAGES)


@pytest.mark.parametrize("module", PUBLIC)
def test_public_names_are_those_of_all(module):
    package = import_module(module)
    listed = set(package.__all__) | (set(bentwing.PACKAGES) if package is bentwing else set())
    assert set(dir(package)) == listed


@pytest.mark.parametrize("module", PUBLIC)
def test_type_checkers_see_the_same_names_from_the_same_places(module):
    homes = {
        alias.name: node.module
        for node in ast.walk(init(module))
        if isinstance(node, ast.ImportFrom) and node.module.startswith("bentwing.")
        for alias in node.names
    }
    del homes["lazy"]
    package = import_module(module)
    assert set(homes) == set(package.__all__) - {"__version__"}
    for name, home in homes.items():
        assert getattr(package, name) is getattr(import_module(home), name)


@pytest.mark.parametrize(("module", "name"), NAMES)
def test_every_public_name_is_something_and_no_module(module, name):
    # A module of the same name would take the name's place once it is imported.
    value = getattr(import_module(module), name)
    assert value is not None
    assert not isinstance(value, ModuleType)
    folder = PACKAGE.joinpath(*module.split(".")[1:])
    assert not (folder / name).exists()
    assert not (folder / f"{name}.py").exists()


def test_every_public_name_has_its_entry_in_the_documentation_and_nothing_else_has():
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    documented = re.findall(r"^::: ([\w.]+)$", text, re.MULTILINE)
    assert len(documented) == len(set(documented))
    own = {id(getattr(bentwing, name)) for name in bentwing.__all__}
    # What `bentwing` gathers is documented there, and not once more with its package.
    expected = {
        f"{module}.{name}"
        for module, name in NAMES
        if name != "__version__"
        and (module == "bentwing" or id(getattr(import_module(module), name)) not in own)
    }
    assert set(documented) == expected


@pytest.mark.parametrize("name", bentwing.PACKAGES)
def test_a_public_package_is_there_without_importing_it(name):
    answer = loaded(f"import bentwing; bentwing.{name}")
    assert f"bentwing.{name}" in answer


@pytest.mark.parametrize("module", PUBLIC)
def test_an_unknown_name_is_an_attribute_error(module):
    with pytest.raises(AttributeError, match=f"module '{module}' has no attribute 'nothing'"):
        import_module(module).nothing  # noqa: B018


def test_importing_public_packages_loads_nothing_of_them():
    free = {"bentwing", "bentwing.base", "bentwing.base.lazy", *PUBLIC}
    assert loaded(f"import {', '.join(PUBLIC)}") == free


def test_the_help_page_of_the_command_line_needs_no_arrays():
    code = "import sys; sys.argv = ['bentwing', '--help']\nfrom bentwing.cli.main import run\n"
    assert not loaded(f"{code}try: run()\nexcept SystemExit: pass") & {"numpy", "pydantic"}


def loaded(code):
    """Modules of bentwing and the two slow packages that are there after `code`."""
    report = "import sys; print(*[m for m in sys.modules if m.startswith(('bentwing', 'numpy', 'pydantic'))])"
    answer = subprocess.run(
        [sys.executable, "-c", f"{code}\n{report}"], check=True, capture_output=True, text=True
    )
    names = answer.stdout.splitlines()[-1].split()
    return {name for name in names if name.startswith("bentwing") or "." not in name}


@pytest.mark.parametrize(
    "error", [getattr(bentwing, name) for name in bentwing.__all__ if name.endswith("Error")]
)
def test_errors_come_through_pickles(error):
    assert str(pickle.loads(pickle.dumps(error("what was found")))) == "what was found"


def test_the_log_is_silent_until_somebody_asks_for_it():
    code = "from bentwing.base.log import get_logger; get_logger('bentwing.map').warning('dropped')"
    speak = f"import logging; logging.basicConfig(); {code}"
    for source, said in ((code, ""), (speak, "WARNING:bentwing.map:dropped\n")):
        answer = subprocess.run(
            [sys.executable, "-c", source], check=True, capture_output=True, text=True
        )
        assert answer.stdout + answer.stderr == said
