# Everything here works on a fresh machine: it makes a virtual environment in
# .venv, installs what is needed from PyPI and Debian, and builds.

VENV := .venv
BIN := $(VENV)/bin
JOBS ?= 2
CPP_FILES = $(shell git ls-files '*.h' '*.cc')
READY := $(VENV)/.ready
FRANKA_SIM := $(VENV)/franka-sim/.ready
# Of `dual-proxy bench`; `peer` needs the extra `bench`.
SUBJECTS := engine control link plant cycle savings filter

# Tests of processes in real time, one after the other.
REAL_TIME := tests/drivers tests/fci tests/hardware tests/link

.PHONY: demo test hardware-test build lint format stubs figures bench \
  bench-filter-speed stress sanitize fuzz clean

demo: build  ## Run scene `plane` and write its report to out/demo
	$(BIN)/dual-proxy run plane --delay 0.05 --out out/demo

test: build $(FRANKA_SIM)  ## Run every test, C++ and Python
	$(BIN)/ctest --test-dir build --output-on-failure -j $(JOBS)
	$(BIN)/python -m pytest -n $(JOBS) $(REAL_TIME:%=--ignore=%)
	$(BIN)/python -m pytest $(REAL_TIME)
	@if $(BIN)/python -c \
	  'import dual_proxy as dp; raise SystemExit(not dp.native_available())'; then \
	  echo 'Once more with the LeafSystems in Python' && \
	  DUAL_PROXY_FACES=python $(BIN)/python -m pytest -n $(JOBS); fi

hardware-test: build $(FRANKA_SIM)  ## A minute of contact by the hardware's protocols
	$(BIN)/python -m pytest -s -m hardware tests/fci

build: $(READY)  ## Build and install into .venv, with the C++ tests
	CMAKE_BUILD_PARALLEL_LEVEL=$(JOBS) $(BIN)/pip install --quiet \
	  --no-build-isolation --no-deps -Cbuild-dir=build \
	  -Ccmake.define.DUAL_PROXY_BUILD_TESTS=ON $(WARNINGS) .
	@ln -sf build/compile_commands.json compile_commands.json  # For editors.

$(READY): pyproject.toml constraints.txt
	cmake/install_debian_packages
	python3 -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/python cmake/list_requirements.py > $(VENV)/requirements.txt
	$(BIN)/pip install --quiet -c constraints.txt -r $(VENV)/requirements.txt
	touch $@

$(FRANKA_SIM): tests/fci/requirements.txt cmake/install_franka_sim $(READY)
	cmake/install_franka_sim $(VENV)

# From then on warnings are errors in this build folder, for `make test` as well.
lint: WARNINGS := -Ccmake.define.CMAKE_COMPILE_WARNING_AS_ERROR=ON
lint: build  ## Check warnings, formatting, style, types and stubs; change nothing
	@echo clang-format
	@$(BIN)/clang-format --dry-run --Werror $(CPP_FILES)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python cmake/generate_stubs.py --check plugin/dual_proxy/_core.pyi
	$(BIN)/python cmake/generate_reference_page.py --check docs/reference.md

format: $(READY)  ## Format C++ and Python in place
	$(BIN)/clang-format -i $(CPP_FILES)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

stubs: build  ## Regenerate _core.pyi and docs/reference.md from the bindings
	$(BIN)/python cmake/generate_stubs.py plugin/dual_proxy/_core.pyi
	$(BIN)/python cmake/generate_reference_page.py docs/reference.md

figures: build  ## Print the tables of README and docs, draw the README's picture
	$(BIN)/python benchmarks/plane.py docs/images/plane.png
	$(BIN)/dual-proxy compare plane --schemes dual_proxy,position_force \
	  --delays 0,0.05,0.15,0.35,1.5
	$(BIN)/python benchmarks/comparison.py --page docs/comparison.md \
	  --picture docs/images/comparison.png
	$(BIN)/dual-proxy reproduce --engine bare --page docs/reproduction.md
	$(BIN)/python benchmarks/law.py --page docs/notes_on_the_paper.md
	$(BIN)/python benchmarks/loop_cost.py --page docs/benchmarks.md
	for subject in $(SUBJECTS); do \
	  $(BIN)/dual-proxy bench $$subject --page docs/benchmarks.md || exit; done
	$(BIN)/python benchmarks/filter_rates.py --page docs/benchmarks.md
	$(BIN)/python benchmarks/filter_choices.py --page docs/filter.md

bench: build  ## Run time against error: all of `dual-proxy bench` but `peer`
	for subject in $(SUBJECTS); do \
	  $(BIN)/dual-proxy bench $$subject || exit; done

stress: build  ## 3000 hard runs, a day, maps of stability
	$(BIN)/dual-proxy stress

# Without Drake and Python, whose binaries are not instrumented.
CONFIGURE_INSTRUMENTED = env -u DRAKE_INCLUDE_DIR $(BIN)/cmake -S . -G Ninja \
  -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN))/ninja --log-level=WARNING \
  -DPython_EXECUTABLE=$(abspath $(BIN))/python \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O1 \
  -DDUAL_PROXY_BUILD_PYTHON=OFF

sanitize: $(READY)  ## Run the C++ tests under address, undefined and thread sanitizers
	@set -e; for checks in address,undefined thread; do \
	  echo "-fsanitize=$$checks"; \
	  folder=build/sanitize-$${checks%%,*}; \
	  $(CONFIGURE_INSTRUMENTED) -B $$folder -DDUAL_PROXY_SANITIZE=$$checks; \
	  $(BIN)/cmake --build $$folder -j $(JOBS); \
	  $(BIN)/ctest --test-dir $$folder --output-on-failure -j $(JOBS) -LE install; \
	done

SECONDS ?= 60
# Of `undefined` what costs little: checks of each pointer, of which Eigen has many,
# make a fuzzer fifteen times slower. `make sanitize` has all.
FUZZ_CHECKS := address,bool,bounds,enum,float-cast-overflow,fuzzer-no-link
FUZZ_CHECKS := $(FUZZ_CHECKS),integer-divide-by-zero,return,shift
FUZZ_CHECKS := $(FUZZ_CHECKS),signed-integer-overflow,unreachable

fuzz: build  ## Look for inputs that break something, SECONDS for each kind
	cmake/install_debian_packages fuzz
	@$(CONFIGURE_INSTRUMENTED) -B build/fuzz -DCMAKE_CXX_COMPILER=clang++-19 \
	  -DCMAKE_CXX_FLAGS_DEBUG=-O2 \
	  -DDUAL_PROXY_SANITIZE=$(FUZZ_CHECKS)
	$(BIN)/cmake --build build/fuzz -j $(JOBS) --target fuzzers
	$(BIN)/python tests/fuzz/run_fuzzers.py build/fuzz --seconds $(SECONDS)

bench-filter-speed: build  ## Time the particle filter, beside a textbook's
	$(BIN)/python benchmarks/filter_speed.py --page docs/benchmarks.md

clean:
	rm -rf build out
