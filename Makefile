# The front door. Each target installs what it needs; nothing has to be set up before.
#   make demo      align two real scans, print the pose, open the page that shows them in 3D
#   make test      all tests, C++ and Python
#   make help      the rest
SHELL := /bin/bash
VENV ?= .venv
PY := $(VENV)/bin/python
PRESET ?= release
CLI := build/$(PRESET)/vnreg
DEBIAN := cmake ninja-build ccache g++ libeigen3-dev catch2 libcli11-dev nlohmann-json3-dev \
          libbenchmark-dev python3-dev python3-venv doxygen zsh groff-base
FUZZ_DEBIAN := clang-14 libclang-rt-14-dev libomp-14-dev llvm-14
# The viewer's tests: a browser, a font for it, and what joins the page's script.
VIEWER_DEBIAN := chromium fonts-dejavu-core esbuild
# What the wheel of Open3D, a peer of `make evaluate`, links with.
PEERS_DEBIAN := libusb-1.0-0 libgl1 libegl1 libidn2-0
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)

.PHONY: help test-data setup debian-packages build python demo test test-cpp test-python test-isa soak \
        viewer viewer-three viewer-picture \
        check sanitize tsan coverage tidy analyse valgrind stress \
        fuzz fuzzers fuzz-builds fuzz-coverage nightly \
        bench bench-compare batch-kills evaluate gallery train train-paper data \
        paper paper-train paper-recall paper-ablation paper-speed paper-page model docs wheel clean

help: ## this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 18

# Installs what is missing of a list of Debian packages, one list at a time.
define install_debian
	@exec 9< Makefile && flock 9 && \
	missing=$$(dpkg-query -W -f='$${Package} $${db:Status-Abbrev}\n' $(1) 2>&1 \
	  | awk '/no packages found matching/ {print $$NF} $$2 == "un" {print $$1}'); \
	if [ -n "$$missing" ]; then \
	  $(SUDO) apt-get update -q && $(SUDO) apt-get install -y -q --no-install-recommends $$missing; fi
endef

debian-packages:
	$(call install_debian,$(DEBIAN))

$(VENV)/.installed: requirements/dev.txt requirements/demo.txt requirements/train.txt requirements/batch.txt | debian-packages
	python3 -m venv $(VENV)
	$(PY) -m pip install -q -r requirements/dev.txt
	$(PY) -m pip install -q --no-deps -e train_py
	touch $@

setup: debian-packages $(VENV)/.installed ## Debian packages and a virtual environment in .venv

build: debian-packages ## the library and the program, at build/release/vnreg
	cmake --preset $(PRESET) > /dev/null
	cmake --build --preset $(PRESET)

# By the name that cmake gives the compiler in the other builds, so that ccache has the engine already.
python: setup ## the Python module `vnreg`, into .venv
	CXX=c++ $(PY) -m pip install -q --no-build-isolation .

# The demo needs the program alone, and few Python packages.
build/demo-env/.installed: requirements/demo.txt | debian-packages
	python3 -m venv build/demo-env
	build/demo-env/bin/python -m pip install -q -r $<
	touch $@

demo: build/demo-env/.installed ## align two real scans, print the pose, open the page that shows them in 3D
	cmake --preset $(PRESET) > /dev/null
	cmake --build --preset $(PRESET) --target vnreg_cli
	build/demo-env/bin/python examples/demo/demo.py --program $(CLI) --check --open

test: test-cpp test-python ## all tests

test-cpp: build
	ctest --preset $(PRESET) -j2

test-python: python build test-data
	$(call install_debian,$(VIEWER_DEBIAN))
	$(PY) -m pytest -q -m alone tests/python
	$(PY) -m pytest -q -m "not alone" -n auto --maxprocesses 4 --dist worksteal tests/python

test-isa: setup ## the tests that run the engine, on every instruction set of this processor
	@command -v qemu-x86_64 > /dev/null || { $(SUDO) apt-get update -q && \
	  $(SUDO) apt-get install -y -q --no-install-recommends qemu-user; }
	PYTHON=$(abspath $(PY)) tests/isa/run_suites.sh $(abspath build/isa) $(LEVELS)

