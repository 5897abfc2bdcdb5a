# `make demo` and `make test` need only Python 3.11 or newer with venv; everything else is set up here.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# One thread per process: the tests and the tracer run processes of their own on all cores.
export OPENBLAS_NUM_THREADS := 1

.PHONY: demo test test-all test-windows test-wine wheel wheels-check release lint size bench blind docs audit lock sbom clean

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

test-all: lint docs test-windows
	$(BIN)/python -m pytest -n auto --dist loadfile

# The tests once more without fcntl, fork, most signals, and so on; the list is in that sitecustomize.
test-windows: $(VENV)/.test
	PYTHONPATH=tests/windows $(BIN)/python -m pytest -n auto --dist loadfile -m 'not slow'

# Windows' own Python, where there is Wine; it takes 1.5 GB of packages.
test-wine: wheel
	$(BIN)/python tests/windows/wine.py build/dist/*.whl

$(VENV)/release: | $(BIN)/python
	$(BIN)/python -m venv $@
	$@/bin/python -m pip install --quiet --disable-pip-version-check build twine

wheel: | $(VENV)/release
	rm -rf build/dist
	SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) $(VENV)/release/bin/python -m build --outdir build/dist .

# The dependencies exist as wheels for other systems: resolved as if there, nothing is installed.
wheels-check: wheel
	set -e; for version in 3.11 3.12 3.13; do \
	  for systems in "--platform win_amd64" "--platform macosx_11_0_arm64 --platform macosx_12_0_arm64 --platform macosx_14_0_arm64"; do \
	    $(PIP) --dry-run --ignore-installed --target build/none --only-binary=:all: \
	      --python-version $$version $$systems build/dist/*.whl; \
	    echo "$$version $$systems: all wheels are there"; \
	  done; \
	done

# The second build has to give the same bytes; the notes are the newest part of the changelog.
release: wheel
	sha256sum build/dist/*.whl build/dist/*.tar.gz > $(VENV)/release/sha256
	$(MAKE) wheel
	sha256sum --check $(VENV)/release/sha256
	$(VENV)/release/bin/twine check --strict build/dist/*.whl build/dist/*.tar.gz
	awk '/^## /{n++} n==1' CHANGELOG.md > build/dist/release-notes.md

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
	$(BIN)/python -m benchmarks all

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
