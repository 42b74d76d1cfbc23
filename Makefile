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

TAIL ?= articulated
M    ?= 1
N    ?= 3
STARTS ?= 200
WORKERS ?= -n auto --dist worksteal
CALLS ?= 2000
MUTANTS ?= 200
SEED ?= 1
EXTRAS ?= dev,peers
JOBS ?= 2
CPU    ?= m4
ifneq ($(filter embedded,$(MAKECMDGOALS)),)
REAL   ?= $(if $(filter m4,$(CPU)),float,double)
endif
# a word of the shell, whatever is in it
quoted  = '$(subst ','\'',$(1))'
# options of `make model`: REAL=float EMISSION=loops PROFILE=reproducible BAKED=1 FUNCTIONS=energy,momentum
OPTIONS := $(if $(REAL),--real $(call quoted,$(REAL))) \
           $(if $(EMISSION),--emission $(call quoted,$(EMISSION))) \
           $(if $(PROFILE),--profile $(call quoted,$(PROFILE))) \
           $(if $(BAKED),--baked) \
           $(if $(FUNCTIONS),--functions $(call quoted,$(FUNCTIONS)))
NAME    := $(TAIL)_m$(M)$(if $(filter continuum,$(TAIL)),,_n$(N))
SCENE   ?= $(wildcard scenes/$(NAME).toml)
SIZE    := --tail $(call quoted,$(TAIL)) --segments $(call quoted,$(M)) \
           $(if $(filter continuum,$(TAIL)),,--links $(call quoted,$(N)))
WANTED  := $(OPTIONS) $(if $(SCENE),-- $(call quoted,$(SCENE)),$(SIZE))
# what it makes and how it is called is the generator's to tell: options are part of the name
GENERATE := $(PY) -m serpentail_codegen
FOLDER   := "$$($(GENERATE) --print-folder $(WANTED))"
PAGE     := $(wildcard hatch_build.py viewer/*.* viewer/src/*)

.PHONY: help setup demo test test-portable test-slow test-all model verify bench stress mutants embedded size-report studies study-models study-righting study-contact study-landing study-morphology study-replanning wheels docs lint golden clean
.DELETE_ON_ERROR:

help:
	@echo "serpentail: dynamics of a floating body with a serpentine tail, generated"
	@echo
	@echo "  make setup                                 .venv with everything, by uv where it is on PATH"
	@echo "  make demo                                  the paper's rat: generate, compile, simulate, draw"
	@echo "  make test                                  the quick tests: what takes at most 5 s"
	@echo "  make test-slow                             the rest, with every extra;  make test-all: both, models optimised"
	@echo "  make test   ROOM=simulation                the tests of one room, a folder of tests/"
	@echo "  make test-portable                         motions and plans, as on a processor with AVX2, without AVX-512"
	@echo "  make model  TAIL=articulated M=3 N=4       -> generated/articulated_m3_n4"
	@echo "  make model  TAIL=continuum M=3             -> generated/continuum_m3"
	@echo "  make model  SCENE=scenes/kangaroo_rat_m3_n4.toml"
	@echo "              options, part of the name: REAL=float EMISSION=loops PROFILE=reproducible BAKED=1"
	@echo "                       FUNCTIONS=energy,momentum -> generated/articulated_m3_n4_float..."
	@echo "  make verify TAIL=articulated M=3 N=4       verification report of that model"
	@echo "  make bench                                 benchmark report"
	@echo "  make stress                                errors, drifts, drops, fuzz at the limits; CALLS=2000 random calls"
	@echo "  make mutants                               do the tests notice small changes of the sources? MUTANTS=200 SEED=1 JOBS=2"
	@echo "  make embedded TAIL=articulated M=1 N=3     run it on a Cortex-M4F in QEMU against the host; CPU=m7: in double"
	@echo "  make size-report                           flash, RAM, stack and instructions -> docs/embedded.md"
	@echo "  make study-models                          the paper's Fig. 8: both tails compared, and what each costs"
	@echo "  make study-righting                        the paper's Figs. 9 to 13, Table 2: righting, planned and true"
	@echo "  make study-contact                         kick, jump from the tail, self-recovery: films, plots, a table"
	@echo "  make study-landing                         kicks that the tail rights onto the feet, planned and passive"
	@echo "  make study-morphology                      what a tail is worth: 20400 plans of righting, against its shape"
	@echo "  make study-replanning                      bodies unlike the planned one: open loop, PFL, predictive control"
	@echo "  make studies                               all; STARTS=200 random starts in the second"
	@echo "  make wheels                                builds wheel and sdist, installs the wheel for each Python that is here"
	@echo "  make docs                                  the site, with the gallery: output/docs/index.html"
	@echo "  make lint                                  style, import rules, types, lengths of files"
	@echo "  make golden                                accept what the generator emits now as the golden models"
	@echo "  make clean                                 remove what was generated, and output/"

ifneq ($(UV),)
ENVIRONMENT := $(UV) venv --quiet --seed --python $(PYTHON) $(VENV)
INSTALL := $(UV) pip install --quiet --python $(PY) --reinstall-package serpentail
else
ENVIRONMENT := $(PYTHON) -m venv $(VENV)
INSTALL := $(PY) -m pip install --quiet --disable-pip-version-check
endif
# a page that could not be made is tried again by the next `make setup` or `make demo`
TELL_PAGE := if test -f runtime/serpentail/show/page/page.html; then touch $(PAGED); else \
             echo "no page of runs, which needs Node.js 18 and npm: $$(cat .build/page_missing 2>&1)"; fi
AGAIN := $(if $(wildcard $(READY)),$(if $(wildcard $(PAGED)),,$(PAGED)))

setup: $(READY) $(AGAIN)

# The page needs Node.js and npm, which would keep the first picture waiting.
$(DRAWS): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed, $(PYTHON) is older: make setup PYTHON=python3.11"; exit 1; }
	@test -x $(PY) || $(ENVIRONMENT)
	SERPENTAIL_PAGE=later $(INSTALL) --editable '.[plan,plot]'
	@touch $@

$(PAGED): $(PAGE) | $(DRAWS)
	$(INSTALL) --no-deps --editable .
	@$(TELL_PAGE)

$(TESTED): $(DRAWS) $(PAGE)
	$(INSTALL) --editable '.[test]'
	@$(TELL_PAGE)
	@touch $@

$(READY): $(DRAWS) $(PAGE)
	$(INSTALL) --editable '.[$(EXTRAS)]'
	@$(TELL_PAGE)
	@touch $(TESTED) $@

demo: $(DRAWS)
	$(PY) examples/demo.py
	@$(MAKE) --no-print-directory $(PAGED)

# What pytest and Python compile is kept, away from the sources; seconds of every process.
test test-portable test-slow test-all: export PYTHONDONTWRITEBYTECODE :=
test test-portable test-slow test-all: export PYTHONPYCACHEPREFIX := $(CURDIR)/.build/bytecode

# The models that tests share are made side by side, before the tests that need them.
test: $(TESTED)
	$(if $(ROOM),,$(PY) -m tests.support.zoo --quick)
	$(PY) -m pytest --quick -m "not slow" $(WORKERS) $(if $(ROOM),tests/$(ROOM))

# The rooms whose numbers hang most on how sums round, as on a processor with AVX2 and no AVX-512.
test-portable: $(READY)
	$(PY) tests/support/as_on.py x86-64-v3 \
	  $(PY) -m pytest -m "not slow" $(WORKERS) tests/simulation tests/planning tests/scenes

# What `test` leaves out.
test-slow: test-portable
	$(PY) -m pytest -m slow $(WORKERS)

# Every test, with models compiled as a user's are.
test-all: test-portable
	$(PY) -m tests.support.zoo
	$(PY) -m pytest $(WORKERS)

lint: $(READY)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/lint-imports --no-cache
	$(VENV)/bin/mypy
	$(PY) -m tests.house.file_lengths

# The generator compares hashes, and makes what differs; what it made is compiled and told once.
model: $(DRAWS)
	@said=$$($(GENERATE) $(WANTED)) && echo "$$said" && folder=$${said%%:*} && \
	stamp=generated/.stamps/$${folder##*/} && { cmp -s $$stamp $$stamp.told || \
	{ $(VENV)/bin/serpentail info "$$folder" && cp $$stamp $$stamp.told; }; }

