PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: help setup demo check test test-slow clean

help:
	@echo "make demo       set up, then recover a failed grasp on the move; writes out/demo.rrd"
	@echo "make test       set up, then lint, type-check and run the fast tests"
	@echo "make test-slow  set up, then run the long tests"

setup: $(READY)

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --editable . --group dev
	@touch $@

demo: $(READY)
	@mkdir -p out
	$(BIN)/motm run obstructed_turn --failure-delay 6 --record out/demo.rrd
	@echo "Look at it with: $(BIN)/rerun out/demo.rrd"

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: check
	$(BIN)/pytest -n 2 -m "not slow"

test-slow: $(READY)
	$(BIN)/pytest -n 2 -m slow

clean:
	rm -rf $(VENV) out dist
