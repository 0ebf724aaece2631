# hrp2_door_impact: see README.md.

# In a shell where ROS 2 is sourced, the packages are built for it in ros2_ws; elsewhere ROS 2's
# wheels are installed into .venv, and the packages are built there.
VENV := .venv
BIN := $(VENV)/bin
ifneq ($(and $(ROS_DISTRO),$(AMENT_PREFIX_PATH)),)
READY := ros2_ws/install/.ready
ENV := . ros2_ws/install/local_setup.sh &&
PYTHON := $(ENV) exec python3
OWN :=
WORKERS :=
SITE_TOOLS :=
else
READY := $(VENV)/.ready
ENV := . $(BIN)/activate &&
PYTHON := $(ENV) exec python
OWN := ros2_commands
SITE_TOOLS := $(VENV)/.site
WORKERS := -n $(shell nproc) --maxprocesses 8 --dist loadscope --no-loadscope-reorder --max-worker-restart 0
endif
ROS2 := $(ENV) exec ros2
# ROS 2's own default would command a robot on the network.
export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST

DOOR ?= paper
TARGET_DEG ?= 25
# HOLD is an older name of ENDING.
ENDING ?= $(or $(HOLD),hold)
RUN_UP ?= mcv50
ENGINE ?= pybullet
OUT ?= out/demo
PARAMS ?=
GUI ?= 0
VIEW ?= 1
HITS ?= 1
KIND ?= hit
CLUSTER ?=
ROBOT ?=
N ?= 50
SEED ?= 1

# Dozens of processes start faster when Python keeps what it has compiled.
unexport PYTHONDONTWRITEBYTECODE
# Matrices are small here; further threads of BLAS only spin, on cores that other nodes need.
export OPENBLAS_NUM_THREADS := 1

.PHONY: help setup demo up test test-all test-view screenshots lint docs bench sweep faults clean

help:
	@echo "make demo    find out the door, plan the hit, open the door, show the result (out/demo/)"
	@echo "             DOOR=paper|size2|size3|size4|FILE.yaml TARGET_DEG=25 RUN_UP=mcv50|zmp_limited"
	@echo "             ENDING=hold|retreat|pass ENGINE=pybullet|mujoco GUI=1 HITS=2 PARAMS=FILE.yaml OUT=out/demo"
	@echo "             ROBOT=FILE.yaml: another robot, also of make up and make sweep"
	@echo "make up      the same nodes and a view in the browser, until Ctrl-C   DOOR=paper ENGINE=pybullet GUI=1 VIEW=0"
	@echo "make test    every package, the graph and the demo, in minutes"
	@echo "make test-all   also what takes long: whole runs, many random draws, interruptions"
	@echo "make test-view   page and replay in a browser, if Chromium is installed; make screenshots  docs/view/"
	@echo "make lint    ruff, mypy and import-linter"
	@echo "make docs    the site of the documentation (out/site/index.html)"
	@echo "make bench   speeds, each beside a peer in the same run (out/bench/)"
	@echo "make sweep   perturbed runs (out/sweep/, or out/sweep_KIND_ENGINE/)   N=50 SEED=1 ENGINE=pybullet"
	@echo "             KIND=hit|walk|miss|blocked|push|pass: how far doors open, where walks end, who gets through"
	@echo "             CLUSTER=tcp://host:8786: on a Dask cluster instead of this machine"
	@echo "make faults  faults of messages, nodes and driver in hits, walks and passages   N=50 SEED=1"

setup: $(READY)

# What colcon copies or compiles; Python modules are linked, and what pip has built there is not ours.
COLCON_FILES := $(shell find ros2_ws/src -name build -prune -o -name '*.egg-info' -prune -o -type f \( -not -name '*.py*' -o -name setup.py \) -print)

# A .venv without this file was made otherwise, and begins anew.
$(VENV)/.made:
	@python3 ros2_ws/wheels.py check
	python3 -m venv --clear $(VENV)
	@touch $@

