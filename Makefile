# Everything sets itself up: a virtual environment in .venv, the package and its tools in it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
WEB := src/pentapod/report/web
# Tests are spread over processes; a numerical library that starts threads of its own would only get in the way.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
# Many tests run the command in a process of its own, which takes longer without compiled files beside the sources.
export PYTHONDONTWRITEBYTECODE :=

# Two processes, each with whole files as far as that goes, so that what a file's tests share is made once.
SPREAD := -n 2 --dist worksteal

# What the tests of `test-lowest` need beside the package, and the tests: arithmetic, kernels, solvers, files, a whole plan.
ORACLES := pytest pytest-xdist hypothesis mpmath rtree pyyaml psutil python-flint
LOWEST_TESTS := tests/numerics tests/geometry tests/kinematics tests/timing tests/program tests/mesh/query/test_swept_depth.py \
	tests/toolpath/inputs/test_drawings.py tests/simulate/test_servo.py tests/job/test_pipeline.py

.PHONY: demo test test-all test-lowest lock lint mutation bench bench-large bench-kinematics bench-timing bench-gouge bench-planning bench-verify bench-view bench-machines bench-batch bench-design bench-control kernels reference pictures page page-check site clean

demo: $(READY)  ## plan a dome and judge the program; kernels are compiled before, on all cores
	$(BIN)/pentapod warm-up
	$(BIN)/pentapod plan toolpaths/dome.toml -o out/

test: $(READY)  ## the fast suite; kernels are compiled before, on all cores
	$(BIN)/pentapod warm-up
	$(BIN)/pytest $(SPREAD) -m "not slow" --durations=25

test-all: $(READY)  ## everything, the long forms too
	$(BIN)/pentapod warm-up
	PENTAPOD_TESTS=all $(BIN)/pytest $(SPREAD)

test-lowest:  ## a part of the fast suite with the lowest versions that pyproject.toml allows, in an environment of its own
	rm -rf out/lowest && $(PYTHON) -m venv out/lowest
	sed -nE 's/^ *"([A-Za-z0-9_.-]+)[>=]=([0-9.]+)".*/\1==\2/p' pyproject.toml | sort -u > out/lowest/constraints.txt
	out/lowest/bin/python -m pip install --quiet --constraint out/lowest/constraints.txt --editable ".[plot,hdf5,drawings,sim]" $(ORACLES)
	out/lowest/bin/python -m pytest -q -m "not slow" $(LOWEST_TESTS)

lock:  ## constraints.txt anew: the newest releases that fit together, with the hashes of their files, from the index that pip uses
	rm -rf out/lock && $(PYTHON) -m venv out/lock
	out/lock/bin/python -m pip install --quiet uv
	sed -n '/^#/p' constraints.txt > out/constraints.txt
	UV_DEFAULT_INDEX="$${PIP_INDEX_URL:-$$(out/lock/bin/python -m pip config get global.index-url 2>/dev/null)}" \
		out/lock/bin/uv pip compile --quiet --universal --python-version 3.11 --extra dev --generate-hashes \
		--no-annotate --no-header pyproject.toml >> out/constraints.txt
	mv out/constraints.txt constraints.txt

lint: $(READY) page-check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/pyright --project benchmarks

page:  ## the script of the report, from its sources; needs npm
	cd $(WEB) && npm ci --ignore-scripts --no-fund --no-audit && npm run build

page-check:  ## is the committed script of the report what its sources give? Where npm is installed
	@if command -v npm >/dev/null; then cd $(WEB) && npm ci --ignore-scripts --no-fund --no-audit && npm run check; \
	else echo "npm is not installed: the script of the report is not built again; a test compares the digest of its sources"; fi

mutation: $(READY)  ## do the tests of the verdict notice changes of it?
	$(BIN)/python benchmarks/mutation.py

bench: $(READY)  ## stage times of whole jobs against the last release (AGAINST=revision), kinematics against Newton
	$(BIN)/python benchmarks/pipeline.py $(if $(AGAINST),--against $(AGAINST))

bench-large: $(READY)  ## a million waypoints, and scans of a million facets and five: seconds and memory, asked and reached
	$(BIN)/python benchmarks/large_jobs.py

bench-kinematics: $(READY)  ## kinematics and proofs against copying arrays and against Newton
	$(BIN)/python benchmarks/kinematics.py

bench-timing: $(READY)  ## time laws against toppra and, where they are installed, others
	$(BIN)/python benchmarks/timing.py

bench-planning: $(READY)  ## the planner's solver against IPOPT
	$(BIN)/python benchmarks/planning.py

bench-gouge: $(READY)  ## contact points and gouge check against another library's drop cutter, rasters against bare sections
	$(BIN)/python benchmarks/gouge.py
	$(BIN)/python benchmarks/drop_cutter.py
	$(BIN)/python benchmarks/drive_surface.py
	$(BIN)/python benchmarks/raster.py

bench-verify: $(READY)  ## the verdict on a million rows: seconds, memory, against numpy.loadtxt and ball arithmetic
	$(BIN)/python benchmarks/verify.py

bench-view: demo  ## how often a second the viewer judges a part that is dragged, against pose by pose
	$(BIN)/python benchmarks/view.py

bench-machines: $(READY)  ## figures of the shipped machines, how well power-on tells modes apart, cost of as-built geometry, error of a first cut
	$(BIN)/python benchmarks/machines.py
	mkdir -p out && $(BIN)/python examples/14_machines.py --out out/machines.png
	$(BIN)/python examples/15_from_crate_to_first_cut.py
	$(BIN)/python examples/16_a_sixth_leg.py --tries 200
	$(BIN)/python examples/17_passive_joints.py --machine spr --seconds 20
	$(BIN)/python examples/17_passive_joints.py --machine prpu --seconds 20
	$(BIN)/python benchmarks/as_built.py
	$(BIN)/python benchmarks/measuring.py

bench-batch: $(READY)  ## many jobs killed at random against a serial run, overhead, workers of another file system
	$(BIN)/python benchmarks/batch.py

bench-design: $(READY)  ## a machine at `desk`'s needs with smaller leg forces, proven, and the dome planned on it
	$(BIN)/python benchmarks/design.py

bench-control: $(READY)  ## module, player and contour correction for LinuxCNC, forces, deflection and compensation: asked and reached, against pentakins and MuJoCo
	$(BIN)/python benchmarks/control.py

kernels: $(READY)  ## the list of kernels that `pentapod warm-up` compiles, from what the fast suite calls
	rm -rf out/kernels && NUMBA_CACHE_DIR=$(CURDIR)/out/kernels $(BIN)/pytest -q $(SPREAD) -m "not slow"
	$(BIN)/python tests/list_kernels.py out/kernels

reference: $(READY)  ## the pages of docs/reference, from the code
	$(BIN)/python docs/make_reference.py

pictures: $(READY)  ## the screenshots of the documentation, from the tests that open a browser
	mkdir -p out/shots
	PENTAPOD_SHOTS=out/shots $(BIN)/pytest tests/report/test_report_in_browser.py tests/report/test_sheet_in_browser.py tests/view/test_viewer_in_browser.py -k "drawn or draws or prints or telephone"
	cp out/shots/report*.png out/shots/sheet.png out/shots/view.png docs/

site: $(READY)  ## the documentation as a site, in site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "pentapod needs Python 3.11 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes --requirement constraints.txt
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@

clean:
	rm -rf $(VENV) out .pytest_cache .ruff_cache .hypothesis
