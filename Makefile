# The two commands of the README, `make demo` and `make test`, and what they stand on.
SHELL := /bin/bash
.DELETE_ON_ERROR:
.PHONY: demo demo-mapping view test lint bench compare figures docs build lock clean help

PYTHON ?= python3
# Which ROS: the sourced one, or the wheels in .venv. Each needs its own .venv and install.
ROS := $(if $(NODLIDAR_UNDERLAY),wheels,$(or $(ROS_DISTRO),wheels))
ACTIVATE := source ./env.sh
# With folders, so that a removed file is noticed.
SOURCES := $(shell find nodlidar_* underlay -not -path '*/test*' -not -path '*/__pycache__*' -not -path '*/.*' \
             -not -name '*.md' -not -name '*.rst')

help:                    ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## */\t/' | expand -t 14

demo: build              ## scan the simulated room for 20 s; leaves cloud.ply, cloud.png and a bag in demo_output/
	@$(ACTIVATE) && ros2 run nodlidar_demo demo $(DEMO_ARGS)

demo-mapping: build      ## drive a simulated building and map it; leaves map, path and a picture in mapping_output/
	@$(ACTIVATE) && ros2 run nodlidar_demo demo_mapping $(DEMO_ARGS)

view: build              ## run the simulated sensor and show it in a browser; prints the address
	@$(ACTIVATE) && ros2 launch nodlidar_bringup robot.launch.py view:=web

test: build lint         ## run every test
	@$(ACTIVATE) && OPENBLAS_NUM_THREADS=1 python -m pytest --numprocesses 3 --dist loadgroup $(PYTEST_ARGS)

lint: .venv/ready-$(ROS)        ## ruff and mypy
	@$(ACTIVATE) && python -m ruff check . && python -m ruff format --check . && python -m mypy

bench: build             ## measure what the documentation quotes, into bench/results and the pages
	@$(ACTIVATE) && python -m bench --record && python -m figures pareto estimators sensing

compare: build           ## report what became slower than bench/results
	@$(ACTIVATE) && python -m bench --compare

figures: build           ## draw the figures of the documentation again, into docs/figures
	@$(ACTIVATE) && python -m figures
	@$(ACTIVATE) && ros2 run nodlidar_planner plan_scan --timing-error 0.003 --top 1 --plot docs/figures/plan.png
	@$(ACTIVATE) && ros2 run nodlidar_planner plan_scan --max-hole 2 --speed-max 6 --plot docs/figures/front.png

docs: build              ## write the parameter files and tables from the code
	@$(ACTIVATE) && python tools/parameter_docs.py

build: install/ready-$(ROS)  ## build the workspace into install/

install/ready-$(ROS): .venv/ready-$(ROS) $(SOURCES)
	@tools/build_workspace
	@touch $@

.venv/ready-$(ROS): requirements.in requirements.lock tools/setup_venv tools/missing_requirements.py
	@PYTHON=$(PYTHON) ROS=$(ROS) tools/setup_venv
	@touch $@

lock:                    ## resolve requirements.in again, for every supported Python
	@$(ACTIVATE) && pip install --quiet uv && uv pip compile --quiet --universal --upgrade \
	    --python-version 3.10 --no-emit-index-url --no-annotate --no-header requirements.in -o requirements.lock

clean:                   ## remove all generated files
	rm -rf .venv build install log demo_output mapping_output .pytest_cache .mypy_cache .ruff_cache .hypothesis
