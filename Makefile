# hrp2_door_impact: see README.md.

# In a shell where ROS 2 is sourced, colcon builds the packages and ROS 2 runs them; elsewhere the
# embedded runtime does, from pinned dependencies in .venv.
ifneq ($(and $(ROS_DISTRO),$(AMENT_PREFIX_PATH)),)
READY := ros2_ws/install/.ready
ENV := . ros2_ws/install/local_setup.sh &&
PYTHON := $(ENV) exec python3
ROS2 := $(ENV) exec ros2
RUNTIME :=
WORKERS :=
SITE_TOOLS :=
else
READY := .venv/.ready
PYTHON := .venv/bin/python
ROS2 := .venv/bin/ros2
SITE_TOOLS := .venv/.site
RUNTIME := embedded/tests
# One worker more than cores: tests that wait for processes leave their core to others.
WORKERS := -n $(shell expr $$(nproc) + 1) --maxprocesses 8 --dist loadscope --no-loadscope-reorder --max-worker-restart 0
endif
VENV := .venv
BIN := $(VENV)/bin

DOOR ?= paper
TARGET_DEG ?= 25
# HOLD is an older name of ENDING.
ENDING ?= $(or $(HOLD),hold)
RUN_UP ?= mcv50
ENGINE ?= pybullet
OUT ?= out/demo
GUI ?= 0
VIEW ?= 1
HITS ?= 1
KIND ?= hit
N ?= 50
SEED ?= 1

# Dozens of processes start faster when Python keeps what it has compiled.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup demo up test test-all test-runtime test-view screenshots lint docs bench sweep faults clean

help:
	@echo "make demo    find out the door, plan the hit, open the door, show the result (out/demo/)"
	@echo "             DOOR=paper|size2|size3|size4|FILE.yaml TARGET_DEG=25 RUN_UP=mcv50|zmp_limited"
	@echo "             ENDING=hold|retreat ENGINE=pybullet|mujoco GUI=1 HITS=2 OUT=out/demo"
	@echo "make up      the same nodes and a view in the browser, until Ctrl-C   DOOR=paper ENGINE=pybullet GUI=1 VIEW=0"
	@echo "make test    every package, the graph and the demo, in minutes"
	@echo "make test-all   every test: statistics, many random requests, interruptions, the runtime's conformance"
	@echo "make test-view   page and replay in a browser, if Chromium is installed; make screenshots  docs/view/"
	@echo "make test-runtime   the embedded runtime alone      make lint   ruff, mypy and import-linter"
	@echo "make docs    the site of the documentation (out/site/index.html)"
	@echo "make bench   speeds, each beside a peer in the same run (out/bench/)"
	@echo "make sweep   perturbed runs (out/sweep/, or out/sweep_KIND_ENGINE/)   N=50 SEED=1 ENGINE=pybullet"
	@echo "             KIND=hit|walk|miss|push: how far doors open, where walks end, what a miss or a push does"
	@echo "make faults  faults of messages, executor and driver in a hit   N=50 SEED=1"

setup: $(READY)

PACKAGE_FILES := $(wildcard $(addprefix ros2_ws/src/*/,package.xml setup.py setup.cfg))
# Folders of data (doors, launch files, ...): each changes with a new file, which must be linked.
DATA_FOLDERS := $(filter-out %/test/ $(dir $(wildcard ros2_ws/src/*/*/__init__.py)),$(wildcard ros2_ws/src/*/*/))
# What colcon copies or compiles; Python modules are linked.
COLCON_FILES := $(shell find ros2_ws/src -type f \( -not -name '*.py*' -o -name setup.py \))

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

$(VENV)/.ready: $(VENV)/.requirements embedded/pyproject.toml $(PACKAGE_FILES) $(DATA_FOLDERS)
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e embedded
	$(BIN)/python -m ros2_embedded.install ros2_ws/src
	@touch $@

# What only the site and the notebook need.
$(VENV)/.site: docs/requirements.txt $(VENV)/.requirements
	@echo "installing what the site needs into $(VENV)"
	@$(BIN)/pip install --quiet --disable-pip-version-check -r docs/requirements.txt
	@touch $@

ros2_ws/install/.ready: $(COLCON_FILES)
	@python3 -c 'import rclpy, numpy, scipy, yaml, matplotlib, PIL, pinocchio, rosbags, tqdm' && \
	  { python3 -c 'import pybullet' 2>/dev/null || python3 -c 'import mujoco'; } || \
	  { echo "ROS 2 $(ROS_DISTRO) is sourced, but something is missing, see above. This brings it:"; \
	    echo "  PIP_BREAK_SYSTEM_PACKAGES=1 rosdep install --from-paths ros2_ws/src --ignore-src"; \
	    exit 1; }
	cd ros2_ws && colcon build --symlink-install
	@touch $@

demo: $(READY)
	@$(ROS2) run door_impact_evaluation demo --door "$(DOOR)" --target-deg "$(TARGET_DEG)" \
	  --ending "$(ENDING)" --run-up "$(RUN_UP)" --hits "$(HITS)" --engine "$(ENGINE)" \
	  --gui "$(GUI)" --out "$(OUT)"

up: $(READY)
	@$(ROS2) launch door_impact_bringup bringup.launch.yaml door:="$(DOOR)" engine:="$(ENGINE)" \
	  gui:="$(GUI)" view:="$(VIEW)" experience:=out/experience.yaml

# Long files first (tests/), so that no worker is left alone with one at the end.
test: $(READY)
	@$(PYTHON) -m pytest $(WORKERS) -m "not nightly and not wall_clock" \
	  tests ros2_ws/src $(RUNTIME) --ignore embedded/tests/conformance

test-all: $(READY) $(SITE_TOOLS)
	@$(PYTHON) -m pytest $(WORKERS) --hypothesis-profile whole -m "not wall_clock" \
	  tests ros2_ws/src $(RUNTIME) --ignore embedded/tests/conformance
	@$(PYTHON) -m pytest --hypothesis-profile whole -m wall_clock tests ros2_ws/src
	@$(PYTHON) -m pytest --hypothesis-profile whole embedded/tests/conformance

test-view: $(READY)
	@$(PYTHON) -m pytest ros2_ws/src/door_impact_view/test/browser tests/test_hit_in_browser.py

# The test takes the pictures of docs/view.md on its way.
screenshots: $(READY)
	@SCREENSHOTS=$(CURDIR)/docs/view $(PYTHON) -m pytest tests/test_hit_in_browser.py

test-runtime: $(READY)
	@$(PYTHON) -m pytest --hypothesis-profile whole embedded/tests

lint: $(VENV)/.ready
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/.ready $(VENV)/.site
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build
	@echo "written: out/site/index.html"

bench: $(READY)
	@$(ROS2) run door_impact_evaluation bench --out out/bench

sweep: $(READY)
	@$(ROS2) run door_impact_evaluation sweep --kind "$(KIND)" -n $(N) --seed $(SEED) --engine "$(ENGINE)"

faults: $(READY)
	@PYTHONPATH=tests $(PYTHON) -m faults -n $(N) --seed $(SEED)

clean:
	rm -rf $(VENV) out ros2_ws/build ros2_ws/install ros2_ws/log
