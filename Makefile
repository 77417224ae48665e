# Two commands do everything, set-up included: `make repro` and `make test`.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

# one BLAS thread a process: these matrices are small, the processes are what runs in parallel
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export DVC_NO_ANALYTICS := 1
export PATH := $(CURDIR)/$(BIN):$(PATH)

.PHONY: repro smoke test lint benchmark benchmark-training benchmark-positioning benchmark-fanuc benchmark-smartee setup clean

repro: $(VENV)/.pipeline ## run the pipeline; only what changed is computed
	$(BIN)/python stages/validate.py --check
	$(BIN)/dvc repro

smoke: $(VENV)/.pipeline ## the same pipeline on a tiny configuration, in a temporary copy
	$(BIN)/python profiles/run.py profiles/smoke.yaml

test: $(VENV)/.dev ## all tests
	$(BIN)/python -m pytest -q -n auto --maxprocesses 4 --dist loadgroup

lint: $(VENV)/.dev ## formatting, lint and types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

benchmark: $(VENV)/.dev ## timings of the generation beside other ways; writes reports/benchmarks/
	$(BIN)/python benchmarks/generate.py

benchmark-training: $(VENV)/.benchmark ## timings of the trainers beside other packages
	$(BIN)/python benchmarks/training.py

benchmark-positioning: $(VENV)/.dev ## timings of the positioning methods and of how networks were trained
	$(BIN)/python benchmarks/positioning.py
	$(BIN)/python benchmarks/training_methods.py

benchmark-fanuc: $(VENV)/.dev ## timings of the six-joint arm's methods, and what more training buys
	$(BIN)/python benchmarks/fanuc.py

benchmark-smartee: $(VENV)/.benchmark ## timings of the SmartEE's direct kinematics and of its trainers
	$(BIN)/python benchmarks/smartee.py

setup: $(VENV)/.dev ## everything a developer needs

$(VENV)/.python:
	@command -v $(PYTHON) >/dev/null || { echo "error: $(PYTHON) is not on the PATH; set PYTHON to a Python 3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.pipeline: $(VENV)/.python pyproject.toml constraints.txt
	$(PIP) -e .
	@touch $@

$(VENV)/.dev: $(VENV)/.pipeline
	$(PIP) -e '.[dev,dask]'
	@touch $@

$(VENV)/.benchmark: $(VENV)/.dev
	$(PIP) -e '.[benchmark]'
	@touch $@

clean: ## remove the environment and everything DVC can make again
	rm -rf $(VENV) data/crane data/elastic_arm data/fanuc data/smartee
