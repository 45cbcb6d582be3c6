# make demo   builds, installs into .venv, solves the bundled robots, writes pictures to demo/
# make test   everything that CI runs
# make bench  criterion benches and side-by-side runs against other tools
# make figures remakes the papers' figures into examples/figures/
# make house  counts comments, words and arrows of the code
# make docs   builds the guide into site/

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := $(shell find rust python Cargo.toml Cargo.lock pyproject.toml -type f -not -name '*.so' -not -path '*/__pycache__/*')

# Pictures are written, never shown.
export MPLBACKEND := Agg
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# Where cargo puts what it makes.
TARGET := $(or $(CARGO_TARGET_DIR),target)
MKDOCS := NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

.PHONY: help demo test bench house figures docs guide tools rust-checks rust-tests package python-checks python-tests runs clean

help:
	@sed -n 's/^# \(make .*\)/\1/p' Makefile

demo: $(VENV)/installed
	$(BIN)/tdcr demo --output demo

test: tools rust-checks rust-tests package python-checks python-tests guide runs
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
	$(BIN)/pip install --quiet --force-reinstall --no-deps .
	$(BIN)/pip install --quiet '.[plot,mesh,sobol,parquet]'
	@touch $@

$(VENV)/developed: $(VENV)/created pyproject.toml
	$(BIN)/pip install --quiet 'maturin>=1.14,<2' --group test --group peers --group docs
	@touch $@

rust-checks: tools
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked --quiet

rust-tests: tools
	cargo test --locked
	cargo bench --locked -- --test

# The wheel that the Python tests use, and a wheel from the sdist, which must hold all it needs.
package: $(VENV)/developed
	rm -rf dist
	$(BIN)/maturin build --release --locked --sdist --out dist
	$(BIN)/pip wheel --quiet --no-deps --wheel-dir dist/from-sdist dist/tdcr-*.tar.gz
	ls dist/*-abi3-*.whl dist/from-sdist/*-abi3-*.whl
	wheel=$$(ls $(CURDIR)/dist/*.whl); \
	$(BIN)/pip install --quiet --force-reinstall --no-deps "$$wheel"; \
	$(BIN)/pip install --quiet "tdcr[plot,mesh,sobol,parquet] @ file://$$wheel"
	@touch $(VENV)/installed

python-checks: package
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	cd / && $(CURDIR)/$(BIN)/python -m mypy.stubtest tdcr._core

python-tests: package
	$(BIN)/pytest

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
docs: $(VENV)/installed $(VENV)/developed
	$(MKDOCS)

guide: package
	$(MKDOCS)

# Keeps what is printed, and writes the guide's page of it. QUICK=1 is a short run: it proves that all
# works, and its figures are rough.
bench: SHELL := /bin/bash
bench: .SHELLFLAGS := -o pipefail -ec
bench: $(VENV)/installed $(VENV)/developed
	rm -rf $(TARGET)/bench && mkdir -p $(TARGET)/bench && touch $(TARGET)/bench/started
	cargo bench --locked -- $(if $(QUICK),--warm-up-time 0.3 --measurement-time 1 --noplot)
	$(BIN)/python benches/python_calls.py | tee $(TARGET)/bench/python_calls.txt
	for script in benches/peers/*.py; do $(BIN)/python $$script $(if $(QUICK),--quick) \
		| tee $(TARGET)/bench/$$(basename $$script .py).txt; done
	$(BIN)/python benches/report.py $(TARGET) $(if $(QUICK),--quick) --output docs/benchmarks.md

clean:
	rm -rf $(VENV) dist demo site target
