# hrp2_door_impact: see README.md. Everything is set up in .venv from pinned dependencies.

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

DOOR ?= paper
TARGET_DEG ?= 25
HOLD ?= hold
GUI ?= 0

.PHONY: help setup demo up test lint bench sweep clean

help:
	@echo "make demo    find out the door, plan the hit, open the door, show the result (out/demo/)"
	@echo "             DOOR=paper|size2|size3|size4|FILE.yaml TARGET_DEG=25 GUI=1"
	@echo "make up      the same nodes, left running until Ctrl-C"
	@echo "make test    every test          make lint    ruff and mypy"

setup: $(READY)

PACKAGE_FILES := $(wildcard ros2_ws/src/*/package.xml ros2_ws/src/*/setup.py ros2_ws/src/*/setup.cfg)

$(BIN)/python:
	@python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "hrp2_door_impact needs Python 3.11 or newer, found $$(python3 -V)"; exit 1; }
	@python3 -c 'import venv, ensurepip' || \
	  { echo "python3-venv is missing: apt install python3-venv"; exit 1; }
	python3 -m venv $(VENV)

$(VENV)/.requirements: requirements.txt | $(BIN)/python
	@echo "installing the dependencies into $(VENV), about a minute"
	@$(BIN)/pip install --quiet --disable-pip-version-check -r requirements.txt
	@touch $@

$(READY): $(VENV)/.requirements embedded/pyproject.toml $(PACKAGE_FILES)
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e embedded
	$(BIN)/python -m ros2_embedded.install ros2_ws/src
	@touch $@

demo: $(READY)
	@$(BIN)/ros2 run door_impact_bringup demo --door "$(DOOR)" --target-deg "$(TARGET_DEG)" \
	  --ending "$(HOLD)" --gui "$(GUI)" --out out/demo

up: $(READY)
	@$(BIN)/ros2 launch door_impact_bringup bringup.launch.yaml door:="$(DOOR)" gui:="$(GUI)"

test: $(READY)
	@$(BIN)/python -m pytest

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/mypy

bench sweep:
	@echo "make $@ comes with a later version" >&2; exit 2

clean:
	rm -rf $(VENV) out
