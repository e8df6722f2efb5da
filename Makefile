# make demo    a robot that moves, from nothing but Python >= 3.11 and make
# make test    install the test extra and run the tests, in parallel and without the slow ones
# make test-all  every test, with all extras (and Chromium, where it is installed)
# make lint    ruff, format check, pyright and the docstring counts
# make docs    the documentation as a site, in site/; any warning fails
# make bench   side-by-side benchmarks, written to docs/benchmarks.md (quiet machine; ARGS=--quick for a short run)
# make attack  hostile files, errors within MuJoCo and odd clients, through every reader; then random ones for
#              FUZZ seconds (30 by default)
# make fuzz    the random ones alone
# make format  rewrite the code the way lint wants it
# make type    pyright alone
# make check   lint and test
# make clean   remove everything that make made
#
# Variables: PYTHON (the interpreter to build .venv from), VENV (where), OUT (the demo's folder),
# ARGS (more arguments, as in `make demo ARGS="my_robot.urdf"` or `make test ARGS="-k camera"`).

VENV ?= .venv
OUT ?= demo
FUZZ ?= 30
ARGS ?=
BIN := $(VENV)/bin
# Each worker begins with its own share of the files: neighbours use the same robots and libraries.
PARALLEL := -n auto --dist worksteal
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

# The checker must not look for its own updates.
export PYRIGHT_PYTHON_IGNORE_WARNINGS := 1

.PHONY: demo test test-all docs bench attack fuzz lint format type check clean help
.DEFAULT_GOAL := help

help:
	@awk '/^#/ { sub(/^# ?/, ""); print; next } { exit }' $(firstword $(MAKEFILE_LIST))

demo: $(VENV)/.installed
	$(BIN)/roboyard demo --out $(OUT) $(ARGS)

test: $(VENV)/.installed-test
	$(BIN)/python tools/compile_loops.py
	$(BIN)/python -m pytest $(PARALLEL) -m "not slow" $(ARGS)

test-all: $(VENV)/.installed-all
	$(BIN)/python tools/compile_loops.py
	$(BIN)/python -m pytest $(PARALLEL) $(ARGS)

attack: $(VENV)/.installed-test
	$(BIN)/python tools/compile_loops.py
	$(BIN)/python -m pytest -q $(PARALLEL) tests/test_attack.py tests/untrusted tests/sim/test_mjcf_hostile.py \
	  tests/sim/test_survival.py tests/shapes/test_bounds.py tests/description/test_workspaces.py \
	  tests/audit/test_hostile.py tests/audit/test_fuzz.py tests/pybullet/test_server_strangers.py \
	  tests/pybullet/test_server_guards.py tests/test_installations.py tests/cli/test_control_characters.py \
	  tests/fuzz $(ARGS)
	$(MAKE) fuzz

fuzz: $(VENV)/.installed-test
	$(BIN)/python tools/fuzz_readers.py $(FUZZ)

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/python tools/docstrings.py

docs: $(VENV)/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "open site/index.html"

bench: $(VENV)/.installed-test
	$(BIN)/python tools/bench_page.py $(ARGS)

type: $(VENV)/.installed-dev
	$(BIN)/pyright --pythonpath $(BIN)/python

format: $(VENV)/.installed-dev
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

check: lint test

clean:
	rm -rf $(VENV) build dist site .pytest_cache .ruff_cache .hypothesis
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +

# One stamp for each set of requirements, so that a second run installs nothing.
$(VENV)/.installed: $(VENV)/.created pyproject.toml constraints.txt
	@echo "installing Roboyard into $(VENV) (a minute or two the first time)"
	$(PIP_INSTALL) -e ".[gui]"
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(PIP_INSTALL) -e ".[test]"
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(PIP_INSTALL) -e ".[test,dev]"
	@touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	$(PIP_INSTALL) -e ".[docs]"
	@touch $@

# The Stretch descriptions come as data; what their package would install beside them is not needed.
$(VENV)/.installed-all: $(VENV)/.installed
	$(PIP_INSTALL) -e ".[test-all,dev]"
	$(PIP_INSTALL) --no-deps hello-robot-stretch-urdf
	@touch $@

$(VENV)/.created:
	@for python in $(PYTHON) python3 python3.13 python3.12 python3.11 python; do \
	  command -v "$$python" >/dev/null 2>&1 || continue; \
	  "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || continue; \
	  "$$python" -c 'import venv, ensurepip' 2>/dev/null || { missing="$$python"; continue; }; \
	  echo "creating $(VENV) with $$("$$python" --version)"; \
	  rm -rf $(VENV) && "$$python" -m venv $(VENV) && touch $@ && exit 0; \
	  exit 1; \
	done; \
	if [ -n "$$missing" ]; then \
	  echo "make: $$missing has no venv module; install it (on Debian and Ubuntu: apt install python3-venv)" >&2; \
	else \
	  echo "make: Roboyard needs Python 3.11 or newer and found none; install one, or name it:" \
	    "make demo PYTHON=/path/to/python3.12" >&2; \
	fi; \
	exit 1
