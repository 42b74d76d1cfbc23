# The front door: `make` alone prints help.
PYTHON ?= python3
VENV   := .venv
PY     := $(VENV)/bin/python
# what is installed: what the demo uses, the page of runs, what the quick tests need, all the rest
DRAWS  := $(VENV)/.draws
PAGED  := $(VENV)/.paged
TESTED := $(VENV)/.tested
READY  := $(VENV)/.ready
UV     ?= $(shell command -v uv)
EXTRAS ?= dev,peers
TAIL ?= articulated
M    ?= 1
N    ?= 3
option   = $(if $(2),--$(1) '$(subst ','\'',$(2))')
LINKS   := $(if $(filter continuum,$(TAIL)),,$(N))
SCENE   ?= $(wildcard scenes/$(TAIL)_m$(M)$(if $(LINKS),_n$(LINKS)).toml)
SIZE    := $(call option,tail,$(TAIL)) $(call option,segments,$(M)) $(call option,links,$(LINKS))
WANTED  := $(call option,real,$(REAL)) $(call option,emission,$(EMISSION)) $(call option,profile,$(PROFILE)) \
           $(if $(BAKED),--baked) $(call option,functions,$(FUNCTIONS)) $(if $(SCENE),$(call option,,$(SCENE)),$(SIZE))
# what it makes and how it is called is the generator's to tell: options are part of the name
GENERATE := $(PY) -m serpentail_codegen

.PHONY: help setup demo test test-slow test-all lint docs bench paper gallery-data model verify mutants wheels golden clean
help:
	@sed -n 's/^#> //p' Makefile

#> make setup                             .venv with everything, by uv where it is on PATH
ENVIRONMENT := $(if $(UV),$(UV) venv --quiet --seed --python $(PYTHON),$(PYTHON) -m venv) $(VENV)
INSTALL := $(if $(UV),$(UV) pip install --quiet --python $(PY) --reinstall-package serpentail,\
             $(PY) -m pip install --quiet --disable-pip-version-check) --editable
# a page that could not be made is tried again by the next `make setup` or `make demo`
PAGE := $(wildcard hatch_build.py viewer/*.* viewer/src/* viewer/src/*/*)
TELL_PAGE := if test -f runtime/serpentail/show/page/page.html; then touch $(PAGED); else \
             echo "no page of runs, which needs Node.js 18 and npm: $$(cat .build/page_missing 2>&1)"; fi
setup: $(READY) $(if $(wildcard $(READY)),$(if $(wildcard $(PAGED)),,$(PAGED)))
# The page needs Node.js and npm, which would keep the first picture waiting.
$(DRAWS): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "Python 3.11 or newer is needed, $(PYTHON) is older: make setup PYTHON=python3.11"; exit 1; }
	@test -x $(PY) || $(ENVIRONMENT)
	SERPENTAIL_PAGE=later $(INSTALL) '.[plan,plot]'
	@touch $@
$(PAGED): $(PAGE) | $(DRAWS)
	$(INSTALL) . --no-deps
	@$(TELL_PAGE)
$(TESTED): $(DRAWS) $(PAGE)
	$(INSTALL) '.[test]'
	@$(TELL_PAGE); touch $@
$(READY): $(DRAWS) $(PAGE)
	$(INSTALL) '.[$(EXTRAS)]'
	@$(TELL_PAGE); touch $(TESTED) $@
#> make demo                              the paper's rat: generate, compile, simulate, draw
demo: $(DRAWS)
	$(PY) examples/demo.py
	@$(MAKE) --no-print-directory $(PAGED)
#> make test                              the quick tests; ROOM=simulation: those of one folder of tests/
#> make test-slow                         the rest, and three rooms optimised and without AVX-512
#> make test-all                          both, with models optimised as a user's are
# what pytest and Python compile is kept, away from the sources: seconds of every process
test test-slow test-all: export PYTHONDONTWRITEBYTECODE :=
test test-slow test-all: export PYTHONPYCACHEPREFIX := $(CURDIR)/.build/bytecode
PYTEST := $(PY) -m pytest -n auto --dist worksteal
# the rooms whose numbers hang most on how sums round, as on a processor with AVX2 and no AVX-512
AS_AVX2 := $(PY) tests/support/as_on.py x86-64-v3 $(PYTEST) -m "not slow" tests/simulation tests/planning tests/scenes
test: $(TESTED)
	$(if $(ROOM),,$(PY) -m tests.support.zoo --quick)
	$(PYTEST) --quick -m "not slow" $(if $(ROOM),tests/$(ROOM))
test-slow: $(READY)
	$(AS_AVX2)
	$(PYTEST) --quick -m slow
test-all: $(READY)
	$(PY) -m tests.support.zoo
	$(PYTEST)
	$(AS_AVX2)
#> make lint                              style, import rules, types, lengths of files
lint: $(READY)
	$(VENV)/bin/ruff check . && $(VENV)/bin/ruff format --check .
	$(VENV)/bin/lint-imports --no-cache
	$(VENV)/bin/mypy && $(PY) -m tests.house.file_lengths
#> make docs                              the site, with the gallery: output/docs/index.html
docs: $(READY)
	$(PY) -m sphinx -W --keep-going -n -q -b html -d .build/doctrees docs output/docs

#> make model  TAIL=articulated M=3 N=4   -> generated/articulated_m3_n4; also TAIL=continuum M=3, SCENE=scenes/FILE.toml
#>             options, part of the name: REAL=float EMISSION=loops PROFILE=reproducible BAKED=1 FUNCTIONS=energy,momentum
# The generator compares hashes, and makes what differs; what it made is compiled and told once.
model: $(DRAWS)
	@said=$$($(GENERATE) $(WANTED)) && echo "$$said" && folder=$${said%%:*} && \
	stamp=generated/.stamps/$${folder##*/} && { cmp -s $$stamp $$stamp.told || \
	{ $(VENV)/bin/serpentail info "$$folder" && cp $$stamp $$stamp.told; }; }
#> make verify TAIL=articulated M=3 N=4   verification report of that model
verify: $(READY) model
	$(PY) -m tests.verification "$$($(GENERATE) --print-folder $(WANTED))"
#> make bench                             benchmark report; one measure: python -m benchmarks NAME
bench: $(READY)
	$(PY) -m benchmarks
#> make paper                             the paper's figures and tables again, beside its numbers; FIGURES="fig8 table2"
paper: $(READY)
	$(PY) -m examples.paper $(FIGURES)
#> make gallery-data                      published animals and robots beside our models: docs/measurements.md
gallery-data: $(READY)
	$(PY) -m examples.gallery_data
#> make mutants                           do tests notice small changes of the sources? MUTANTS=200 SEED=1 JOBS=2
mutants: $(READY)
	$(PY) -m checks.mutants --mutants $(or $(MUTANTS),200) --seed $(or $(SEED),1) --jobs $(or $(JOBS),2)
#> make wheels                            wheel and sdist, and the wheel in an environment of each Python that is here
wheels: $(READY)
	$(PY) -m tests.packaging.wheels
#> make golden                            accept what the generator emits now as the golden models
golden: $(READY)
	$(PY) -m pytest tests/house/test_golden.py tests/house/test_model_functions.py tests/house/test_face.py \
	  tests/docs/test_names.py --update-golden
#> make clean                             remove what was generated, and output/
clean:
	rm -rf output .build docs/api docs/gallery
	test ! -d generated || find generated -mindepth 1 -maxdepth 1 ! -name README.md ! -name 'golden_*' -exec rm -rf {} +
