# `make demo` and `make test` need only Python 3.11 or newer with venv; everything else is set up here.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# One thread per process: the tests and the tracer run processes of their own on all cores.
export OPENBLAS_NUM_THREADS := 1

.PHONY: demo test lint bench docs clean

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: pyproject.toml | $(BIN)/python
	$(PIP) --editable .
	touch $@

$(VENV)/.test: pyproject.toml | $(BIN)/python
	$(PIP) --editable '.[test,cluster,importers,docs]'
	touch $@ $(VENV)/.demo

demo: $(VENV)/.demo
	$(BIN)/heli demo

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/mypy

test: lint
	$(BIN)/python -m pytest

docs: $(VENV)/.test
	$(BIN)/mkdocs build --strict

bench: $(VENV)/.test
	$(BIN)/python -m benchmarks.plant_step
	$(BIN)/python -m benchmarks.online_identifier
	$(BIN)/python -m benchmarks.master_speed
	$(BIN)/python -m benchmarks.unit_memory
	$(BIN)/python -m benchmarks.master_runs
	$(BIN)/python -m benchmarks.blind

clean:
	rm -rf $(VENV) build/*
