# make lab    open JupyterLab on the course, in the folder work/
# make check  the inner loop, in a minute: style, types, imports, size, house rules, scripts, quick tests; it says what it leaves out
# make test   install what tests need and run everything
# make test-all  the same, the tests too long for each landing, random examples, contrib/, and nbgrader, installed for its tests
# make test-lowest, make test-newest  quick tests and solution notebooks with the lowest or newest versions that students may install
# make site   build the site into build/site; make site-instructor: the one with answers, into build/site-instructor

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ARGS ?=

.PHONY: lab check test system-packages test-all test-whole test-lowest test-newest site site-instructor notebooks solutions data bench clean

PROJECTS := pyproject.toml labcourse/pyproject.toml

$(VENV)/.pip:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	touch $@

$(VENV)/.lab: $(PROJECTS) | $(VENV)/.pip
	$(BIN)/python -m pip install --quiet --editable "./labcourse[grading]" --editable ".[course]"
	touch $@

# With all that `make lab` needs, so that it is installed once.
$(VENV)/.test: $(PROJECTS) | $(VENV)/.pip
	$(BIN)/python -m pip install --quiet --editable "./labcourse[grading,report,postgres,cluster]" --editable ".[course,test,site]"
	touch $(VENV)/.lab $@

# Beside the environment: in it, nbgrader would put its extensions into every JupyterLab that tests start. All that it
# needs of other packages, for what the test does with it, is in the environment.
$(VENV)/nbgrader: | $(VENV)/.test
	$(BIN)/python -m pip install --quiet --no-deps --target $@ nbgrader==0.9.6 rapidfuzz

$(VENV)/.contrib: contrib/serial/pyproject.toml contrib/rig/pyproject.toml | $(VENV)/.test
	$(BIN)/python -m pip install --quiet --editable "contrib/serial[test]" --editable contrib/rig
	touch $@

lab: $(VENV)/.lab
	$(BIN)/rotflex lab work $(ARGS)

check: $(VENV)/.test
	$(BIN)/python tools/run_tests.py --quick $(ARGS)

test: $(VENV)/.test system-packages
	$(BIN)/python tools/run_tests.py $(ARGS)

system-packages:
	sh tools/system_packages.sh

# A library that came out yesterday must not keep the whole from running: with --keep-going, each is run.
test-all:
	$(MAKE) --keep-going test-lowest test-newest test-whole

test-whole: $(VENV)/.test $(VENV)/nbgrader $(VENV)/.contrib
	sh tools/system_packages.sh --all
	$(BIN)/python tools/run_tests.py --all $(ARGS)

test-lowest: RESOLUTION := lowest-direct
test-newest: RESOLUTION := highest

# The versions of what students install are overrides for all others: tools of the tests, and what instructors pin.
test-lowest test-newest: test-%:
	$(PYTHON) -m venv --clear $(VENV)/$*
	$(VENV)/$*/bin/python -m pip install --quiet uv
	$(VENV)/$*/bin/python -m uv pip compile --quiet --resolution $(RESOLUTION) --extra report \
		labcourse/pyproject.toml pyproject.toml \
		--output-file $(VENV)/$*/versions.txt
	$(VENV)/$*/bin/python -m uv pip install --quiet --override $(VENV)/$*/versions.txt --requirements $(VENV)/$*/versions.txt \
		--editable "./labcourse[grading,report,postgres,cluster]" --editable ".[course,test]"
	$(VENV)/$*/bin/python tools/run_tests.py --versions $(ARGS)

# After a change in solutions/: run them, and derive the student notebooks.
solutions: $(VENV)/.test
	$(BIN)/python tools/run_solutions.py
	$(BIN)/python tools/export_derivation.py
	$(BIN)/rotflex make-notebooks

site: $(VENV)/.test
	$(BIN)/python tools/make_site.py $(ARGS)

site-instructor: $(VENV)/.test
	$(BIN)/python tools/make_site.py --instructor $(ARGS)

notebooks: $(VENV)/.lab
	$(BIN)/rotflex make-notebooks

data: $(VENV)/.lab
	$(BIN)/python tools/make_data.py

bench: $(VENV)/.test
	$(BIN)/python benchmarks/run.py

clean:
	rm -rf $(VENV) build dist work release
