# make demo: set up, drive the built-in house, name the report.   make test: set up, then every check that CI makes.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test lint types rooms unit peers fuzz torture clusters benchmarks packages clean

demo: $(VENV)/.installed
	$(BIN)/taskslam demo --out demo

test: lint types rooms unit

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.installed-dev
	$(BIN)/mypy

rooms: $(VENV)/.installed-dev
	$(BIN)/lint-imports

unit: $(VENV)/.installed-dev peers
	$(BIN)/python -m pytest -n 2 --dist loadfile

# Debian's own ROS 1, which ours is tried against, Slurm, on which campaigns are driven, and TeX, which sets the tables
# (15 MB, 151 MB on disk with what it needs): installed in CI; elsewhere those tests skip and say how to get them.
peers:
	@test "$(CI)" != true || { SUDO=$$(test $$(id -u) -eq 0 || echo sudo); $$SUDO apt-get update -qq && \
	  $$SUDO apt-get install -y -qq --no-install-recommends $$(cat tests/ros/debian_packages.txt tests/benchmark/campaign/debian_packages.txt \
	  tests/report/tables/debian_packages.txt); }

torture: $(VENV)/.installed-dev peers
	TASKSLAM_TORTURE=1 $(BIN)/python -m pytest tests/adversaries tests/ros/test_robot_tour.py
	$(BIN)/python tools/torture.py --kills 140
	$(BIN)/python tools/torture.py --engine slurm --kills 30
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[ray]"
	$(BIN)/python tools/torture.py --engine ray --kills 30

# Campaigns on Slurm and on Ray, of which a machine is killed; ray is a large package, and starting it takes a minute.
clusters: $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[ray]"
	TASKSLAM_CLUSTERS=1 $(BIN)/python -m pytest tests/benchmark/campaign/test_slurm.py tests/benchmark/campaign/test_ray.py

# Damaged inputs for every reader; FUZZ="--reader journal --inputs 100000 --seed 7" for some of them.
fuzz: $(VENV)/.installed-dev
	PYTHONPATH=tests $(BIN)/python -m fuzz $(FUZZ)

# sdist and wheel, and the wheel at work in a fresh environment of every Python at hand; docs/releasing.md.
packages: $(VENV)/.installed-dev
	$(BIN)/python tools/packages.py $(PYTHONS)

benchmarks: $(VENV)/.installed-dev
	for script in benchmarks/*.py; do $(BIN)/python $$script || exit 1; done

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

$(VENV)/.installed-dev: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[all,dev]"
	touch $@ $(VENV)/.installed

# Debian and Ubuntu ship python3 without its venv module; install it where that is so.
$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "taskslam needs Python 3.11 to 3.13; name one: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { SUDO=$$(test $$(id -u) -eq 0 || echo sudo); $$SUDO apt-get update -qq && $$SUDO apt-get install -y -qq python3-venv; }
	$(PYTHON) -m venv $(VENV)

clean:
	rm -rf $(VENV) demo build dist
