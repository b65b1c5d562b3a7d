# SPDX-License-Identifier: MIT OR Apache-2.0
# Everything a developer or the continuous integration types. `make help` lists the targets.

PYTHON ?= python3
WORKERS ?= 2
RUNS ?= 1000
FIRST_SEED ?= 1

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
CORE := python/bentwing/_core.abi3.so
OUSTER_SOURCE := python/bentwing/recording/packets/sensors.py
CORE_SOURCES := Cargo.toml Cargo.lock pyproject.toml \
	$(shell find crates -name '*.rs' -o -name Cargo.toml -o -name README.md)

# The tools look for an active environment; whatever the caller has active is not ours.
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
unexport CONDA_PREFIX PYTHONHOME PYTHONPATH

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:

##@ Set up and build

define require_python
@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	{ echo "$(PYTHON) is missing or too old: give Python 3.10 or newer as make PYTHON=..."; exit 1; }
endef

$(VENV)/.created:
	$(require_python)
	$(PYTHON) -m venv --clear $(VENV)
	@# Installing dependency groups needs pip 25.1; Debian 12 ships 23.
	$(PIP) install --quiet --upgrade 'pip>=25.1'
	@touch $@

# A changed pyproject.toml may name new tools; where it does not, this takes seconds.
$(VENV)/.tools: $(VENV)/.created pyproject.toml $(OUSTER_SOURCE)
	$(PIP) install --quiet --group dev
	@# It pins an older rosbags; to decode packets it needs none of its dependencies.
	$(PIP) install --quiet --no-deps ouster-sdk==$(shell sed -n 's/^OUSTER_VERSION = "\(.*\)".*/\1/p' $(OUSTER_SOURCE))
	@touch $@

$(VENV)/.docs-tools: $(VENV)/.created pyproject.toml
	$(PIP) install --quiet --group docs
	@touch $@

$(CORE): $(VENV)/.tools $(CORE_SOURCES)
	$(BIN)/maturin develop --release
	@touch $@

.PHONY: setup
setup: $(VENV)/.tools ## make .venv and install the developer's tools

.PHONY: browser
browser: ## a Chromium for the tests that open the report, where Debian's packages can be installed
	@command -v chromium >/dev/null || command -v google-chrome >/dev/null || (apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium) || \
		echo "no Chromium: the tests that open the report are skipped, which fails in the continuous integration"

.PHONY: extras
extras: setup ## packages of a gigabyte that single slow tests compare with
	$(PIP) install --quiet --group weekly

.PHONY: build
build: setup ## compile the core (release) and install the package in place
	$(BIN)/maturin develop --release
	@touch $(CORE)

.PHONY: build-dev
build-dev: setup ## the same without optimization: compiles fast, runs slowly
	$(BIN)/maturin develop
	@touch $(CORE)

.PHONY: wheel
wheel: setup ## build the wheel into dist/
	$(BIN)/maturin build --release --out dist

##@ Test

.PHONY: test
test: test-rust test-python ## all fast tests

.PHONY: test-rust
test-rust: $(VENV)/.created ## the crates' tests
	@# The optimized build of the dependencies is shared with the extension: compiling them twice takes minutes.
	cargo test --release --workspace

.PHONY: test-python
test-python: $(CORE) ## the package's fast tests
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile

.PHONY: test-all
test-all: test-rust $(CORE) ## also the slow ones
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile -m "slow or not slow"

.PHONY: campaign
campaign: $(CORE) ## commands with faults drawn by seeds, each in a process that is measured: a table
	PYTHONPATH=tests $(BIN)/python -m campaign --runs $(RUNS) --first-seed $(FIRST_SEED)

##@ Look after the code

.PHONY: fmt
fmt: setup ## format Rust and Python
	cargo fmt --all
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

.PHONY: check
check: check-rust check-python ## formatting, lints, types, stubs, documentation, spelling
	$(BIN)/typos

.PHONY: check-rust
check-rust: $(VENV)/.created ## rustfmt, clippy and rustdoc; warnings are errors
	cargo fmt --all --check
	@# With the profile of the build, which shares its macros and build scripts.
	cargo clippy --release --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps

.PHONY: check-python
check-python: $(CORE) $(if $(wildcard python/bentwing/_core.pyi),stubs) ## ruff, mypy, stubs
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

.PHONY: stubs
stubs: $(CORE) ## compare the hand-written stubs with the compiled core
	$(BIN)/python -m mypy.stubtest bentwing._core

.PHONY: structure
structure: setup ## who imports whom, and the pictures of it in the documentation
	$(BIN)/python tests/support/structure.py
	$(BIN)/python tests/support/structure.py --draw

.PHONY: deny
deny: ## licences, advisories and sources of the crates (needs cargo-deny)
	@cargo deny --version >/dev/null 2>&1 || \
		{ echo "cargo-deny is missing: cargo install --locked cargo-deny"; exit 1; }
	cargo deny check

##@ Look at the results

.PHONY: bench
bench: $(CORE) ## kernels (criterion), then accuracy and speed from recording to map
	cargo bench --workspace --bench '*'
	$(BIN)/python -m benches pipeline $(SCENARIOS)

.PHONY: docs
docs: $(VENV)/.docs-tools $(CORE) ## build the documentation into site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# Not with the developer's environment: what a user does, from the clone to the map.
DEMO_PIP := env -u VIRTUAL_ENV -u PYO3_PYTHON demo/.venv/bin/python -m pip --disable-pip-version-check

.PHONY: demo
demo: ## from a fresh clone to a map: needs Python 3.10 with venv, cargo, git and make
	$(require_python)
	rm -rf demo/dist demo/recording demo/run
	$(PYTHON) -m venv demo/.venv
	$(DEMO_PIP) wheel --no-deps --wheel-dir demo/dist .
	$(DEMO_PIP) install demo/dist/bentwing-*.whl
	@# The version may be the same as that of an earlier demo's.
	$(DEMO_PIP) install --force-reinstall --no-deps demo/dist/bentwing-*.whl
	demo/.venv/bin/bentwing simulate courtyard -o demo/recording --duration 30
	demo/.venv/bin/bentwing map demo/recording/recording.bag \
		--payload demo/recording/payload.yaml -o demo/run
	@printf '  %-8s %s\n' map demo/run/map.laz picture demo/run/map_top.png report demo/run/report.html

##@ This file

.PHONY: clean
clean: ## remove everything that was built
	rm -rf .venv target dist site demo $(CORE) .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find python tests benches -name __pycache__ -prune -exec rm -rf {} +

.PHONY: help
help: ## this list
	@awk 'BEGIN { FS = ":.*## " } \
		/^##@/ { printf "\n%s\n", substr($$0, 5) } \
		/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