soak: build ## 100,000 aligns without growth; 1,000 frames at 30 Hz without a missed deadline
	tests/consumers/soak.sh build/$(PRESET) $(abspath build/soak)

batch-kills: python build ## 10,000 pairs of vnreg.batch and of vnreg batch, killed three times and resumed
	VNREG_BATCH_PAIRS=10000 $(PY) -m pytest -q tests/python/batch/test_batch_killed.py -k killed_client
	VNREG_BATCH_PAIRS=10000 $(PY) -m pytest -q -s tests/python/cli/test_cli_batch_killed.py

test-data: setup ## the test split of the furniture models, surfaces only
	$(PY) -m vnreg_train.cli build-data --splits test --no-occupancy

viewer: ## viewer/view.js, the script of the viewer's page, from viewer/src
	$(call install_debian,esbuild)
	viewer/make_view.sh

viewer-three: ## viewer/third_party/three.js from the npm package `three`; needs npm
	$(call install_debian,esbuild)
	viewer/third_party/make_three.sh

viewer-picture: demo setup ## docs/viewer.webp, the demo's pair as the viewer shows it
	$(call install_debian,$(VIEWER_DEBIAN))
	$(PY) viewer/take_picture.py build/demo/aligned_turned.html docs/viewer.webp

check: setup debian-packages ## formatting, lints, types
	$(call install_debian,clang-format-14)
	git ls-files '*.[ch]' '*.[ch]pp' | xargs clang-format-14 --dry-run -Werror
	$(PY) -m ruff check train_py python tests/python tests/soak bench examples docs viewer
	$(PY) -m ruff format --check train_py python tests/python tests/soak bench examples docs viewer
	$(PY) -m mypy train_py/vnreg_train python/vnreg/_batch

# The same build as the fuzz targets'.
sanitize: fuzzers ## the C++ tests under address and undefined-behaviour sanitizers
	cmake --build --preset sanitize
	ctest --preset sanitize -j2

# Of clang, whose OpenMP tells the sanitizer where threads meet (libarcher); GCC's does not.
tsan: debian-packages ## the C++ tests under the thread sanitizer
	$(call install_debian,$(FUZZ_DEBIAN))
	cmake --preset tsan > /dev/null
	cmake --build --preset tsan
	ctest --preset tsan -j2

coverage: debian-packages ## the lines of engine, kernels and model format that the C++ tests cover
	$(call install_debian,$(FUZZ_DEBIAN))
	cmake --preset coverage > /dev/null
	cmake --build --preset coverage
	tests/coverage.sh build/coverage

# Nothing is built for it, precompiled headers neither.
tidy: debian-packages ## clang-tidy over the C++ code
	$(call install_debian,clang-tidy-14 $(FUZZ_DEBIAN))
	cmake --preset fuzz -B build/tidy -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON > /dev/null
	run-clang-tidy-14 -clang-tidy-binary clang-tidy-14 -quiet -p build/tidy \
	  '^$(CURDIR)/(model_format|kernels|engine|cli|viewer|fuzz)/.*\.cpp$$'

analyse: debian-packages ## static analysis of the C++ code by cppcheck
	$(call install_debian,cppcheck)
	cppcheck --quiet --std=c++20 --language=c++ --enable=warning,performance,portability --inline-suppr \
	  --suppressions-list=.cppcheck -I. -Iengine/include -Icli --error-exitcode=1 model_format cli kernels engine viewer fuzz

# The release build: valgrind knows the instructions of x86-64-v3.
valgrind: build ## one pair from files to pose under valgrind, leaks included
	$(call install_debian,valgrind)
	valgrind --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite,indirect,possible \
	  $(CLI) align examples/data/mug_1.xyz examples/data/mug_2.xyz --threads 1 --max-points 128 \
	  > /dev/null || [ $$? -eq 4 ]  # 4: not sure

stress: build ## 8 threads x 10,000 aligns of one model, twice: undisturbed, and in a storm of cancellations
	VNREG_STRESS_ALIGNS=10000 build/$(PRESET)/test_engine "8 threads*,a storm of cancellations*"

