# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
# Front door to the scripts in tools/; each of them does only what is missing.

PRESET ?= release

.DEFAULT_GOAL := help
.PHONY: help setup models build test sanitize demo hil hil-faults soak bench bench-process tick-latency format lint

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## Install packages, Python environment, third-party libraries and models
	@tools/setup

models: setup ## Export ALIKED and DISK too, 7 minutes (docs/models.md)
	@.venv/bin/python tools/export_models.py --models aliked-n16 disk

build: setup ## Build everything (PRESET=release, debug, asan, tsan or traps)
	@cmake --preset $(PRESET)
	@cmake --build build/$(PRESET)

test: setup ## Build and run all tests and checks
	@tools/run-tests

sanitize: setup ## Unit tests under AddressSanitizer and UndefinedBehaviorSanitizer
	@cmake --preset asan
	@cmake --build build/asan --target unit_tests
	@ctest --test-dir build/asan -L unit --output-on-failure

demo: PRESET = release
demo: build ## Simulate, map and localise; with DRIVE=path/to/kitti_0039: a recorded drive
	@.venv/bin/python tools/demo.py $(if $(DRIVE),"$(DRIVE)")

bench-process: PRESET = release
bench-process: build
	@cmake --preset traps
	@cmake --build build/traps --target topoloc-localise

hil: bench-process ## Vehicle process on a virtual CAN bus, in real time (DRIVE=; else the shared drive, or a simulated one)
	@.venv/bin/python tools/hil.py $(if $(DRIVE),--drive "$(DRIVE)")

hil-faults: PRESET = release
hil-faults: hil ## Every kind of fault through the real process on a virtual CAN bus
	@.venv/bin/python tools/hil_faults.py $(if $(DRIVE),--drive "$(DRIVE)")

soak: bench-process ## Vehicle process on a closed drive for an hour: memory, books of all inputs (MINUTES=60)
	@.venv/bin/python tools/soak.py $(if $(DRIVE),--drive "$(DRIVE)") $(if $(MINUTES),--minutes "$(MINUTES)")

bench: PRESET = release
bench: build ## Run the benchmarks
	@build/release/bin/topoloc-bench

tick-latency: PRESET = release
tick-latency: build ## Ten minutes of the estimator thread's ticks beside cyclictest
	@.venv/bin/python tools/tick_latency.py

format: setup ## Format C++ and Python sources in place
	@tools/sources cpp | xargs -0 clang-format -i
	@.venv/bin/ruff format tools tests
	@.venv/bin/ruff check --fix tools tests

lint: build ## Run clang-tidy over all C++ sources, ruff and mypy over all Python
	@tools/lint
