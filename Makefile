# make demo    everything on a synthetic speaker, from a bare machine to a trained model and its motion
# make demo-study   a user study of that speaker: films, server, scripted participants in a browser, analysis
# make check   format, clippy and the quick tests: no root, no other program, a few minutes
# make test    everything CI runs
# make test-data   the tests that the last `make test` skipped, with the real data and the models that ORATOR_DATA names
# make prove   the long proofs and the speeds
# make build   target/release/orator, and orator-lab beside it
# Needs Debian 12 (x86-64) and Rust. The rest is installed by the scripts in .ci/setup.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := build
.PHONY: spelling test-data setup runtime models readers aligner browser blender validator vrm driver loader build check test prove prove-rule prove-people prove-cluster prove-study demo demo-study clean-demo

TARGET := $(or $(CARGO_TARGET_DIR),target)
ORATOR := $(TARGET)/release/orator
LAB := $(TARGET)/release/orator-lab
SKIPPED := $(abspath $(TARGET))/skipped-tests.txt
export ORATOR_SPELLING ?= $(abspath $(TARGET))/spelling
export ORATOR_READERS ?= $(abspath $(TARGET)/readers)
export ORATOR_ALIGNER ?= $(abspath $(TARGET)/aligner)
export ORATOR_MODELS ?= $(abspath $(TARGET)/models)
export ORATOR_BLENDER ?= $(abspath $(TARGET)/blender)
# A text that differs from its snapshot is an error.
export INSTA_UPDATE := no
export ORATOR_GLTF_VALIDATOR ?= $(abspath $(TARGET)/validator)
export ORATOR_VRM ?= $(abspath $(TARGET)/vrm)
export ORATOR_LOADER ?= $(abspath $(TARGET)/loader)
export ORATOR_DRIVER ?= $(abspath $(TARGET)/driver)

setup: ; @.ci/setup/system.sh
runtime: ; @.ci/setup/onnxruntime.sh
readers aligner browser blender validator vrm driver loader spelling: ; @.ci/setup/$@.sh
models: build ; @.ci/setup/models.sh

build: setup runtime
	cargo build --release --locked --workspace

# Integration tests that start no other program, load no ONNX Runtime and end within seconds.
QUICK := house:: wording:: lift:: segment::segment cli::guide cli::completions animate::animate:: animate::bvh animate::motion_files \
	dataset::shard:: dataset::dataset_verify dataset::import_readers evaluate::metrics evaluate::golden_metrics \
	train::networks train::operators robustness::runner

check:
	cargo fmt --check
	cargo clippy --release --locked --workspace --all-targets -- -D warnings
	cargo test --release --locked --workspace --lib --bins
	cargo test --release --locked --test it -- $(QUICK)

test: build models readers aligner browser blender validator vrm driver spelling
	@rm -f $(SKIPPED)
	cargo fmt --check
	$(ORATOR_SPELLING)/bin/typos
	cargo clippy --release --locked --workspace --all-targets -- -D warnings
	cargo test --release --locked --workspace
	$(MAKE) demo DEMO=$(TARGET)/demo-test DRAW= STEPS=30 SPEECH=1
	@if [ -s $(SKIPPED) ]; then echo 'skipped tests:'; sort -u $(SKIPPED); else echo 'no test was skipped'; fi
	@echo 'make test: all passed'

test-data: export ORATOR_MODELS := $(abspath $(TARGET))/models-with-data
test-data: build
	@.ci/setup/models.sh
	@if [ -s $(SKIPPED) ]; then cargo test --release --locked --workspace -- --exact $$(sed 's/: .*//' $(SKIPPED) | sort -u); \
		else echo 'the last `make test` skipped no test'; fi

prove prove-rule prove-people prove-cluster: build models aligner loader
	.ci/$@

# Simulated studies through the analysis: coverage of its intervals, errors of its tests, power.
prove-study:
	cargo test --release --locked --test it -- --ignored --nocapture study::coverage

# The synthetic speaker from its videos to its motion: a rendered person seen by the models for real people, or, where
# they cannot be had, a figure in a suit of markers. A model begins with SPEECH minutes of the same figure without video
# and goes on with what the videos gave; it is judged on videos that it did not see. DEMO: the folder; DRAW and STEPS: how
# much of it.
DEMO := $(TARGET)/demo
DRAW := --videos 6
STEPS :=
SPEECH := 20
# This rule is learnt in fewer steps than the recipe would give it.
SPOKEN_STEPS := 1200

demo: build
	@if $(ORATOR) models fetch --models-dir $(ORATOR_MODELS); then \
		$(LAB) demo draw $(DEMO) --rendered --speech $(SPEECH) $(DRAW) && \
		$(ORATOR) run -c $(DEMO)/pipeline.toml --set models.dir=$(ORATOR_MODELS); \
	else \
		echo 'The models for real people cannot be had (no network, or no npm): the speaker wears a suit of markers.'; \
		$(LAB) demo draw $(DEMO) --speech $(SPEECH) $(DRAW) && $(ORATOR) run -c $(DEMO)/pipeline.toml; \
	fi
	$(ORATOR) train gan --dataset $(DEMO)/speech --out $(DEMO)/work/gan/spoken --steps $(or $(STEPS),$(SPOKEN_STEPS))
	$(ORATOR) train gan -c $(DEMO)/pipeline.toml --from $(DEMO)/work/gan/spoken $(if $(STEPS),--steps $(STEPS))
	$(ORATOR) generate --checkpoint $(DEMO)/work/gan/host --audio $(DEMO)/speech.wav \
		--out $(addprefix $(DEMO)/motion.,npy bvh glb mp4)
	$(LAB) demo sheet $(DEMO) --motion $(DEMO)/motion.npy --out $(DEMO)/contact_sheet.png
	$(ORATOR) evaluate --dataset $(DEMO)/work/dataset/host --checkpoint $(DEMO)/work/gan/host --split test \
		--report $(DEMO)/evaluation.html
	@echo; $(LAB) demo measure $(DEMO)
	@printf '\nfiles:\n'; ls -d $(addprefix $(DEMO)/,videos/host work/dataset/host work/gan/host/best.safetensors \
		motion.npy motion.bvh motion.glb motion.mp4 contact_sheet.png evaluation.html)

# A user study of the synthetic speaker: built, served on this machine, answered in Chromium by scripted participants with
# a known preference, analysed.
STUDY := $(TARGET)/demo-study

demo-study: build browser driver
	ORATOR=$(ORATOR) .ci/demo-study $(STUDY) 8

clean-demo:
	rm -rf $(DEMO) $(STUDY) $(TARGET)/demo-test
