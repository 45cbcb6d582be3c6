# make demo    builds, installs into .venv, solves the bundled robots, writes pictures to demo/
# make develop an editable build with every extra into .venv: again after a change in Rust, which takes seconds
# make quick   Rust and Python tests without the slow ones, on that build: under two minutes when it is warm
# make test    everything that CI runs
# make soak    the long statistics that `make test` leaves out, for half an hour
# make bench   criterion benches and side-by-side runs against other tools
# make figures remakes the papers' figures into examples/figures/
# make instructions  counts the instructions of five solves, with valgrind
# make house   counts comments, words and arrows of the code
# make docs    builds the guide into site/
#
# Hooks before a commit (formats, clippy, ruff, mypy; all of this machine, nothing is fetched), after `make develop`:
# .venv/bin/pip install pre-commit && .venv/bin/pre-commit install
#
# Slow tests, which `make quick` skips, are marked where they stand: in Python by @pytest.mark.slow, in Rust by a module
# `slow` around them. So `cargo test` and `pytest` alone run all, and no list of names and no feature (which would
# compile everything twice) stands elsewhere. Marked is what takes more than a second of one core.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := $(shell find rust python Cargo.toml Cargo.lock pyproject.toml -type f -not -name '*.so' -not -path '*/__pycache__/*')

# Pictures are written, never shown.
export MPLBACKEND := Agg
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# Where cargo puts what it makes.
TARGET := $(or $(CARGO_TARGET_DIR),target)
# Where the sdist is unpacked, always at the same place: cargo knows it again.
SDIST := $(abspath $(TARGET))/sdist
MKDOCS := NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

EXTRAS := plot,mesh,sobol,parquet

.PHONY: help demo develop quick test soak bench instructions house figures docs guide tools rust-checks rust-tests package python-checks \
	python-tests runs clean

help:
	@sed -n 's/^# \(make .*\)/\1/p' Makefile

demo: $(VENV)/installed
	$(BIN)/tdcr demo --output demo

test: tools rust-checks rust-tests package python-checks python-tests runs
	@echo "all checks passed"

# Says what is missing before anything starts.
tools:
	@command -v cargo >/dev/null || { echo "tdcr needs a Rust toolchain (cargo and rustc 1.89 or later) on the PATH: see https://rustup.rs" >&2; exit 1; }
	@command -v rustc >/dev/null || { echo "tdcr needs rustc 1.89 or later on the PATH: see https://rustup.rs" >&2; exit 1; }
	@command -v $(PYTHON) >/dev/null || { echo "tdcr needs Python 3.11 or later; name it with make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "tdcr needs Python 3.11 or later, $(PYTHON) is $$($(PYTHON) -V); name another with make PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "tdcr needs Python's venv module (on Debian: apt install python3-venv)" >&2; exit 1; }

$(VENV)/created: | tools
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip
	@touch $@

$(VENV)/installed: $(VENV)/created $(SOURCES) | tools
	$(BIN)/pip install --quiet '.[$(EXTRAS)]'
	@rm -f $(VENV)/editable
	@touch $@

# What the checks need beside tdcr itself.
$(VENV)/equipped: $(VENV)/created pyproject.toml
	$(BIN)/pip install --quiet 'maturin>=1.14,<2' --group test --group peers --group docs
	@touch $@

# The profile of the tests, whose compiled core it shares. Once installed, only the compiled module changes.
develop: $(VENV)/equipped
	$(BIN)/maturin develop --locked --profile test $(if $(wildcard $(VENV)/editable),--skip-install,--extras $(EXTRAS))
	@rm -f $(VENV)/installed
	@touch $(VENV)/editable

quick: develop
	cargo test --locked -- --skip ::slow::
	$(BIN)/pytest -m "not slow and not wheel"

soak:
	cargo test --locked --release -- --ignored

rust-checks: tools
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked --quiet

