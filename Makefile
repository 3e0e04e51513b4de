# make install  what a user needs, in .venv; the command is bin/tunneldb
# make demo     a simulated tunnel from its scan to leaks in QGIS, in ./demo: 2 minutes
# make demo-structure   a simulated steel structure and its spots: 1 minute
# make demo-canal       a simulated canal tunnel, above and below the water: 1.5 minutes
# make quick    the tests that need no server and are short: 1 minute
# make test     lint, types and all tests, against the wheel as a user would install it
# make faults   100 kills at random moments while a batch runs; KILLS=… and SEED=… for others
# make fuzz     10,000 malformed files and hostile words for all commands; CASES=…, FIRST=… and SEED=… for others
# make docs     the documentation as a site, in ./site
# make plugin   the QGIS plugin as a zip, in ./dist
# make bench    the main figures of docs/figures.md
# Each installs missing dependencies first: PostgreSQL with PostGIS by apt, Python packages into .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := $(shell find tunneldb sql migrations -type f -not -name '*.py[co]' -not -name '*.nb[ic]') pyproject.toml README.md LICENSE

# Else the tests are compiled anew in each run.
unexport PYTHONDONTWRITEBYTECODE

# Tests that may take hours.
ENDLESS := --timeout 0 -o faulthandler_timeout=0

.PHONY: install demo demo-structure demo-canal quick test tests faults fuzz docs plugin bench lint clean
.DELETE_ON_ERROR:

install: $(VENV)/wheel

$(VENV)/server:
	scripts/system-packages.sh server
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "tunneldb needs Python 3.11 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --upgrade pip
	touch $@

# The first pip installs new code of the same version, the second new dependencies.
$(VENV)/wheel: $(SOURCES) | $(VENV)/server
	rm -rf $(VENV)/dist
	$(BIN)/python -m pip wheel -q --no-deps --wheel-dir $(VENV)/dist .
	$(BIN)/python -m pip install -q --no-deps --force-reinstall $(VENV)/dist/*.whl
	$(BIN)/python -m pip install -q "$$(ls $(VENV)/dist/*.whl)[e57,ifc]"
	touch $@

# What tests and tools need beside that.
$(VENV)/development: pyproject.toml | $(VENV)/wheel
	$(BIN)/python -m pip install -q "$$(ls $(VENV)/dist/*.whl)[dev]"
	touch $@

$(VENV)/tests: | $(VENV)/server
	scripts/system-packages.sh server tests
	touch $@

# Loops are compiled once, while linting takes the other core: workers of tests that start together would each compile them all.
$(VENV)/compiled: $(VENV)/wheel
	scripts/compile.sh $(abspath $(BIN))/tunneldb
	touch $@

demo: install
	scripts/demo.sh $(abspath $(BIN))/tunneldb

demo-structure: install
	scripts/demo-structure.sh $(abspath $(BIN))/tunneldb

demo-canal: install
	scripts/demo-canal.sh $(abspath $(BIN))/tunneldb

lint: $(VENV)/wheel $(VENV)/development
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

# Not `python -m pytest`: that would put the source tree before the wheel. Linting takes a core for a minute, beside the tests.
tests: $(VENV)/wheel $(VENV)/development $(VENV)/tests $(VENV)/compiled
	$(BIN)/pytest -n 2 --dist loadgroup --no-loadscope-reorder -rs

quick: $(VENV)/wheel $(VENV)/development
	$(BIN)/pytest -n 2 --dist loadgroup --no-loadscope-reorder -m "not server and not slow" -rs

test: $(VENV)/wheel $(VENV)/development $(VENV)/tests
	$(MAKE) -j 2 lint tests

faults: install $(VENV)/development $(VENV)/tests $(VENV)/compiled
	KILLS=$${KILLS:-100} $(BIN)/pytest $(ENDLESS) -n 0 -s tests/faults/test_kills.py

fuzz: install $(VENV)/development $(VENV)/tests $(VENV)/compiled
	CASES=$(or $(CASES),10000) RIGHT=$(or $(RIGHT),1000) SECONDS=$(or $(SECONDS),inf) $(BIN)/pytest $(ENDLESS) -n 0 -s tests/cli/test_fuzz.py

docs: $(VENV)/wheel $(VENV)/development
	$(BIN)/python docs/generate_reference.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

plugin: $(VENV)/wheel
	$(BIN)/python scripts/package_plugin.py dist

bench: install $(VENV)/development
	$(BIN)/python -m benchmarks.run

clean:
	rm -rf $(VENV) build dist demo site .pytest_cache .mypy_cache .ruff_cache .hypothesis