SECONDS ?= 60
fuzzers: debian-packages
	$(call install_debian,$(FUZZ_DEBIAN))
	cmake --preset fuzz > /dev/null
	cmake --build --preset fuzz

# What the fuzz target `builds` compares.
fuzz-builds: debian-packages
	cmake --preset fuzz-builds > /dev/null
	cmake --build --preset fuzz-builds

fuzz: fuzzers $(if $(TARGETS),$(filter fuzz-builds,$(TARGETS:%=fuzz-%)),fuzz-builds) ## all fuzz targets for SECONDS=60 each, from their corpora; TARGETS="ply model": only these; JOBS=2: two at a time
	fuzz/run.sh build/fuzz $(SECONDS) $(TARGETS)

fuzz-coverage: debian-packages ## the lines that the corpora of the fuzz targets cover
	$(call install_debian,$(FUZZ_DEBIAN))
	cmake --preset fuzz-coverage > /dev/null
	cmake --build --preset fuzz-coverage
	fuzz/coverage.sh build/fuzz-coverage

# Hours; JOBS fuzz targets at a time.
nightly: SECONDS := 600
nightly: export JOBS := 2
nightly: sanitize tsan tidy analyse valgrind stress coverage fuzz-coverage fuzz ## what continuous integration has no minutes for: all sanitizers, clang-tidy, valgrind, stress, coverage, 10 minutes of each fuzz target

data: setup ## sample the furniture models into data/furniture
	$(PY) -m vnreg_train.cli build-data

train: data ## train models/vnreg.vnr's network from the start (hours); resumes
	$(PY) -m vnreg_train.cli train vnreg

train-paper: data ## train models/small.vnr's network, the paper's, from the start (hours); resumes
	$(PY) -m vnreg_train.cli train $(PAPER_TRAIN) --stage coarse
	$(PY) -m vnreg_train.cli train $(PAPER_TRAIN) --stage fine
	$(PY) -m vnreg_train.cli train $(PAPER_REFINE) --stage fine --initial $(PAPER_TRAINED)/fine.pt

# docs/paper.md, part by part; each resumes, and can be called alone. PAPER_BUDGET=smoke makes all of it
# in minutes, of a network that has learned nothing, into runs/paper-smoke.
PAPER_BUDGET ?= full
ifeq ($(filter full smoke,$(PAPER_BUDGET)),)
$(error PAPER_BUDGET is full or smoke, not $(PAPER_BUDGET))
endif
ifeq ($(PAPER_BUDGET),smoke)
PAPER := runs/paper-smoke
PAPER_TRAIN := smoke --run $(PAPER)/network
PAPER_TRAINED := $(PAPER)/network
PAPER_REFINE := smoke --run $(PAPER)/refined
PAPER_REFINED := $(PAPER)/refined
PAPER_OUT := $(PAPER)/page/paper
PAPER_SHAPES := --shapes 3
PAPER_PAIRS := --split validation $(PAPER_SHAPES)
PAPER_ABLATION := --config smoke
PAPER_ROUNDS := --rounds 1
PAPER_STEPS := --steps 1 --lines 4 5
else
PAPER := runs/paper
PAPER_TRAIN := small
PAPER_TRAINED := runs/small
PAPER_REFINE := refined
PAPER_REFINED := runs/refined
PAPER_OUT := docs/paper
endif
TRAINER := $(PY) -m vnreg_train.cli
paper: paper-train paper-recall paper-ablation paper-speed paper-page ## train the paper's network (hours) and reproduce its tables, into docs/paper.md; resumes; PAPER_BUDGET=smoke: minutes

paper-train: train-paper
	mkdir -p $(PAPER)
	$(TRAINER) export $(PAPER_REFINED)/fine.pt $(PAPER)/small.vnr --name small --keep-divisor 6
	$(TRAINER) export $(PAPER_TRAINED)/fine.pt $(PAPER)/unrefined.vnr --name unrefined
	$(TRAINER) export $(PAPER_REFINED)/fine.pt $(PAPER)/longer.vnr --name longer \
	  --keep-divisor 6 --fine-iterations 16