rust-tests: tools
	cargo test --locked
	cargo test --locked --benches
	cargo run --locked --quiet --profile test --example bend_and_back

# The sdist, and the wheel that pip makes of it, which the Python tests use: so it holds all it needs. Files that are as
# they were keep their time, so that cargo compiles no more than what changed.
package: $(VENV)/equipped
	rm -rf dist $(SDIST)/new
	$(BIN)/maturin sdist --out dist
	mkdir -p $(SDIST)/new
	tar xmzf dist/tdcr-*.tar.gz --strip-components 1 -C $(SDIST)/new
	cd $(SDIST)/new && find . -type f | while read file; do \
		if cmp -s $$file ../tdcr/$$file; then touch -r ../tdcr/$$file $$file; fi; done
	rm -rf $(SDIST)/tdcr && mv $(SDIST)/new $(SDIST)/tdcr
	CARGO_TARGET_DIR=$(abspath $(TARGET)) MATURIN_PEP517_ARGS=--locked \
		$(BIN)/pip wheel --quiet --no-deps --wheel-dir dist $(SDIST)/tdcr
	wheel=$$(ls $(CURDIR)/dist/*-abi3-*.whl); \
	$(BIN)/pip install --quiet --force-reinstall --no-deps "$$wheel"; \
	$(BIN)/pip install --quiet "tdcr[$(EXTRAS)] @ file://$$wheel"
	@rm -f $(VENV)/editable
	@touch $(VENV)/installed

python-checks: package
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	cd / && $(CURDIR)/$(BIN)/python -m mypy.stubtest tdcr._core

python-tests: package
	$(BIN)/pytest

# `make instructions COUNT="--write before.json"` keeps the counts, `--against before.json` compares.
instructions:
	$(PYTHON) benches/instructions.py $(COUNT)

# Counts and arrows; `make house HOUSE="--list all"` lists the places, `--against COMMIT` compares.
house:
	@$(PYTHON) tests/python/house $(HOUSE)

# What a user runs: the demo, the examples, the side-by-side comparison (once, in small), from the
# installed wheel.
runs: package
	$(BIN)/tdcr demo --output target/runs/demo
	for script in examples/*.py; do $(BIN)/python $$script --output target/runs/figures || exit 1; done
	for script in benches/peers/*.py; do $(BIN)/python $$script --quick || exit 1; done
	$(BIN)/python benches/leaning.py --cases 20

figures: $(VENV)/installed
	for script in examples/*.py; do $(BIN)/python $$script --output examples/figures || exit 1; done

# Every link, anchor, formula and docstring must hold: a warning is an error.
docs: $(VENV)/installed $(VENV)/equipped
	$(MKDOCS)

guide: package
	$(MKDOCS)

# Keeps what is printed, and writes the guide's page of it. QUICK=1 is a short run: it proves that all
# works, and its figures are rough. Says which benches are slower than benches/baseline.json by over
# 15 %, and fails there with CHECK=1.
bench: SHELL := /bin/bash
bench: .SHELLFLAGS := -o pipefail -ec
bench: $(VENV)/installed $(VENV)/equipped
	rm -rf $(TARGET)/bench && mkdir -p $(TARGET)/bench && touch $(TARGET)/bench/started
	cargo bench --locked -- $(if $(QUICK),--warm-up-time 0.3 --measurement-time 1 --noplot)
	$(BIN)/python benches/guard.py $(TARGET) $(if $(CHECK),--check)
	$(BIN)/python benches/python_calls.py | tee $(TARGET)/bench/python_calls.txt
	for script in benches/peers/*.py; do $(BIN)/python $$script $(if $(QUICK),--quick) \
		| tee $(TARGET)/bench/$$(basename $$script .py).txt; done
	$(BIN)/python benches/report.py $(TARGET) $(if $(QUICK),--quick) --output docs/benchmarks.md

clean:
	rm -rf $(VENV) dist demo site target