verify: $(READY) model
	$(PY) -m tests.verification $(FOLDER)

bench: $(READY)
	$(PY) -m benchmarks.bench

stress: $(READY)
	$(PY) -m stress.stress --calls $(CALLS)

mutants: $(READY)
	$(PY) -m mutants.run --mutants $(MUTANTS) --seed $(SEED) --jobs $(JOBS)

embedded: $(READY) model
	$(PY) -m embedded.check $(FOLDER) --board $(CPU)

size-report: $(READY)
	$(PY) -m embedded.size_report

study-models: $(READY)
	$(PY) -m examples.studies.models

study-righting: $(READY)
	$(PY) -m examples.studies.righting --starts $(STARTS)

study-contact: $(READY)
	$(PY) -m examples.studies.contact

study-landing: $(READY)
	$(PY) -m examples.studies.landing

study-morphology: $(READY)
	$(PY) -m examples.studies.morphology

study-replanning: $(READY)
	$(PY) -m examples.studies.replanning

studies: study-models study-righting study-contact study-landing study-morphology study-replanning

wheels: $(READY)
	$(PY) -m tests.packaging.wheels

# Every warning is an error; the scripts of the gallery run.
docs: $(READY)
	$(PY) -m sphinx -W --keep-going -n -q -b html -d .build/doctrees docs output/docs
	@echo "written: output/docs/index.html"

golden: $(READY)
	$(PY) -m pytest tests/house/test_golden.py tests/house/test_model_functions.py tests/docs/test_names.py --update-golden

clean:
	rm -rf output .build docs/api docs/gallery
	test ! -d generated || find generated -mindepth 1 -maxdepth 1 ! -name README.md ! -name 'golden_*' -exec rm -rf {} +
