# make demo    the complete pipeline on a synthetic speaker, from a bare machine to a trained model and its motion
# make demo-quick   the steps of the demo in two minutes, with too little video to learn from
# make demo-study   a user study of that speaker: films, server, scripted participants in a browser, analysis
# make docs    the guide as HTML pages in target/docs, with pictures of the demo after `make demo`
# make check   format, clippy and the quick tests: needs neither root nor other programs, takes a few minutes
# make test    everything CI runs
# make test-data   the tests that the last `make test` skipped, with the real data and models in ORATOR_DATA
# make prove   the long-running tests and the benchmarks
# make prove-cuda   the feature `cuda`, for NVIDIA GPUs, without a GPU: build, start, messages; packs what measures it
# make prove-live   ten minutes of `orator live` on one core, received by a program of others
# make build   target/release/orator and target/release/orator-lab
# make dist    a Python wheel and relocatable archives in target/dist, with all libraries and licences
# Requires Debian 12 (x86-64) and Rust. The scripts in .ci/setup install all other dependencies.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := build
.PHONY: cuda spelling test-data setup runtime models readers aligner browser blender validator vrm page web driver loader build dist check test prove prove-dist prove-rule prove-words prove-people prove-cluster prove-cuda prove-live prove-study demo demo-quick demo-study clean-demo docs

TARGET := $(or $(CARGO_TARGET_DIR),target)
ORATOR := $(TARGET)/release/orator
LAB := $(TARGET)/release/orator-lab
SKIPPED := $(abspath $(TARGET))/skipped-tests.txt
export ORATOR_SPELLING ?= $(abspath $(TARGET))/spelling
export ORATOR_READERS ?= $(abspath $(TARGET)/readers)
export ORATOR_ALIGNER ?= $(abspath $(TARGET)/aligner)
export ORATOR_MODELS ?= $(abspath $(TARGET)/models)
export ORATOR_BLENDER ?= $(abspath $(TARGET)/blender)
# A mismatch with a snapshot is an error.
export INSTA_UPDATE := no
export ORATOR_GLTF_VALIDATOR ?= $(abspath $(TARGET)/validator)
export ORATOR_VRM ?= $(abspath $(TARGET)/vrm)
export ORATOR_WEB ?= $(abspath $(TARGET)/web)
export ORATOR_LOADER ?= $(abspath $(TARGET)/loader)
export ORATOR_DRIVER ?= $(abspath $(TARGET)/driver)

setup: ; @.ci/setup/system.sh
runtime: ; @.ci/setup/onnxruntime.sh
readers spelling: ; @.ci/setup/python.sh $@
aligner browser blender cuda validator vrm page web driver loader: ; @.ci/setup/$@.sh
models: build ; @.ci/setup/models.sh

build: setup runtime
	cargo build --release --locked --workspace

dist: build
	.ci/dist

# Integration tests that do not start other programs or load ONNX Runtime and take a few seconds.
QUICK := source_tree:: wording:: vocabulary:: lift:: segment::segment cli::guide cli::completions animate::animate:: animate::bvh animate::motion_files \
	dataset::shard:: dataset::dataset_verify dataset::import_readers evaluate::metrics evaluate::golden_metrics \
	train::networks train::operators robustness::runner

check:
	cargo fmt --check
	cargo clippy --release --locked --workspace --all-targets -- -D warnings
	cargo test --release --locked --workspace --lib --bins
	cargo test --release --locked --test it -- $(QUICK)

test: dist models readers aligner browser blender validator vrm web driver spelling
	@rm -f $(SKIPPED)
	cargo fmt --check
	.ci/setup/page.sh --check
	$(ORATOR_SPELLING)/bin/typos
	cargo clippy --release --locked --workspace --all-targets -- -D warnings
	cargo test --release --locked --workspace
	.ci/prove-dist
	$(MAKE) demo DEMO=$(TARGET)/demo-test DRAW='--videos 4 --fps 15' STEPS=30
	$(LAB) docs $(TARGET)/docs-test --demo $(TARGET)/demo-test
	@if [ -s $(SKIPPED) ]; then echo 'skipped tests:'; sort -u $(SKIPPED); else echo 'no test was skipped'; fi
	@echo 'make test: all passed'

