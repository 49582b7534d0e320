# Every target sets itself up in .venv; all it needs is Python 3.11 or newer, and make.
.DEFAULT_GOAL := help
.PHONY: help demo real test test-slow lint clean
SHELL := /bin/sh

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
LINT_READY := $(VENV)/.ready-lint
PYTHONS := $(PYTHON) python3 python3.14 python3.13 python3.12 python3.11 python
EXAMPLE := calibration_data/examples/elastomer
PNEUSMA_RECORDINGS ?= $(wildcard ../shared/recordings)
RAW := soft_robotics_materials/Dragon Skin 10 MEDIUM.csv

help:
	@echo "make demo       the main job on simulated data that ships with the package -> out/demo"
	@echo "make real       the main job on real recordings -> out/real"
	@echo "make real-proof other laboratories' recordings, names hidden, diagnosed: one table -> out/real_proof"
	@echo "make proof      blind trial of the diagnosis on 24 sealed campaigns, minutes -> out/proof"
	@echo "make proof-full the same on 814, hours; interrupt it and run it again at will -> out/proof"
	@echo "make test       the tests (warnings are errors)"
	@echo "make test-slow  the long ones, too"
	@echo "make bench      speed of the core: ratios, compile times, memory; half an hour -> out/bench (BENCH=--quick: less)"
	@echo "make lint       style of the code"
	@echo "make clean      remove .venv and out"

$(READY): pyproject.toml constraints.txt
	@python=''; for p in $(PYTHONS); do \
	  if "$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then python="$$p"; break; fi; done; \
	if [ -z "$$python" ]; then \
	  echo "Python 3.11 or newer is needed and none was found; install it, or name it: make PYTHON=/path/to/python3" >&2; \
	  exit 1; fi; \
	if ! [ -x $(BIN)/pip ]; then \
	  "$$python" -m venv $(VENV) || { \
	    echo "$$python cannot make a virtual environment; on Debian and Ubuntu: apt install python3-venv" >&2; \
	    rm -rf $(VENV); exit 1; }; fi
	@echo "Installing into $(VENV) (a few minutes the first time)"
	@$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]'
	@touch $@

$(LINT_READY): $(READY)
	@$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[lint]'
	@touch $@

demo: $(READY)
	@echo "== Simulated data that ship with the package ($(EXAMPLE)); nothing here was measured =="
	$(BIN)/pneusma characterise $(EXAMPLE) --out out/demo/elastomer --force
	$(BIN)/pneusma simulate $(EXAMPLE)/pull_4.csv --material out/demo/elastomer/material.toml --out out/demo/held_out_pull
	$(BIN)/pneusma simulate --design pneuflex_s --pressure-kPa 20 --material out/demo/elastomer/material_actuator.toml
	$(BIN)/pneusma simulate --design pneusma2 --pressure-kPa 30 --xi0-2 0.4
	$(BIN)/pneusma workspace --out out/demo/workspace
	@echo
	@echo "Look at  out/demo/elastomer/report.html       the material, in words, figures and numbers"
	@echo "         out/demo/held_out_pull/model.png     its prediction of a pull that it was not fitted to"
	@echo "         out/demo/workspace/workspace.png     where the three actuators can bend"

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

.PHONY: proof proof-full
proof: $(READY)
	$(PROOF) run --plan fixed $(PROOF_RUN) --workers 2 --baselines
	$(PROOF) figures --plan fixed $(PROOF_RUN)

proof-full: $(READY)
	$(PROOF) run --plan full $(PROOF_RUN) --workers 2 --baselines
	$(PROOF) figures --plan full $(PROOF_RUN)

# two processes fill two cores: no pools of their own (NPROC is that of XLA)
test: $(READY)
	OPENBLAS_NUM_THREADS=1 NPROC=1 $(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile

test-slow: $(READY)
	OPENBLAS_NUM_THREADS=1 NPROC=1 $(BIN)/python -m pytest -n 2 --dist loadfile

# BENCH=--quick stops at 10^5 rows
.PHONY: bench
bench: $(READY)
	$(BIN)/python -m benchmarks.core_speed --out out/bench $(BENCH)

lint: $(LINT_READY)
	$(BIN)/ruff check .

clean:
	rm -rf $(VENV) out .pytest_cache .ruff_cache
