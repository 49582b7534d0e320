# Every target sets itself up in .venv; all it needs is Python 3.11 or newer, and make.
.DEFAULT_GOAL := help
.PHONY: help demo real test test-slow lint clean
SHELL := /bin/sh

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
TEST_READY := $(VENV)/.ready-test
LINT_READY := $(VENV)/.ready-lint
PYTHONS := $(PYTHON) python3 python3.14 python3.13 python3.12 python3.11 python
CONCEALED := calibration_data/examples/pulled_silicone
PNEUSMA_RECORDINGS ?= $(wildcard ../shared/recordings)
RAW := soft_robotics_materials/Dragon Skin 10 MEDIUM.csv

help:
	@echo "make demo       what a model misses in simulated data that ship with the package, then the material -> out/demo"
	@echo "make real       the main job on real recordings -> out/real"
	@echo "make real-proof other laboratories' recordings, names hidden, diagnosed: one table -> out/real_proof"
	@echo "make proof      blind trial of the diagnosis on 24 sealed campaigns, minutes -> out/proof"
	@echo "make proof-full the same on 814, hours; interrupt it and run it again at will -> out/proof"
	@echo "make calibrate  how likely something unknown acts beside names, from simulated campaigns; hours, goes on where it ended"
	@echo "make test       the tests (warnings are errors)"
	@echo "make test-slow  the long ones, too"
	@echo "make bench      speed of the core: ratios, compile times, memory; half an hour -> out/bench (BENCH=--quick: less)"
	@echo "make docs       the site: tutorials, how-to, explanation, reference -> out/site"
	@echo "make fuzz       20,000 damaged files: read rightly or refused in one line -> out/fuzz.json"
	@echo "make soak       commands killed at random moments, resumed and compared; goes on where it was ended -> out/soak"
	@echo "make lint       style and types of the code"
	@echo "make wheel-check the built wheel and sdist, each installed alone and checked"
	@echo "make test-oldest the tests with the oldest supported Python, jax and NumPy"
	@echo "make test-newest the tests with what pip installs today, without constraints"
	@echo "make clean      remove .venv and out"

$(BIN)/pip:
	@python=''; for p in $(PYTHONS); do \
	  if "$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then python="$$p"; break; fi; done; \
	if [ -z "$$python" ]; then \
	  echo "Python 3.11 or newer is needed and none was found; install it, or name it: make PYTHON=/path/to/python3" >&2; \
	  exit 1; fi; \
	"$$python" -m venv $(VENV) || { \
	  echo "$$python cannot make a virtual environment; on Debian and Ubuntu: apt install python3-venv" >&2; \
	  rm -rf $(VENV); exit 1; }

$(READY): pyproject.toml constraints.txt | $(BIN)/pip
	@echo "Installing into $(VENV) (a few minutes the first time)"
	@$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@touch $@

# One installation in a new clone: it holds what the others need. Extras `uq` and `cluster`: without them their tests
# are skipped. Python compiles what is imported; to compile all libraries at once takes pip 25 s of processor time.
$(TEST_READY): pyproject.toml constraints.txt | $(BIN)/pip
	@echo "Installing into $(VENV) (a few minutes the first time)"
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt -e '.[test,uq,cluster]'
	@test -e $(READY) || touch $(READY)
	@touch $@

$(LINT_READY): $(READY)
	@$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[lint]'
	@touch $@

demo: $(READY)
	@echo "== Simulated pulls of a silicone ($(CONCEALED)): their physics is not in the model, and the tool is not told =="
	$(BIN)/pneusma diagnose $(CONCEALED) --out out/demo/diagnosis --force
	$(BIN)/pneusma characterise $(CONCEALED) --model out/demo/diagnosis/augmented.toml --out out/demo/material --force
	$(BIN)/pneusma simulate --design pneuflex_s --pressure-kPa 20 --model out/demo/material/augmented.toml
	@echo
	@echo "Look at  out/demo/diagnosis/report.html   what the model misses, where, the fit with it, what to measure next"
	@echo "         out/demo/material/report.html    the material, in words, figures and numbers"
	@echo "The truth was $(CONCEALED)_truth.json. Your own file: pneusma import RAW.csv --out my_campaign"