test-data: export ORATOR_MODELS := $(abspath $(TARGET))/models-with-data
test-data: build
	@.ci/setup/models.sh
	@if [ -s $(SKIPPED) ]; then cargo test --release --locked --workspace -- --exact $$(sed 's/: .*//' $(SKIPPED) | sort -u); \
		else echo 'the last `make test` skipped no test'; fi

prove prove-rule prove-words prove-people prove-cluster: build models aligner loader
	.ci/$@

prove-cuda: build
	.ci/$@

prove prove-live: readers
prove-live: build
	.ci/$@

prove: prove-dist

# The wheel and the archives in bare Debian 12 and 13, and a second build. Requires root.
prove-dist: dist
	.ci/prove-dist --full

# The study analysis on simulated studies: coverage of the intervals, error rates of the tests, power.
prove-study:
	cargo test --release --locked --test it -- --ignored --nocapture study::coverage

# The synthetic speaker from videos to generated motion: a rendered person with the models for real people, or, if these
# are not available, a drawn figure in a marker suit. The model is trained on the dataset of the videos and evaluated on
# held-out videos; it must follow the rule of the gestures. DEMO: output folder; DRAW: amount of video; STEPS: number of
# training steps instead of that of the configuration, without the check of the rule.
DEMO := $(TARGET)/demo
DRAW := --videos 20 --secs 30 --fps 15
STEPS :=
RUN = $(ORATOR) run -c $(DEMO)/pipeline.toml --train $(if $(STEPS),--set gan.steps=$(STEPS))

demo: build
	@if $(ORATOR) models fetch --models-dir $(ORATOR_MODELS); then \
		$(LAB) demo draw $(DEMO) --rendered $(DRAW) && $(RUN) --set models.dir=$(ORATOR_MODELS); \
	else \
		echo 'No models for real persons are available (no network, or no npm): the speaker wears a suit of markers.'; \
		$(LAB) demo draw $(DEMO) $(DRAW) && $(RUN); \
	fi
	$(ORATOR) generate --checkpoint $(DEMO)/work/gan/host --audio $(DEMO)/speech.wav \
		--out $(addprefix $(DEMO)/motion.,npy bvh glb mp4)
	$(LAB) demo sheet $(DEMO) --motion $(DEMO)/motion.npy --out $(DEMO)/contact_sheet.png
	@echo; $(LAB) demo measure $(DEMO)
	@if [ -z '$(STEPS)' ] && [ -e $(DEMO)/truth/clip-1.json ]; then echo; $(LAB) demo learned \
		--dataset $(DEMO)/work/dataset/host --truth $(DEMO)/truth --checkpoint $(DEMO)/work/gan/host; fi
	@printf '\nopen these files:\n'
	@printf '  %s  %s\n' $(DEMO)/work/gan/host/result.html 'generated beside true motion of a held-out video, with conclusions' \
		$(DEMO)/motion.mp4 'motion for speech that no video has' \
		$(DEMO)/contact_sheet.png 'frames, keypoints, joints and generated motion'

# The steps of the demo on one minute of video, which is too little to learn from.
demo-quick:
	@$(MAKE) --no-print-directory demo DEMO=$(TARGET)/demo-quick DRAW='--videos 4 --secs 15 --fps 15' STEPS=30

# A user study of the synthetic speaker: built, served on this machine, answered in Chromium by scripted participants
# with a known preference, and analysed.
STUDY := $(TARGET)/demo-study

demo-study: build browser driver
	ORATOR=$(ORATOR) .ci/demo-study $(STUDY) 8

# The guide as pages that open from the folder; the pictures of its gallery need a complete demo.
DOCS := $(TARGET)/docs

docs: build
	$(LAB) docs $(DOCS) $(if $(wildcard $(DEMO)/contact_sheet.png),--demo $(DEMO))

clean-demo:
	rm -rf $(DEMO) $(STUDY) $(TARGET)/demo-test $(TARGET)/demo-quick $(TARGET)/docs-test
