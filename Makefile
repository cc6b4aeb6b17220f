# make demo    the whole road on a synthetic speaker, from a bare machine to a trained model and its motion
# make test    everything CI runs
# make build   target/release/orator
# Needs: Debian 12 (x86-64), Rust. The rest is installed by `make setup` and `make runtime`.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := build
.PHONY: setup runtime readers browser blender validator build test demo prove prove-rule clean-demo

TARGET := $(or $(CARGO_TARGET_DIR),target)
ORATOR := $(TARGET)/release/orator

PACKAGES := libavformat-dev libavcodec-dev libavutil-dev libswscale-dev libswresample-dev \
	libopencv-core-dev libopencv-imgproc-dev clang pkg-config g++ ffmpeg ca-certificates

# ONNX Runtime (MIT) is inside this wheel; both hashes are checked.
RUNTIME_VERSION := 1.31.1
RUNTIME_WHEEL_SHA256 := 5752bd508126ae7c49894d3b9d2e83f0c3d487319246d04c444b393308d7ad7f
RUNTIME_SHA256 := fc44112fbe06d7d689c57e11d3862031f64711007e4ee020f8eed5185fd2c1d3
RUNTIME := $(TARGET)/lib/libonnxruntime.so.$(RUNTIME_VERSION)

# Asks for root only where something is missing.
define INSTALL
install() { \
	local root=''; [ "$$(id -u)" = 0 ] || root=sudo; \
	command -v apt-get >/dev/null || { echo "no apt-get here: install these by hand: $$*" >&2; exit 1; }; \
	$$root apt-get update -q </dev/null; \
	$$root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "$$@" </dev/null; \
}
endef

