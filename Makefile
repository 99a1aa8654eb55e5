# Relative paths only: make cannot hold a prerequisite whose path has a space in it.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.DEFAULT_GOAL := help

PYTHON ?= python3.11
JOBS ?= 2
COUNT ?= 3
UNDISTURBED ?= 20
SOAK_MINUTES ?= 30

# Not .venv/bin/activate, which does not work under a path with quotes.
activate := export PATH="$$PWD/.venv/bin:$$PATH" VIRTUAL_ENV="$$PWD/.venv"
unexport PYTHONDONTWRITEBYTECODE # else every job would compile all that it imports

# uv keeps its cache in the home folder, else, where there is none or it cannot be written, in .venv.
ifeq ($(UV_CACHE_DIR)$(shell cache="$${XDG_CACHE_HOME:-$${HOME:+$$HOME/.cache}}"; test "$$cache" && mkdir -p "$$cache/uv" 2> /dev/null && test -w "$$cache/uv" && echo yes),)
export UV_CACHE_DIR := .venv/uv-cache
endif

.PHONY: help reproduce test test-all test-nightly soak coverage numbers docs live lint bench fit-bench sanitize wheel sbom lock lock-check clean

help:  ## say what there is
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 20
	@echo "Each makes .venv when it is missing or out of date: reproduce from requirements.lock, what the study needs;"
	@echo "the others add the tools of requirements-dev.lock."
	@echo "PYTHON=... names the interpreter (3.11 or later), JOBS=... the number of parallel jobs."

reproduce: .venv/.study  ## run the whole study of the paper into results/
	@echo "== reproduce: snakemake -j$(JOBS)"
	$(activate)
	snakemake -j$(JOBS)

test: .venv/.dev  ## run the tests but for the slow ones, in minutes (those of results need results)
	@echo "== test: pytest -n $(JOBS), without the slow ones"
	$(activate)
	pytest -n $(JOBS) -m "not wheel and not slow"

test-all: .venv/.dev  ## run the slow tests too: whole workflows, kills, full-length replays, every figure
	@echo "== test-all: pytest -n $(JOBS)"
	$(activate)
	pytest -n $(JOBS) -m "not wheel and not nightly"

test-nightly: .venv/.dev  ## run the tests that test-all leaves out: further cases of what it proves
	@echo "== test-nightly: pytest -n $(JOBS)"
	$(activate)
	pytest -n $(JOBS) -m nightly

soak: .venv/.dev  ## search for failures: 20 times the examples, random, in random order, for SOAK_MINUTES (30)
	@echo "== soak: pytest -n $(JOBS) on random examples"
	$(activate)
	export SOAK_END=$$(( $$(date +%s) + 60 * $(SOAK_MINUTES) ))
	while [ $$(date +%s) -lt $$SOAK_END ]; do
	    pytest -p tests.soak -p randomly --hypothesis-profile=random -n $(JOBS) -m "not wheel and not slow"
	done

coverage: .venv/.dev  ## measure which lines of pneumo/ the tests reach; fails below 95 % (half an hour, if PYTHON is 3.12 or later)
	@echo "== coverage: pytest -n $(JOBS)"
	$(activate)
	export COVERAGE_CORE=$$(python -c "import sys; print('sysmon' if sys.version_info >= (3, 12) else 'ctrace')") # sysmon slows little
	coverage erase
	coverage run -m pytest -n $(JOBS)
	coverage combine --quiet
	coverage report

# README's generated blocks: `cog -r` writes them, `cog --check` compares.
cog = cog --verbosity=0 -I docs -P -p "from readme_blocks import *" --markers='<!--generated: --> <!--end-->'

numbers: .venv/.dev  ## write the numbers of pages and README from results/ and paper/evidence/, and the table of keys
	@echo "== numbers: docs/numbers.yaml, docs/static, README.md, pneumo/configuration/keys.md"
	$(activate)
	PYTHONPATH=. python docs/page_numbers.py
	PYTHONPATH=. python docs/configuration_keys.py
	$(cog) -r README.md