real: $(READY)
	@if [ -f "$(PNEUSMA_RECORDINGS)/$(RAW)" ]; then $(MAKE) --no-print-directory real-run; else \
	  echo "No real recordings here: take 'Dragon Skin 10 MEDIUM.csv' from Tensile-Tests-Data of https://github.com/LucMarechal/Soft-Robotics-Materials-Database, put it into FOLDER/soft_robotics_materials/ and run: make real PNEUSMA_RECORDINGS=FOLDER"; fi

.PHONY: real-run
real-run:
	@echo "== Real recording: $(RAW) =="
	$(BIN)/pneusma import "$(PNEUSMA_RECORDINGS)/$(RAW)" --out out/real/recordings --force
	$(BIN)/pneusma characterise out/real/recordings --out out/real/elastomer --force
	$(BIN)/pneusma simulate --design pneuflex_s --pressure-kPa 20 --material out/real/elastomer/material_actuator.toml
	@echo
	@echo "Look at  out/real/elastomer/report.html   the material, in words, figures and numbers"
	@echo "         out/real/recordings              the laboratory's file as a recording"

.PHONY: real-proof
real-proof: $(READY)
	OPENBLAS_NUM_THREADS=1 PNEUSMA_RECORDINGS="$(PNEUSMA_RECORDINGS)" $(BIN)/python tests/real/real_proof.py --out out/real_proof/table.json

# PROOF_SEED, and PROOF_LABEL for a changed tool on campaigns that are sealed already; docs/proof.md
PROOF_SEED ?= 20261121
PROOF_LABEL ?=
PROOF = OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.blind.proof
PROOF_RUN = --seed $(PROOF_SEED) --label "$(PROOF_LABEL)" --out out/proof

PROOF_READY := $(VENV)/.ready-proof
$(PROOF_READY): $(READY)
	@$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[cluster]'
	@touch $@

.PHONY: proof proof-full
proof: $(PROOF_READY)
	$(PROOF) run --plan fixed $(PROOF_RUN) --workers 2 --baselines
	$(PROOF) figures --plan fixed $(PROOF_RUN)

proof-full: $(PROOF_READY)
	$(PROOF) run --plan full $(PROOF_RUN) --workers 2 --baselines
	$(PROOF) figures --plan full $(PROOF_RUN)

# seeds of campaigns that get rows of their own; those that have them are not made again; docs/diagnosis.md
CALIBRATE ?= --seeds 905 --limit 60
.PHONY: calibrate
calibrate: $(READY)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m validation.blind.calibrate $(CALIBRATE)

# Two processes fill two cores: no pools of their own (NPROC is that of XLA). Most of the short tests' time is compiling.
# Hardly optimised programs take a quarter less (90 s of processor time instead of 125 s for four files). What LLVM is told
# of memory, the splitting for several cores, and three passes over loops only help programs that run long: without
# them a file takes 30 s instead of 35 s. Long tests run long, and compare with numbers of programs as users have them.
# Processes that tests start read compiled sources, even where the environment says to write none: 0.4 s less each.
ONE_POOL := OPENBLAS_NUM_THREADS=1 NPROC=1 PYTHONDONTWRITEBYTECODE=
LITTLE := --xla_backend_optimization_level=0
HASTY := $(LITTLE) --xla_cpu_parallel_codegen_split_count=1 \
  --xla_llvm_enable_alias_scope_metadata=false --xla_llvm_enable_noalias_metadata=false \
  --xla_llvm_enable_invariant_load_metadata=false \
  --xla_disable_hlo_passes=while-loop-invariant-code-motion,simplify-while-loops,while-loop-trip-count-annotator
# Another version of XLA may refuse a flag that it does not know.
TESTING := $(ONE_POOL) XLA_FLAGS="$(LITTLE) $(XLA_FLAGS)"

# Pytest rewrites assertions to show their values, which takes each process 6 s for all files (8.5 s instead of 15 s before
# the first test). So only tests that failed run with it, a second time. Files with many tests begin: a single test of ten
# seconds belongs into one of them, or one process waits for it at the end.
SHORT := $(ONE_POOL) XLA_FLAGS="$(HASTY) $(XLA_FLAGS)" $(BIN)/python -m pytest -m "not slow"
test: $(TEST_READY)
	@$(SHORT) -n 2 --dist loadfile --assert=plain || { \
	  echo "== Those that failed, again, with the values of their assertions"; \
	  $(SHORT) --last-failed --last-failed-no-failures none --continue-on-collection-errors; exit 1; }

test-slow: $(TEST_READY)
	$(ONE_POOL) $(BIN)/python -m pytest -n 2 --dist loadfile

# BENCH=--quick stops at 10^5 rows, BENCH="--quick --most 10000" at 10^4
.PHONY: bench
bench: $(READY)
	$(BIN)/python -m benchmarks.core_speed --out out/bench $(BENCH)

DOCS_READY := $(VENV)/.ready-docs
$(DOCS_READY): $(READY)
	@$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]'
	@touch $@

# strict: a broken link, or a public name without docstring, fails. Notebooks are executed once for each change;
# NOTEBOOKS= leaves them as they are
NOTEBOOKS ?= $(patsubst notebooks/%,out/notebooks/%,$(wildcard notebooks/*.ipynb))
.PHONY: docs
docs: $(DOCS_READY) $(LINT_READY) $(TEST_READY) $(NOTEBOOKS)
	$(BIN)/ruff check --select D1 --ignore D105,D107 pneusma_jax fitting validation
	$(BIN)/python -m mkdocs build --clean --quiet
	$(BIN)/python -m pytest -q tests/site
	@echo "Look at  out/site/index.html"

out/notebooks/%.ipynb: notebooks/%.ipynb $(DOCS_READY)
	PNEUSMA_RECORDINGS="$(PNEUSMA_RECORDINGS)" $(BIN)/python docs/_execute.py $< $@

.PHONY: fuzz soak
FUZZ ?= 20000
fuzz: $(READY)
	$(BIN)/python tests/reliability/fuzz.py --count $(FUZZ) --out out/fuzz.json

SOAK ?= 200
soak: $(READY)
	OPENBLAS_NUM_THREADS=1 NPROC=1 $(BIN)/python tests/reliability/soak.py --kills $(SOAK) --out out/soak

.PHONY: types wheel-check test-oldest test-newest
lint: $(LINT_READY) types
	$(BIN)/ruff check .

types: $(LINT_READY)
	$(BIN)/mypy

# built files as a user gets them: each installed in an environment that has nothing else, then checked there
wheel-check: $(LINT_READY)
	rm -rf out/dist
	$(BIN)/python -m build --outdir out/dist . >/dev/null
	@ls -l out/dist
	@for file in out/dist/*.whl out/dist/*.tar.gz; do \
	  echo "== $$file, alone in a new environment"; rm -rf out/bare; \
	  "$$($(BIN)/python -c 'import sys; print(sys._base_executable)')" -m venv out/bare && \
	  out/bare/bin/pip install --quiet --disable-pip-version-check -c constraints.txt "$$file" && \
	  (cd out/bare && bin/pneusma check) || exit 1; done

# OLDEST_PYTHON: the oldest that is supported. OLDEST_TESTS: all of them take as long as make test
OLDEST_PYTHON ?= python3.11
OLDEST_TESTS ?= tests/test_units.py tests/test_calibration.py tests/pneusma_jax tests/inference tests/recordings tests/cli
test-oldest: out/oldest/.ready
	$(TESTING) out/oldest/bin/python -m pytest -m "not slow" -n 2 --dist loadfile $(OLDEST_TESTS)

out/oldest/.ready: pyproject.toml tests/constraints-oldest.txt
	$(OLDEST_PYTHON) -m venv out/oldest
	@out/oldest/bin/pip install --quiet --disable-pip-version-check -c tests/constraints-oldest.txt '.[test,uq,cluster]'
	@touch $@

# without constraints: what a newcomer's pip installs today
NEWEST_PYTHON ?= $(firstword $(foreach python,python3.14 python3.13 python3.12 python3,$(shell command -v $(python))))
NEWEST_TESTS ?= tests
test-newest: out/newest/.ready
	$(TESTING) out/newest/bin/python -m pytest -m "not slow" -n 2 --dist loadfile $(NEWEST_TESTS)

out/newest/.ready: pyproject.toml
	$(NEWEST_PYTHON) -m venv out/newest
	@out/newest/bin/pip install --quiet --disable-pip-version-check --upgrade '.[test,uq,cluster]'
	@touch $@

clean:
	rm -rf $(VENV) out .pytest_cache .ruff_cache
