# SPDX-License-Identifier: LGPL-2.1-or-later
#
# On a fresh Debian or Ubuntu with git, make and Python 3.10 or later `make demo` and `make test` do all the rest.

.DEFAULT_GOAL := help
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.NOTPARALLEL:
MAKEFLAGS += --no-print-directory

PYTHON ?=
export PYTHON
UV ?= uv

BIN := .venv/bin
PY := $(BIN)/python
SOURCES := $(wildcard core raymaps_wb tests examples benchmarks tools *.py)

.PHONY: help
help: ## list the targets
	@echo "Ray Maps: make TARGET"
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-12s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))
	@echo "PYTHON=/path/to/python3 names the Python (3.10 to 3.14) that the private environment is made with."

.PHONY: environment
environment: ## make .venv with the locked packages and the command raymaps
	@tools/setup.sh environment

.PHONY: graphics
graphics: environment
	@tools/setup.sh graphics

.PHONY: demo
demo: graphics ## simulate an example, ask about its rays, leave the results in out/
	@$(PY) examples/demo.py

.PHONY: test
test: graphics ## run all tests, those of the workbench inside a real FreeCAD among them
	@tools/setup.sh workbench-tests
	@failed=""; \
	echo "== tests of the core"; \
	$(PY) -m pytest $(PYTEST_ARGS) || failed="$$failed core"; \
	echo "== tests of the workbench, in FreeCAD"; \
	$(PY) tests/workbench/run.py || failed="$$failed workbench"; \
	if [ -n "$$failed" ]; then echo "raymaps: tests failed:$$failed" >&2; exit 1; fi; \
	echo "All tests passed."

.PHONY: lint
lint: environment ## check style and types
	@$(BIN)/ruff check $(SOURCES)
	@$(BIN)/ruff format --check --quiet $(SOURCES) || \
		{ echo "raymaps: some files are not formatted: run make format" >&2; exit 1; }
	@$(BIN)/mypy

.PHONY: format
format: environment ## apply what style can be applied
	@$(BIN)/ruff check --fix $(SOURCES) || true
	@$(BIN)/ruff format $(SOURCES)

.PHONY: freecad
freecad: environment ## open FreeCAD with the workbench and an example
	@tools/freecad.sh

.PHONY: bench
bench: environment ## measure, beside a bare Embree loop, DuckDB and Polars
	@$(PY) -m benchmarks

.PHONY: lock
lock: ## resolve the newest versions of all packages into the lock files (needs uv)
	@command -v $(UV) >/dev/null || \
		{ echo "raymaps: make lock needs uv: install it, or name it: make lock UV=/path/to/uv" >&2; exit 1; }
	@UV=$(UV) tools/lock.sh

.PHONY: clean
clean: ## remove .venv, out/ and all caches
	@rm -rf .venv out .mypy_cache .ruff_cache .pytest_cache build dist core/raymaps.egg-info
	@find . -name .git -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +
