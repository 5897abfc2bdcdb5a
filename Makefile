# `make demo` and `make test` need only Python 3.11 or newer with venv; everything else is set up here.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# One thread per process: the tests and the tracer run processes of their own on all cores.
export OPENBLAS_NUM_THREADS := 1

.PHONY: demo test test-all lint size bench blind docs audit lock sbom clean

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)

# What the demonstration installs is pinned, and every file has to have its hash, for all Pythons from 3.11 on.
$(VENV)/.demo: pyproject.toml requirements/demo.txt | $(BIN)/python
	$(PIP) --require-hashes --requirement requirements/demo.txt
	$(PIP) --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/.test: pyproject.toml | $(BIN)/python
	$(PIP) --editable '.[test,cluster,formats,importers,docs]'
	$(PIP) --no-deps 'axe-playwright-python>=0.1.8'  # for the axe-core in it; the tests drive Chromium themselves
	touch $@ $(VENV)/.demo

$(VENV)/.bench: pyproject.toml $(VENV)/.test
	$(PIP) --editable '.[bench]'
	touch $@

demo: $(VENV)/.demo
	$(BIN)/heli demo

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/mypy

# What takes long, as the commands of the documentation, whole campaigns, and most faults that need processes, is in
# test-all alone.
test: lint
	$(BIN)/python -m pytest -n auto --dist loadfile -m 'not slow'

test-all: lint docs
	$(BIN)/python -m pytest -n auto --dist loadfile

# Lines and files of every folder, beside what they are to be.
size:
	@$(PYTHON) -m benchmarks.size

# Pictures are drawn again, the site is built from the pages.
docs: $(VENV)/.test
	$(BIN)/python -m benchmarks figures
	$(BIN)/mkdocs build --strict

# Some quarter of an hour on a machine that has nothing else to do; writes docs/benchmarks.md. One section alone:
# .venv/bin/python -m benchmarks NAME.
bench: $(VENV)/.bench
	$(BIN)/python -m benchmarks

# The blind battery takes more than an hour and is no part of bench. It continues where it stopped unless code that a
# diagnosis depends on has changed since.
blind: $(VENV)/.test
	$(BIN)/python -m benchmarks blind

# Known vulnerabilities of all that is pinned for the demonstration. Exit code 2: no advisory database could be asked.
audit: | $(BIN)/python
	$(BIN)/python -m venv $(VENV)/audit
	$(VENV)/audit/bin/python -m pip install --quiet --disable-pip-version-check pip-audit
	$(VENV)/audit/bin/python requirements/audit.py

# Pin again what the demonstration needs, with the newest versions that pyproject.toml allows.
lock:
	$(PYTHON) -m venv $(VENV)/lock
	$(VENV)/lock/bin/python -m pip install --quiet --disable-pip-version-check uv
	$(VENV)/lock/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url --no-header pyproject.toml requirements/build.in --output-file requirements/demo.txt

# What is installed for the demonstration, as a CycloneDX bill of materials.
sbom: $(VENV)/.demo
	$(BIN)/python -m venv $(VENV)/sbom
	$(VENV)/sbom/bin/python -m pip install --quiet --disable-pip-version-check cyclonedx-bom
	$(VENV)/sbom/bin/cyclonedx-py environment $(BIN)/python --pyproject pyproject.toml --output-format JSON \
	  --output-reproducible --output-file build/sbom.cdx.json

clean:
	rm -rf $(VENV) build/*