$(VENV)/.requirements: requirements.txt $(VENV)/.made
	@echo "installing ROS 2 and the dependencies into $(VENV), some minutes"
	@$(BIN)/pip install --quiet --disable-pip-version-check -r requirements.txt
	@touch $@

$(VENV)/.ready: $(VENV)/.requirements ros2_ws/wheels.py ros2_commands/pyproject.toml $(COLCON_FILES)
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e ros2_commands
	@echo "building the packages by colcon, some minutes the first time"
	@$(BIN)/python ros2_ws/wheels.py build
	@touch $@

# What only the site and the notebook need.
$(VENV)/.site: docs/requirements.txt $(VENV)/.requirements
	@echo "installing what the site needs into $(VENV)"
	@$(BIN)/pip install --quiet --disable-pip-version-check -r docs/requirements.txt
	@touch $@

ros2_ws/install/.ready: $(COLCON_FILES)
	@python3 -c 'import rclpy, numpy, scipy, yaml, matplotlib, PIL, pinocchio, rosbags, mcap, pydantic, tqdm' && \
	  { python3 -c 'import pybullet' 2>/dev/null || python3 -c 'import mujoco'; } || \
	  { echo "ROS 2 $(ROS_DISTRO) is sourced, but something is missing, see above. This brings it:"; \
	    echo "  PIP_BREAK_SYSTEM_PACKAGES=1 rosdep install --from-paths ros2_ws/src --ignore-src"; \
	    exit 1; }
	cd ros2_ws && colcon build --symlink-install
	@touch $@

demo: $(READY)
	@$(ROS2) run door_impact_evaluation demo --door "$(DOOR)" --target-deg "$(TARGET_DEG)" \
	  --ending "$(ENDING)" --run-up "$(RUN_UP)" --hits "$(HITS)" --engine "$(ENGINE)" \
	  --gui "$(GUI)" --params "$(PARAMS)" --robot "$(ROBOT)" --out "$(OUT)"

up: $(READY)
	@$(ROS2) run door_impact_bringup up --door "$(DOOR)" --params "$(PARAMS)" --robot "$(ROBOT)" --view "$(VIEW)" \
	  --experience "out/experience$(if $(ROBOT),_$(basename $(notdir $(ROBOT)))).yaml" engine:="$(ENGINE)" gui:="$(GUI)"

# Long files first (tests/), so that no worker is left alone with one at the end.
test: $(READY)
	@$(PYTHON) -m pytest $(WORKERS) -m "not nightly" tests $(OWN) ros2_ws/src

test-all: $(READY) $(SITE_TOOLS)
	@$(PYTHON) -m pytest $(WORKERS) --hypothesis-profile whole tests $(OWN) ros2_ws/src

test-view: $(READY)
	@$(PYTHON) -m pytest ros2_ws/src/door_impact_view/test/browser tests/test_hit_in_browser.py

# The test takes the pictures of docs/view.md on its way.
screenshots: $(READY)
	@SCREENSHOTS=$(CURDIR)/docs/view $(PYTHON) -m pytest tests/test_hit_in_browser.py

lint: $(VENV)/.ready
	$(BIN)/ruff check .
	. $(BIN)/activate && mypy
	. $(BIN)/activate && lint-imports

docs: $(VENV)/.ready $(VENV)/.site
	@. $(BIN)/activate && NO_MKDOCS_2_WARNING=1 mkdocs build
	@echo "written: out/site/index.html"

bench: $(READY)
	@$(ROS2) run door_impact_evaluation bench --out out/bench

sweep: $(READY)
	@$(ROS2) run door_impact_evaluation sweep --kind "$(KIND)" -n $(N) --seed $(SEED) --engine "$(ENGINE)" \
	  --cluster "$(CLUSTER)" --robot "$(ROBOT)"

faults: $(READY)
	@$(ENV) PYTHONPATH="tests:$$PYTHONPATH" exec python3 -m faults -n $(N) --seed $(SEED)

clean:
	rm -rf $(VENV) out ros2_ws/build ros2_ws/install ros2_ws/log
