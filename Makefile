# Two commands: `make demo` and `make test`. Both set everything up; Debian's python3, python3-venv and make are enough.
.DEFAULT_GOAL := help
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
CORE := .venv/.core
JS_READY := node_modules/.package-lock.json

help: ## Show this list
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "  make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# Find uv, or install it into .uv.
FIND_UV = if command -v uv >/dev/null 2>&1; then UV=uv; else \
	  [ -x .uv/bin/uv ] || { $(PYTHON) -m venv .uv && .uv/bin/pip install --quiet --disable-pip-version-check uv; } || exit 1; \
	  UV=.uv/bin/uv; fi

$(READY): pyproject.toml
	@$(FIND_UV); $$UV sync --quiet --all-extras --python $(PYTHON) && touch $(CORE) $@

# The demo needs neither extras nor tools; --inexact leaves them in place where they are installed already.
$(CORE): pyproject.toml
	@$(FIND_UV); $$UV sync --quiet --inexact --no-default-groups --python $(PYTHON) && touch $@

setup: $(READY) ## Make the virtual environment in .venv

demo: $(CORE) ## Watch a virtual e-puck avoid walls; leaves elib-demo.png
	@$(BIN)/elib demo

test: $(READY) ## Run all tests
	@$(BIN)/pytest -n auto

check: $(READY) $(if $(shell command -v npm 2>/dev/null),check-js) ## Lint, format, types, layers and generated pages
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-cache
	@$(BIN)/python docs/generate_reference.py --check
	@$(BIN)/python docs/check_words.py
	@command -v npm >/dev/null || echo "The JavaScript was not checked: that needs nodejs and npm."

check-js: $(JS_READY) ## Format and types of the JavaScript; fails without npm
	@npm run --silent check

$(JS_READY): package.json package-lock.json
	@command -v npm >/dev/null || { echo "The JavaScript cannot be checked without nodejs and npm."; exit 1; }
	@npm ci --loglevel=error >/dev/null && touch $@

docs: $(READY) ## Renew the generated reference pages
	@$(BIN)/python docs/generate_reference.py

bench: $(READY) ## Measure ratios against floors and peers
	@for script in benchmarks/bench_link.py benchmarks/simulation.py benchmarks/camera.py benchmarks/serving.py benchmarks/et.py benchmarks/recording.py benchmarks/web.py benchmarks/wifi.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

clean: ## Remove what the other commands made
	rm -rf .venv .uv node_modules .pytest_cache .mypy_cache .ruff_cache .hypothesis build dist elib-demo.png

.PHONY: help setup demo test check check-js docs bench clean