docs: .venv/.dev  ## build the documentation into site/; a warning is an error
	@echo "== docs: sphinx-build docs site"
	$(activate)
	sphinx-build --jobs $(JOBS) --quiet --fail-on-warning --keep-going --nitpicky docs site

live: .venv/.dev  ## compile the page of `pneumo live` again, after a change of the core or the models (needs clang, lld)
	@echo "== live: pneumo/publish/pages/live.html"
	$(activate)
	python -m live.build

sanitize: .venv/.dev  ## run the core's tests under the sanitizers of addresses and of undefined behaviour
	@echo "== sanitize: pytest tests/core tests/simulation in build/sanitize"
	$(activate)
	python -c "from pathlib import Path; from tests.checkout import copy_checkout; copy_checkout(Path('build/sanitize'))"
	cd build/sanitize
	export CFLAGS="-fsanitize=address,undefined -fno-sanitize-recover=undefined -DPNEUMO_NO_CLONES -g" UBSAN_OPTIONS=print_stacktrace=1
	python setup.py --quiet build_ext --inplace --force
	# Python leaks by design what it keeps to its end.
	export LD_PRELOAD="$$(gcc -print-file-name=libasan.so)" ASAN_OPTIONS=detect_leaks=0 PYTHONPATH="$$PWD"
	pytest -n $(JOBS) -m "not slow" tests/core tests/simulation

lint: .venv/.dev  ## check style, types, import contracts and the workflow
	@echo "== lint: ruff, basedpyright, import-linter, zizmor, cog, snakefmt, snakemake --lint"
	$(activate)
	ruff check
	ruff format --check
	basedpyright
	lint-imports --no-logo
	lint-imports --no-logo --config paper-verdict/pyproject.toml
	zizmor --offline --no-progress --quiet .github
	$(cog) --check --check-fail-msg="run: make numbers" README.md
	snakefmt --check Snakefile workflow
	# Of snakemake --lint all is heeded but "an environment per rule": see decision 3.
	snakemake --dry-run --quiet all > /dev/null
	if (snakemake --lint 2>&1 || true) | grep '^ *\* ' | grep -v 'Specify a conda environment or container'; then exit 1; fi

bench: .venv/.dev  ## measure the speed of the core and the time of the whole study; adds a line to benchmarks/history.jsonl
	@echo "== bench: benchmarks/bench.py (some 5 minutes; leave the machine alone meanwhile)"
	$(activate)
	python -m benchmarks.bench

fit-bench: .venv/.dev  ## judge `pneumo fit` on random benches with known truth, COUNT of each disturbance (3), into results/fit_bench.json
	@echo "== fit-bench: benchmarks/fit_bench.py (5 minutes)"
	$(activate)
	python -m benchmarks.fit_bench --count $(COUNT) --undisturbed $(UNDISTURBED)

wheel: .venv/.dev  ## build sdist and wheel into dist/; try every engineer's command of the wheel in an empty environment
	@echo "== wheel: dist/, then pytest tests/test_wheel.py"
	$(activate)
	rm -rf dist paper-verdict/dist
	uv build --quiet --no-build-isolation --out-dir dist
	uv build --quiet --no-build-isolation --out-dir paper-verdict/dist paper-verdict
	rm dist/.gitignore paper-verdict/dist/.gitignore
	pytest -n0 tests/test_wheel.py

sbom: .venv/.study  ## list the packages of requirements.lock, with their hashes, in sbom.json (CycloneDX)
	@echo "== sbom: cyclonedx-py on requirements.lock"
	$(activate)
	uv pip install --quiet --target .venv/sbom cyclonedx-bom
	PYTHONPATH=.venv/sbom python -m cyclonedx_py requirements --output-reproducible --pyproject pyproject.toml -o sbom.json requirements.lock

# Universal: every platform and Python from 3.11 on.
compile = uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --no-annotate $(if $(UPGRADE),--upgrade)
study_extras = --extra workflow --extra setup

lock: .venv/.study  ## write both locks again from pyproject.toml (UPGRADE=1: newest versions)
	@echo "== lock: requirements.lock, requirements-dev.lock"
	$(activate)
	$(compile) $(study_extras) --output-file requirements.lock pyproject.toml
	$(compile) $(study_extras) --extra dev --extra docs --extra control --extra fmu --extra formats \
	    --constraint requirements.lock --output-file requirements-dev.lock pyproject.toml

