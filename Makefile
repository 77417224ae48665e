# `make repro` and `make test` do everything, set-up included; `make` lists what else there is.
VENV := .venv
BIN := $(VENV)/bin
# What pyproject.toml asks for, with the extras named, in the versions of constraints.txt. flexik itself
# is not installed: a stage runs the src beside it, also in a copy of the project that DVC makes.
# torch for Linux brings CUDA, several GB that nothing here uses, where pip finds no CPU build of it.
ASKED = $(BIN)/python -c 'import sys, tomllib; \
  project = tomllib.load(open("pyproject.toml", "rb"))["project"]; \
  print(*project["dependencies"], *sum((project["optional-dependencies"][e] for e in sys.argv[1:]), []))'
INSTALL = @echo "installing the packages of pyproject.toml $(1)"; \
  $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt $$($(ASKED) $(1))

BENCHMARKS := benchmark benchmark-training benchmark-positioning benchmark-fanuc benchmark-smartee

export DVC_NO_ANALYTICS := 1
export PATH := $(CURDIR)/$(BIN):$(PATH)

.PHONY: help repro smoke test lint lock $(BENCHMARKS) setup clean
.NOTPARALLEL:

help: ## this list
	@sed -nE 's/^([a-z-]+):.*## (.*)/make \1\t\2/p' Makefile | expand -t 28

repro: $(VENV)/.pipeline ## run the pipeline; only what changed is computed
	$(BIN)/dvc repro

smoke: $(VENV)/.pipeline ## the same pipeline on a tiny configuration, in a temporary copy
	$(BIN)/python profiles/run.py profiles/smoke.yaml

test: $(VENV)/.dev ## all tests
	$(BIN)/python -m pytest -q -n auto --maxprocesses 4 --dist loadgroup

lint: $(VENV)/.dev ## formatting, lint and types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

lock: $(VENV)/.pipeline ## after a merge that left conflicts in dvc.lock or reports/: one side, brought up to date
	git diff --name-only --diff-filter=U -z -- dvc.lock reports README.md | xargs -0r git checkout --ours --
	$(BIN)/dvc repro
	git add dvc.lock reports README.md

$(BENCHMARKS): export PYTHONPATH := src
# one thread a process, as the stages have; the threads of torch and JAX too
$(BENCHMARKS): export OMP_NUM_THREADS := 1
$(BENCHMARKS): export OPENBLAS_NUM_THREADS := 1
$(BENCHMARKS): export MKL_NUM_THREADS := 1

benchmark: $(VENV)/.dev ## timings of the generation beside other ways; writes reports/benchmarks/
	$(BIN)/python benchmarks/generation.py

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

clean: ## remove the environment and everything DVC can make again
	rm -rf $(VENV)
	git clean -fdXq data

# the newest Python that answers and fits (a name on the PATH may be a version manager's empty shell)
$(VENV)/.python:
	@for python in $(or $(PYTHON),python3.14 python3.13 python3.12 python3.11 python3); do \
	  if $$python -c 'import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' 2>/dev/null; then \
	    echo "$$python -m venv $(VENV)"; $$python -m venv --clear $(VENV) && touch $@; exit; \
	  fi; \
	done; \
	echo "error: $(or $(PYTHON),the PATH) has no Python 3.11 to 3.14 with venv; name one with PYTHON=..." >&2; exit 1

# the command flexik runs the src of the folder it is called in, as the stages do
$(VENV)/.pipeline: $(VENV)/.python pyproject.toml constraints.txt
	$(call INSTALL)
	@printf '#!%s\nimport sys\nsys.path.insert(0, "src")\nfrom flexik.__main__ import main\nmain()\n' \
	  $(CURDIR)/$(BIN)/python > $(BIN)/flexik && chmod +x $(BIN)/flexik
	@touch $@

$(VENV)/.dev: $(VENV)/.pipeline
	$(call INSTALL,dev dask)
	@touch $@

$(VENV)/.benchmark: $(VENV)/.dev
	$(call INSTALL,benchmark)
	@touch $@
