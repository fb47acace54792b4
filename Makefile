PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
PEERS := .bench
PEERS_READY := $(PEERS)/roboplan/.ready $(PEERS)/pink/.ready $(PEERS)/mink/.ready

.PHONY: help setup demo check test test-slow bench bench-setup clean

help:
	@echo "make demo       set up, then recover a failed grasp on the move; writes out/demo.rrd"
	@echo "make test       set up, then lint, type-check and run the fast tests"
	@echo "make test-slow  set up, then run the long tests"
	@echo "make bench      set up, then time the controller beside roboplan, pink and mink"

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

bench-setup: $(PEERS_READY)

$(PEERS)/%/.ready: pyproject.toml
	$(PYTHON) -m venv $(PEERS)/$*
	$(PEERS)/$*/bin/python -m pip install --quiet --upgrade "pip>=25.1"
	$(PEERS)/$*/bin/python -m pip install --quiet --group bench-$*
	@touch $@

bench: $(READY) bench-setup
	$(BIN)/motm bench wholebody --peers $(PEERS)

clean:
	rm -rf $(VENV) $(PEERS) out dist