lock-check: .venv/.study  ## is there a wheel of every locked package for Linux on x86-64 and aarch64 and for macOS 15 on arm64
	@echo "== lock-check: dry runs of both locks"
	$(activate)
	for platform in x86_64-manylinux_2_28 aarch64-manylinux_2_28 aarch64-apple-darwin; do
	    for version in 3.11 3.12 3.13; do
	        for lock in requirements.lock requirements-dev.lock; do
	            echo "$$platform, Python $$version, $$lock"
	            MACOSX_DEPLOYMENT_TARGET=15.0 uv pip install --quiet --dry-run --target .venv/none --python-platform $$platform --python-version $$version \
	                --only-binary :all: --no-binary connection-pool --require-hashes -r $$lock
	        done
	    done
	done

clean:  ## remove results, documentation and caches, keep .venv
	@echo "== clean: results, site, workflow state, tool caches"
	find results -mindepth 1 ! -path results/README.md -delete
	rm -rf results-* site jupyter_execute dist build paper-verdict/dist paper-verdict/build .coverage* .snakemake .pytest_cache .ruff_cache .import_linter_cache .hypothesis

# Stamps come last, so an interrupted set-up starts afresh. uv, itself pinned in the lock, takes seconds where pip takes
# minutes; pip is kept for machines where only pip is configured to reach a package index.
.venv/.study: requirements.lock pyproject.toml paper-verdict/pyproject.toml
	@case "$$PWD" in *[{}]*) echo "$$PWD: setuptools installs nothing under a path with { or } in it; rename the folder" >&2; exit 1;; esac
	for candidate in "$(PYTHON)" python3; do
	    # Not the interpreter of an active .venv: it is about to be removed.
	    base=$$("$$candidate" -c 'import sys; print(sys._base_executable if sys.version_info >= (3, 11) else "")' 2>/dev/null) || true
	    if [ -n "$$base" ]; then break; fi
	done
	if [ -z "$$base" ]; then echo "No Python 3.11 or later found: install one, or name it with make PYTHON=/path/to/python3.11" >&2; exit 1; fi
	echo "== set-up 1/3: .venv with $$("$$base" --version)"
	"$$base" -m venv --clear --without-pip .venv
	echo "$$base" > .venv/.base
	echo "== set-up 2/3: what the study needs, pinned in requirements.lock (10 s to 1 min, 0.7 GB on disk)"
	sed -n '/^uv==/,/[^\]$$/p' requirements.lock > .venv/uv.lock
	"$$base" -m pip --python .venv/bin/python install --quiet --disable-pip-version-check --require-hashes -r .venv/uv.lock
	$(call install,requirements.lock)
	compiler=$$(.venv/bin/python -c "from build_backend import missing; print(*missing())")
	if [ -n "$$compiler" ]; then
	    echo "== no C compiler found: installing $$compiler (0.4 GB on disk)"
	    .venv/bin/uv pip install --quiet --python .venv/bin/python "$$compiler" || \
	        "$$base" -m pip --python .venv/bin/python install --quiet --disable-pip-version-check "$$compiler"
	fi
	echo "== set-up 3/3: pneumo itself and paper-verdict, editable"
	.venv/bin/uv pip install --quiet --python .venv/bin/python --no-deps --no-build-isolation --editable . --editable ./paper-verdict
	touch $@

.venv/.dev: .venv/.study requirements-dev.lock
	@echo "== set-up: tools for tests, documentation and evidence, pinned in requirements-dev.lock (10 s to 1 min, 1.0 GB more)"
	base=$$(cat .venv/.base)
	$(call install,requirements-dev.lock)
	touch $@

# Install a lock: with uv, else with pip.
install = .venv/bin/uv pip install --quiet --python .venv/bin/python --require-hashes --build-constraints requirements.lock -r $(1) || \
    "$$base" -m pip --python .venv/bin/python install --quiet --disable-pip-version-check --require-hashes -r $(1)