setup:
	@$(INSTALL); missing=(); \
	for package in $(PACKAGES); do \
		dpkg-query -W -f '$${Status}' $$package 2>/dev/null | grep -q '^install ok installed$$' || missing+=($$package); \
	done; \
	if [ $${#missing[@]} -gt 0 ]; then echo "setup: installing $${missing[*]}"; install "$${missing[@]}"; fi; \
	command -v cargo >/dev/null || { echo 'setup: no cargo; install Rust 1.89 or newer with rustup' >&2; exit 1; }; \
	for tool in clippy fmt; do \
		cargo $$tool --version >/dev/null 2>&1 || rustup component add clippy rustfmt || true; \
	done; \
	echo 'setup: all there'

runtime: $(RUNTIME)

$(RUNTIME):
	@$(INSTALL); pip=''; \
	find_pip() { for python in python3 /usr/bin/python3; do if $$python -m pip --version >/dev/null 2>&1; then pip="$$python -m pip"; return; fi; done; }; \
	find_pip; [ -n "$$pip" ] || { install python3-pip; hash -r; find_pip; }; \
	[ -n "$$pip" ] || { echo 'runtime: no pip for any python3' >&2; exit 1; }; \
	attempt=$(TARGET)/lib/attempt; rm -rf $$attempt; mkdir -p $$attempt; \
	echo 'onnxruntime==$(RUNTIME_VERSION) --hash=sha256:$(RUNTIME_WHEEL_SHA256)' > $$attempt/requirements.txt; \
	$$pip download --quiet --disable-pip-version-check --no-input --no-deps --require-hashes --only-binary=:all: \
		--platform manylinux_2_28_x86_64 --python-version 3.11 --implementation cp -d $$attempt -r $$attempt/requirements.txt; \
	$${pip% -m pip} -m zipfile -e $$attempt/onnxruntime-*.whl $$attempt; \
	library=$$(ls $$attempt/onnxruntime/capi/libonnxruntime.so* | head -n 1); \
	echo "$(RUNTIME_SHA256)  $$library" | sha256sum --check --quiet; \
	mv $$library $@; touch $@; rm -rf $$attempt; echo "runtime: $@"

# Programs of others that the tests open our files with: Python readers of datasets, and a browser for pages.
export ORATOR_READERS ?= $(abspath $(TARGET)/readers)
READERS := $(ORATOR_READERS)

readers: $(READERS)/.there

$(READERS)/.there: tests/readers.txt
	@$(INSTALL); command -v python3 >/dev/null && python3 -m pip --version >/dev/null 2>&1 || install python3 python3-pip; \
	rm -rf $(READERS); python3 -m pip install --quiet --disable-pip-version-check --no-input --root-user-action ignore \
		--no-warn-conflicts --no-deps --target $(READERS) -r tests/readers.txt; touch $@; echo "readers: $(READERS)"

browser:
	@$(INSTALL); command -v chromium >/dev/null || install chromium; echo "browser: $$(command -v chromium)"

# Blender as a Python module, for the Python it is made for; where that is missing the tests skip, loudly.
export ORATOR_BLENDER ?= $(abspath $(TARGET)/blender)
BLENDER := $(ORATOR_BLENDER)
BLENDER_LIBRARIES := libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libgl1

blender: $(BLENDER)/.there

$(BLENDER)/.there: tests/blender.txt
	@$(INSTALL); python=''; \
	find_python() { for try in python3.11 python3 /usr/bin/python3; do \
		if $$try -c 'import sys, pip; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then python=$$try; return; fi; done; }; \
	find_python; [ -n "$$python" ] || { install python3 python3-pip; hash -r; find_python; }; \
	if [ -z "$$python" ]; then echo 'SKIPPED: no Python 3.11 with pip here, so no Blender: its tests skip' >&2; exit 0; fi; \
	dpkg-query -W $(BLENDER_LIBRARIES) >/dev/null 2>&1 || install $(BLENDER_LIBRARIES); \
	rm -rf $(BLENDER); $$python -m pip install --quiet --disable-pip-version-check --no-input --root-user-action ignore \
		--no-cache-dir --no-warn-conflicts --no-deps --target $(BLENDER) -r tests/blender.txt; touch $@; echo "blender: $(BLENDER)"

# The Khronos glTF validator (Apache-2.0), through npm as it is set up here.
VALIDATOR_VERSION := 2.0.0-dev.3.10
VALIDATOR_SHA256 := 4e03dbdc3bc0d1342afd5d2d7ae341a7e3474502ccb872b02dbbaddaee0fdec6
export ORATOR_GLTF_VALIDATOR ?= $(abspath $(TARGET)/validator)
VALIDATOR := $(ORATOR_GLTF_VALIDATOR)

validator: $(VALIDATOR)/package.json

$(VALIDATOR)/package.json:
	@$(INSTALL); missing=(); for tool in node:nodejs npm:npm; do command -v $${tool%%:*} >/dev/null || missing+=($${tool##*:}); done; \
	[ $${#missing[@]} -eq 0 ] || install "$${missing[@]}"; \
	attempt=$(VALIDATOR).attempt; rm -rf $$attempt $(VALIDATOR); mkdir -p $$attempt; \
	npm pack --silent --pack-destination $$attempt gltf-validator@$(VALIDATOR_VERSION) >/dev/null; \
	echo "$(VALIDATOR_SHA256)  $$attempt/gltf-validator-$(VALIDATOR_VERSION).tgz" | sha256sum --check --quiet; \
	tar -xzf $$attempt/gltf-validator-$(VALIDATOR_VERSION).tgz -C $$attempt; \
	mv $$attempt/package $(VALIDATOR); rm -rf $$attempt; touch $@; echo "validator: $(VALIDATOR)"

build: setup runtime
	cargo build --release --locked

test: build readers browser blender validator
	cargo fmt --check
	cargo clippy --locked --all-targets -- -D warnings
	cargo test --locked
	$(MAKE) demo DEMO=$(TARGET)/demo-test STEPS=30
	@echo 'make test: all passed'

# The long proofs, each printing its figures: 20 kills, a 10-minute video, ten minutes of sound in step with their
# pictures, 20 kills of a training, the dataset beside plain copy, 10 and 100 hours, both
# cores at work, speed on a real clip (CLIP, MODELS), alone and against the Python REFERENCE, training and generation.
# ORATOR_REFERENCE_PYTHON names a Python with onnxruntime, cv2 and numpy (and torch: training beside PyTorch's).
SHARED := ../shared
CLIP := $(SHARED)/data/videos/talk_tyson_2cam_17s_720p.mp4
MODELS := $(SHARED)/models
REFERENCE := $(SHARED)/reference/pose_chain_reference.py
LIFTER_REFERENCE := fixtures/reference/lifter_reference.py
TRAINING_REFERENCE := fixtures/reference/training_reference.py
export ORATOR_REFERENCE_PYTHON ?= python3

prove: build
	ORATOR_KILLS=20 ORATOR_LONG=1 cargo test --release --locked --test it -- --nocapture --test-threads 1 kill:: memory:: sync:: gan
	cargo test --release --locked --test it -- --nocapture --test-threads 1 golden:: pose_parity:: real::
	$(ORATOR) bench lift
	$(ORATOR) bench dataset --dir $(TARGET)
	$(ORATOR) bench scale --dir $(TARGET)
	$(ORATOR) demo draw $(TARGET)/bench-run --videos 2 --secs 20 && $(ORATOR) bench run -c $(TARGET)/bench-run/pipeline.toml
	if [ -e $(CLIP) ]; then $(ORATOR) bench pose2d $(CLIP) --models-dir $(MODELS); else echo 'SKIPPED: $(CLIP) is not there'; fi
	if [ ! -e $(CLIP) ] || [ ! -e $(REFERENCE) ]; then echo 'SKIPPED: $(CLIP) or $(REFERENCE) is not there'; \
	elif ! "$$ORATOR_REFERENCE_PYTHON" -c 'import onnxruntime, cv2, numpy' 2>/dev/null; then \
		echo "SKIPPED: $$ORATOR_REFERENCE_PYTHON has no onnxruntime, cv2 and numpy (ORATOR_REFERENCE_PYTHON names another)"; \
	else $(ORATOR) bench pose2d $(CLIP) --models-dir $(MODELS) --person person-yolox-nano --python $(REFERENCE); fi
	if "$$ORATOR_REFERENCE_PYTHON" -c 'import torch, numpy' 2>/dev/null; then $(ORATOR) bench lifter --python $(LIFTER_REFERENCE); \
		for preset in light paper; do $(ORATOR) bench train --preset $$preset --python $(TRAINING_REFERENCE); done; \
	else echo "SKIPPED: $$ORATOR_REFERENCE_PYTHON has no torch and numpy: no training step beside PyTorch's"; \
		$(ORATOR) bench lifter; for preset in light paper; do $(ORATOR) bench train --preset $$preset; done; fi
	$(ORATOR) bench generate
	$(ORATOR) bench animate
	$(ORATOR) bench evaluate
	$(ORATOR) bench spaces
	$(MAKE) prove-rule

# The synthetic speaker with a known rule: trained on two hours of it, and the same without discriminator.
prove-rule: build
	$(ORATOR) demo speaker $(TARGET)/rule/data --hours 2 --seed 2
	for gan in 0.15 0; do \
		$(ORATOR) train gan -c fixtures/rule.toml --set gan.lambda_gan=$$gan --dataset $(TARGET)/rule/data --out $(TARGET)/rule/gan-$$gan; \
		$(ORATOR) demo learned --dataset $(TARGET)/rule/data --checkpoint $(TARGET)/rule/gan-$$gan --picture $(TARGET)/rule/gan-$$gan.png; \
	done

# The whole road on the synthetic speaker. DEMO: its folder; DRAW and STEPS: how much of it.
DEMO := $(TARGET)/demo
DRAW :=
STEPS := 600

demo: build
	$(ORATOR) demo draw $(DEMO) $(DRAW)
	$(ORATOR) run -c $(DEMO)/pipeline.toml
	$(ORATOR) train gan -c $(DEMO)/pipeline.toml --steps $(STEPS)
	$(ORATOR) generate --checkpoint $(DEMO)/work/gan/host --audio $(DEMO)/speech.wav \
		--out $(DEMO)/motion.npy $(DEMO)/motion.bvh $(DEMO)/motion.glb $(DEMO)/motion.mp4
	$(ORATOR) demo sheet $(DEMO) --motion $(DEMO)/motion.npy --out $(DEMO)/contact_sheet.png
	$(ORATOR) evaluate --dataset $(DEMO)/work/dataset/host --checkpoint $(DEMO)/work/gan/host --split test \
		--report $(DEMO)/evaluation.html
	@echo; $(ORATOR) demo measure $(DEMO)
	@printf '\nmade:\n'; ls -d $(DEMO)/videos/host $(DEMO)/work/dataset/host $(DEMO)/work/gan/host/best.safetensors \
		$(DEMO)/motion.npy $(DEMO)/motion.bvh $(DEMO)/motion.glb $(DEMO)/motion.mp4 $(DEMO)/contact_sheet.png \
		$(DEMO)/evaluation.html

clean-demo:
	rm -rf $(DEMO) $(TARGET)/demo-test
