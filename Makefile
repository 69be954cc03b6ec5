# One door to everything; `make help` lists it.

.DEFAULT_GOAL := help
.PHONY: help setup demo check test lab nightly bench docs docs-of-version release

BIN := .venv/bin
STAMP := .venv/.installed
DEMO_STAMP := .venv/.installed-for-demo
EXTRAS := sim,train,hardware,ros,lerobot,docs,dev

# The first interpreter that runs and is supported; override with `make setup PYTHON=...`.
SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTHON ?= $(shell for python in python3.11 python3.12 python3.13 python3; do \
	"$$python" -c "$(SUPPORTED)" 2>/dev/null && echo "$$python" && break; done)

help:  ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## */  \1\t/' | expand -t 12

setup: $(STAMP)  ## make .venv with everything, at the versions of constraints.txt

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "needs Python 3.11, 3.12 or 3.13 on the PATH"; exit 1; }
	$(PYTHON) -m venv .venv

# pip makes bytecode on one core and compileall on all, which saves 10 s; what does not compile is no harm.
$(DEMO_STAMP): $(BIN)/python pyproject.toml constraints.txt requirements-hashes-sim.txt
	@echo "installing what the demo needs into .venv: 1.2 GB, a minute on two free cores"
	$(BIN)/python -m pip install --quiet --no-compile --no-deps --require-hashes -r requirements-hashes-sim.txt
	-$(BIN)/python -m compileall -q -q -j 0 -x /tests/ .venv/lib
	$(BIN)/python -m pip install --quiet -c constraints.txt -e ".[sim]"
	@touch $@

# Every file must have its hash, but for torch: a CPU or CUDA build that is already installed is kept.
$(STAMP): $(DEMO_STAMP) requirements-hashes.txt lab/pyproject.toml
	$(BIN)/python -m pip install --quiet --no-deps --require-hashes -r requirements-hashes.txt
	$(BIN)/python -m pip install --quiet torch==2.13.0 -c constraints.txt
	$(BIN)/python -m pip install --quiet -c constraints.txt -e ".[$(EXTRAS)]" -e lab
	@touch $@

demo: $(DEMO_STAMP)  ## find the friction that a bundled dataset hides; the report is in build/demo
	$(BIN)/tendon-newton demo --out build/demo

check: setup  ## lint, format, types, layers, results that pages show
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright
	$(BIN)/lint-imports
	$(BIN)/python -m lab.results --check

# One thread per process: torch and BLAS otherwise fight over the cores. Files run in their order, since
# by number of tests the longest ones, which have few, come last and leave a core without work. What guards
# the lab's rivals from seeing what is tested takes a second.
test: setup  ## run the tests: CPU, offline, one process for each of two cores
	OMP_NUM_THREADS=1 $(BIN)/pytest tests lab/tests/test_cable_tool.py --numprocesses 2 --dist loadfile \
		--no-loadscope-reorder

lab: setup  ## run the tests of the lab: exams, studies, records, published logs
	OMP_NUM_THREADS=1 $(BIN)/pytest lab/tests --numprocesses 2 --dist loadfile

# Hours: everything that a commit does not wait for.
nightly: setup  ## run the long exams: slow tests, mutations, faults, kills
	OMP_NUM_THREADS=1 $(BIN)/pytest tests lab/tests -m slow
	$(BIN)/python -m tests.mutations
	$(BIN)/python -m tests.held_out
	$(BIN)/python -m lab.tests.held_out
	$(BIN)/python -m tests.wheel
	$(BIN)/python -m tests.faults --runs 20
	$(BIN)/python -m tests.faults kill --runs 20

bench: setup  ## measure speed; results per machine in build/benchmarks
	OMP_NUM_THREADS=1 $(BIN)/pytest lab/benchmarks -o addopts="--strict-markers" \
		--benchmark-only --benchmark-storage=file://./build/benchmarks --benchmark-autosave

docs: setup  ## build the documentation as a site: build/site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

docs-of-version: setup  ## put the site of this version beside those of others, on the branch gh-pages
	NO_MKDOCS_2_WARNING=1 $(BIN)/mike --quiet deploy --update-aliases \
		$$($(BIN)/python -c "import tendon_newton; print(tendon_newton.__version__)") latest
	$(BIN)/mike --quiet set-default latest

release: setup  ## write VERSION into all files that state one, try its wheel and build its site
	$(BIN)/python docs/release.py $(VERSION)
	$(BIN)/python -m tests.wheel
	$(MAKE) docs
