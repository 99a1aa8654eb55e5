# Relative paths only: make cannot hold a prerequisite whose path has a space in it.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.DEFAULT_GOAL := help

PYTHON ?= python3.11
JOBS ?= 2
MODULES ?= physics/valve statistics/averages

activate := . .venv/bin/activate

.PHONY: help reproduce test coverage docs lint bench crosscheck fuzz mutations torture determinism slurm-test lock clean

help:  ## say what there is
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 20
	@echo "Each makes .venv from requirements.lock when it is missing or out of date."
	@echo "PYTHON=... names the interpreter (3.11 or later), JOBS=... the number of parallel jobs."

reproduce: .venv/.installed  ## run the whole study of the paper into results/
	@echo "== reproduce: snakemake -j$(JOBS)"
	$(activate)
	snakemake -j$(JOBS)

test: .venv/.installed  ## run the tests (those of results are skipped where results are absent)
	@echo "== test: pytest -n $(JOBS)"
	$(activate)
	pytest -n $(JOBS)

coverage: .venv/.installed  ## measure which lines of pneumo/ the tests reach; fails below 95 %
	@echo "== coverage: pytest -n $(JOBS), then small tests of the kernels uncompiled"
	$(activate)
	coverage erase
	coverage run -m pytest -n $(JOBS)
	NUMBA_DISABLE_JIT=1 coverage run -m pytest -m uncompiled
	coverage combine --quiet
	coverage report

docs: .venv/.installed  ## build the documentation into site/; a warning is an error
	@echo "== docs: sphinx-build docs site"
	$(activate)
	sphinx-build --quiet --fail-on-warning --keep-going --nitpicky docs site

crosscheck: .venv/.installed  ## run the equations once more in GNU Octave, where it is installed, and compare
	@echo "== crosscheck: octave-cli tests/crosscheck/crosscheck.m"
	$(activate)
	python -m tests.crosscheck.octave

fuzz: .venv/.installed  ## try 10 000 bad inputs and record the outcome in results/evidence/fuzz.json
	@echo "== fuzz: pytest tests/test_fuzz.py"
	$(activate)
	FUZZ=10000 pytest -q -s tests/test_fuzz.py

mutations: .venv/.installed  ## change numbers and operators of MODULES one at a time; do the tests notice? (10 min each)
	@echo "== mutations: cosmic-ray on $(MODULES)"
	$(activate)
	uv pip install --quiet --constraint requirements.lock cosmic-ray
	python -m tests.mutations $(MODULES)

torture: .venv/.installed  ## kill, starve and spoil the study (40 kills; hours), CONFIG=config/smoke.yaml for a short one
	@echo "== torture: results/evidence/torture.json"
	$(activate)
	python -m tests.torture.faults --config "$(CONFIG)"

determinism: .venv/.installed  ## compare runs with other jobs, threads and processors
	@echo "== determinism: results/evidence/determinism.json"
	$(activate)
	python -m tests.torture.determinism --config "$(CONFIG)"

slurm-test: .venv/.installed  ## run the smoke study on a Slurm of one node made for it (root; slurm-wlm, munge)
	@echo "== slurm-test: workflow/profiles/slurm"
	$(activate)
	uv pip install --quiet --no-deps --target .snakemake/slurm snakemake-executor-plugin-slurm snakemake-executor-plugin-slurm-jobstep
	PYTHONPATH="$$PWD/.snakemake/slurm" python -m tests.torture.slurm

lint: .venv/.installed  ## check style, types, import contracts and the workflow
	@echo "== lint: ruff, basedpyright, import-linter, snakefmt, snakemake --lint"
	$(activate)
	ruff check
	ruff format --check
	basedpyright
	lint-imports --no-logo
	snakefmt --check Snakefile workflow
	# Of snakemake --lint all is heeded but "an environment per rule": see paper/decisions/0003.
	snakemake --dry-run --quiet all > /dev/null
	if (snakemake --lint 2>&1 || true) | grep '^ *\* ' | grep -v 'Specify a conda environment or container'; then exit 1; fi

bench: .venv/.installed  ## measure speed against other means, and the whole study's time, into results/bench.json
	@echo "== bench: benchmarks/bench.py (some 5 minutes; leave the machine alone meanwhile)"
	$(activate)
	python -m benchmarks.bench

lock: .venv/.installed  ## write requirements.lock again from pyproject.toml (UPGRADE=1: newest versions)
	@echo "== lock: requirements.lock"
	$(activate)
	uv pip compile --quiet --generate-hashes --no-emit-index-url --no-header --no-annotate --extra dev --extra docs --extra evidence --extra control \
	    --python-version 3.11 --python-platform x86_64-manylinux_2_28 $(if $(UPGRADE),--upgrade) \
	    --output-file requirements.lock pyproject.toml

clean:  ## remove results, documentation and caches, keep .venv
	@echo "== clean: results, site, workflow state, tool caches"
	find results -mindepth 1 ! -path results/README.md -delete
	rm -rf site .coverage* .snakemake .pytest_cache .ruff_cache .import_linter_cache .hypothesis

# The stamp comes last, so an interrupted set-up starts afresh. uv, itself pinned in the lock, takes 10 s where pip takes
# 100; pip is kept for machines where only pip is configured to reach a package index.
.venv/.installed: requirements.lock pyproject.toml
	@for candidate in "$(PYTHON)" python3; do
	    # Not the interpreter of an active .venv: it is about to be removed.
	    base=$$("$$candidate" -c 'import sys; print(sys._base_executable if sys.version_info >= (3, 11) else "")' 2>/dev/null) || true
	    if [ -n "$$base" ]; then break; fi
	done
	if [ -z "$$base" ]; then echo "No Python 3.11 or later found: install one, or name it with make PYTHON=/path/to/python3.11" >&2; exit 1; fi
	echo "== set-up 1/3: .venv with $$("$$base" --version)"
	"$$base" -m venv --clear --without-pip .venv
	pip() { "$$base" -m pip --python .venv/bin/python install --quiet --disable-pip-version-check --require-hashes "$$@"; }
	echo "== set-up 2/3: packages pinned in requirements.lock (15 s to 2 min, 1.8 GB on disk)"
	sed -n '/^uv==/,/[^\]$$/p' requirements.lock > .venv/uv.lock
	pip -r .venv/uv.lock
	# Compiled here and not at first use: where PYTHONDONTWRITEBYTECODE is set every job would compile all it imports.
	uv() { .venv/bin/uv pip install --quiet --compile-bytecode --python .venv/bin/python "$$@"; }
	uv --require-hashes --build-constraints requirements.lock -r requirements.lock || pip -r requirements.lock
	echo "== set-up 3/3: pneumo itself, editable"
	uv --no-deps --no-build-isolation --editable .
	touch $@