paper-recall: python data
	$(TRAINER) evaluate --rows p0 --methods coarse paper --paper-model $(PAPER)/small.vnr \
	  --run $(PAPER)/evaluate --jobs 2 $(PAPER_PAIRS)
	$(TRAINER) paper-recall --run $(PAPER)/evaluate --trained $(PAPER_TRAINED) \
	  --refined $(PAPER_REFINED) --out $(PAPER_OUT) $(PAPER_PAIRS)
	$(TRAINER) evaluate --rows 'P0/*/180' --methods paper --run $(PAPER)/longer \
	  --paper-model $(PAPER)/longer.vnr --jobs 2 $(PAPER_PAIRS)
	$(TRAINER) paper-recall --run $(PAPER)/longer --longer $(PAPER)/longer.vnr --out $(PAPER_OUT) $(PAPER_PAIRS)
	$(TRAINER) paper-iterations $(PAPER)/small.vnr --before $(PAPER)/unrefined.vnr --out $(PAPER_OUT) $(PAPER_SHAPES)

paper-ablation: python data
	$(TRAINER) paper-ablation --run $(PAPER)/ablation --out $(PAPER_OUT) $(PAPER_ABLATION) $(PAPER_PAIRS)

paper-speed: python
	$(TRAINER) paper-speed --out $(PAPER_OUT) $(PAPER_ROUNDS)
	$(TRAINER) paper-training-speed --out $(PAPER_OUT) $(PAPER_STEPS)

paper-page: setup
	test -e $(PAPER_OUT)/notes.md || cp docs/paper/notes.md $(PAPER_OUT)
	$(TRAINER) paper-page --out $(PAPER_OUT)

$(VENV)/.peers: requirements/evaluate.txt $(VENV)/.installed
	$(call install_debian,$(PEERS_DEBIAN))
	$(PY) -m pip install -q -r requirements/evaluate.txt
	touch $@

evaluate: python data $(VENV)/.peers ## all modes and peers on the test split, into docs/results.md; resumes
	$(PY) -m vnreg_train.cli evaluate --methods modes peers --run runs/evaluate --jobs 2
	$(PY) -m vnreg_train.cli report --run runs/evaluate
	$(PY) -m vnreg_train.cli paper-page --out docs/paper
	$(PY) docs/page_tables.py

gallery: python data ## the worst pairs of the last `make evaluate` in one page with the viewer, runs/gallery.html
	$(PY) -m vnreg_train.cli gallery --run runs/evaluate -o runs/gallery.html

$(VENV)/.bench: requirements/bench.txt $(VENV)/.peers
	$(PY) -m pip install -q -r requirements/bench.txt
	touch $@

# Figures mean something where nothing else runs: see docs/benchmark.md, "How each part was measured".
BENCH := PYTHONPATH=bench $(PY) -m vnreg_bench
bench: python build $(VENV)/.bench ## times of kernels, engine, peers, runtimes, into docs/benchmark.md; BENCH_ARGS=--quick: minutes
	$(PY) -m vnreg_train.cli build-data --splits validation --no-occupancy
	$(BENCH) run --build build/$(PRESET) $(BENCH_ARGS)
	$(PY) docs/page_tables.py

bench-compare: python ## this tree's benchmarks beside those of BASE=<commit>; fails where one is slower
	@test -n "$(BASE)" || { echo "usage: make bench-compare BASE=<commit>"; exit 2; }
	$(BENCH) compare $(BASE) $(COMPARE_ARGS)

wheel: setup ## the wheel with its three builds, in build/wheel, and its check in a clean environment
	rm -rf build/wheel
	$(PY) -m pip wheel -q --no-build-isolation --no-deps -w build/wheel -C build-dir=build/wheel-build \
	  -C cmake.define.VNREG_HWCAPS=ON -C cmake.define.VNREG_ISA=x86-64-v2 .
	tests/wheel/check_wheel.sh build/wheel/*.whl build/wheel/check

docs: python ## the documentation site, at build/site/index.html
	$(PY) -m mkdocs build -q

clean:
	rm -rf build
