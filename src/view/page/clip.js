// One video of the dataset: the film with its keypoints, the avatar in sync beside it, and the transport.

import { AvatarView } from "./avatar.js";
import { button, clock, el, getBytes, rateSelect, row } from "./dom.js";
import { lastBefore } from "./intervals.js";

const CHUNK_FRAMES = 300;
const MAX_CHUNKS = 20;
const MIN_SCORE = 0.3;
// Longest motion in one GLB in seconds, and the delay before one is loaded while the position changes.
const MOTION_SECS = 60;
const SETTLE_MS = 200;

export class Clip {
  #chunks = new Map(); #secs = 0; #pointsTimer = null;
  #motion = { start: 0, end: 0, isLoaded: false }; #abort = null; #timer = null; #isPicking = null;

  // `ontime(secs)` follows the position.
  constructor(video, ontime) {
    Object.assign(this, { video, ontime, marker: null });
    this.film = el("video", { playsinline: true, preload: "auto", "aria-label": `Video ${video.file}`, tabindex: "-1" });
    this.overlay = el("canvas", { "aria-hidden": "true" });
    this.overlay.width = video.width || 640;
    this.overlay.height = video.height || 360;
    this.problem = el("p", { class: "over", hidden: true });
    const frame = el("div", { class: "film" }, this.film, this.overlay, this.problem);
    frame.style.setProperty("--ratio", this.overlay.width / this.overlay.height);
    frame.addEventListener("click", (event) => this.#pick(event));
    this.frame = frame;
    this.avatar = new AvatarView(`Avatar of ${video.file}`);
    if (!video.has_motion) this.avatar.say("No lifted motion for this video.");
    this.playButton = button("Play", () => this.toggle(), { class: "main" });
    this.place = el("span", { class: "clock" });
    const points = el("input", { type: "checkbox", checked: true, onchange: () => (this.overlay.hidden = !points.checked) });
    const step = (frames, label, name) => button(label, () => this.step(frames), { "aria-label": name });
    const transport = row(this.playButton, step(-1, "−1", "One frame back"), step(1, "+1", "One frame forward"), this.place,
      rateSelect((rate) => (this.film.playbackRate = rate)), el("label", { class: "field" }, points, el("span", {}, "Keypoints")));
    this.element = el("div", { class: "clip" }, el("div", { class: "pictures" }, frame, this.avatar.element), transport);
    for (const name of ["play", "pause"]) this.film.addEventListener(name, () => this.#changed());
    for (const name of ["seeked", "ended"]) this.film.addEventListener(name, () => this.#update(this.#filmSecs));
    this.film.addEventListener("error", () => this.#fail());
    // A file with sound only in a codec that the browser reads has no picture size.
    this.film.addEventListener("loadedmetadata", () => this.film.videoWidth || this.#fail());
    this.film.src = `./media/${video.id}`;
    // Follows the frames that the browser shows while the film plays.
    const shown = (_now, { mediaTime }) => {
      if (this.isPlaying) this.#update(mediaTime - this.video.first_image_secs);
      this.film.requestVideoFrameCallback(shown);
    };
    this.film.requestVideoFrameCallback(shown);
  }

  // Position in seconds, also of a film that the browser cannot play.
  get time() { return this.#secs; }
  // Times of the page count from the first picture, as those of the ledger.
  get #filmSecs() { return this.film.currentTime - this.video.first_image_secs; }
  get isPlaying() { return !this.film.paused; }

  toggle() {
    if (this.isPlaying) this.film.pause();
    else this.film.play().catch(() => this.film.error && this.#fail());
  }

  step(frames) {
    this.film.pause();
    // The middle of a frame: its edges are rounded differently by browsers.
    const frame = Math.floor(this.time * this.video.fps + 1e-3) + frames;
    this.seek((frame + 0.5) / this.video.fps);
  }

  seek(secs) {
    const time = Math.min(Math.max(secs, 0), this.video.duration_secs);
    if (this.film.readyState > 0) this.film.currentTime = time + this.video.first_image_secs;
    this.#update(time);
  }

  // Calls `action(x, y)` with the next position in px of the video that is pressed; null ends the choice.
  pick(action) {
    this.#isPicking = action;
    this.frame.classList.toggle("picking", Boolean(action));
  }

  close() {
    this.#abort?.abort();
    for (const timer of [this.#timer, this.#pointsTimer]) clearTimeout(timer);
    this.film.pause();
    this.film.removeAttribute("src");
    this.film.load();
    this.avatar.close();
    this.element.remove();
  }

  #fail() {
    this.problem.hidden = false;
    this.problem.textContent = `This browser cannot play ${this.video.file}: it does not support the codec of its video or audio. Timeline, keypoints and avatar still work.`;
  }

  #changed() {
    this.playButton.textContent = this.isPlaying ? "Pause" : "Play";
    this.#update(this.#filmSecs);
  }

  #update(at) {
    const secs = Math.max(at, 0);
    this.#secs = secs;
    this.place.textContent = `${clock(secs, 2)} / ${clock(this.video.duration_secs, 0)}`;
    this.#drawPoints(Math.min(Math.floor(secs * this.video.fps + 1e-3), this.video.n_frames - 1));
    this.#moveAvatar(secs);
    this.ontime(secs);
  }

  redraw() { this.#update(this.time); }

  // Reads the keypoints again, after a decision on the hands.
  reload() {
    this.#chunks.clear();
    this.redraw();
  }

  #pick(event) {
    if (!this.#isPicking) return;
    const box = this.frame.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * this.overlay.width;
    const y = ((event.clientY - box.top) / box.height) * this.overlay.height;
    this.#isPicking(Math.round(x), Math.round(y));
    this.pick(null);
  }

  // Keypoints of a chunk of frames, or undefined before they are loaded: at once while playing, else when the position rests.
  #chunk(at) {
    if (!this.#chunks.has(at) && at * CHUNK_FRAMES < this.video.n_frames) {
      clearTimeout(this.#pointsTimer);
      this.#pointsTimer = setTimeout(() => this.#loadChunk(at), this.isPlaying ? 0 : SETTLE_MS);
    }
    return this.#chunks.get(at);
  }

  async #loadChunk(at) {
    this.#chunks.set(at, undefined);
    if (this.#chunks.size > MAX_CHUNKS) this.#chunks.delete(this.#chunks.keys().next().value);
    const url = `./api/videos/${this.video.id}/keypoints?start=${at * CHUNK_FRAMES}&n=${CHUNK_FRAMES}`;
    // Videos without keypoints have none to draw.
    const bytes = await getBytes(url).catch(() => null);
    if (!bytes) return;
    this.#chunks.set(at, new Float32Array(bytes));
    this.redraw();
  }

  #drawPoints(frame) {
    const pen = this.overlay.getContext("2d");
    pen.clearRect(0, 0, this.overlay.width, this.overlay.height);
    const { n_keypoints: n, edges } = this.video;
    const at = Math.floor(frame / CHUNK_FRAMES);
    const points = this.#chunk(at);
    if (this.isPlaying && frame % CHUNK_FRAMES > CHUNK_FRAMES / 2) this.#chunk(at + 1);
    const size = this.overlay.width / 320;
    const first = (frame - at * CHUNK_FRAMES) * n * 3;
    const read = (k) => points?.subarray(first + 3 * k, first + 3 * k + 3);
    const isVisible = (point) => point?.length === 3 && point[2] >= MIN_SCORE;
    // A dark outline keeps bright lines visible on any picture.
    for (const [width, style] of [[2.6 * size, "#000a"], [1.3 * size, "#5ef0d0"]]) {
      pen.lineWidth = width;
      pen.strokeStyle = style;
      pen.beginPath();
      for (const [a, b] of points ? edges : []) {
        const [from, to] = [read(a), read(b)];
        if (!isVisible(from) || !isVisible(to)) continue;
        pen.moveTo(from[0], from[1]);
        pen.lineTo(to[0], to[1]);
      }
      pen.stroke();
    }
    pen.fillStyle = "#ffd166";
    for (let k = 0; points && k < n; k += 1) {
      const point = read(k);
      if (isVisible(point)) pen.fillRect(point[0] - size, point[1] - size, 2 * size, 2 * size);
    }
    if (!this.marker) return;
    pen.strokeStyle = "#ff4d4d";
    pen.lineWidth = 2 * size;
    pen.beginPath();
    pen.arc(this.marker[0], this.marker[1], 8 * size, 0, 2 * Math.PI);
    pen.stroke();
  }

  // Moves the avatar to a time. Its GLB covers at most a minute of the accepted interval and is loaded once scrubbing pauses.
  #moveAvatar(secs) {
    if (!this.video.has_motion) return;
    const { accepted } = this.video;
    const [start, end] = accepted[lastBefore(accepted, secs, ([from]) => from)] ?? [0, 0];
    if (secs >= end) {
      this.avatar.say("No motion here: this part is rejected.");
      this.avatar.canvas.classList.add("dim");
      return;
    }
    this.avatar.canvas.classList.remove("dim");
    const from = start + Math.floor((secs - start) / MOTION_SECS) * MOTION_SECS;
    if (this.#motion.start === from && this.#motion.end > secs) {
      if (this.#motion.isLoaded) {
        this.avatar.say("");
        this.avatar.time = secs - from;
      }
      return;
    }
    this.#motion = { start: from, end: Math.min(from + MOTION_SECS, end), isLoaded: false };
    this.avatar.say("Loading the motion …");
    this.#abort?.abort();
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#loadMotion(this.#motion), SETTLE_MS);
  }

  async #loadMotion(motion) {
    this.#abort = new AbortController();
    try {
      const times = `start_secs=${motion.start}&end_secs=${motion.end}`;
      await this.avatar.load(await getBytes(`./api/videos/${this.video.id}/avatar.glb?${times}`, this.#abort.signal));
      motion.isLoaded = true;
      if (this.#motion === motion) this.#moveAvatar(this.time);
    } catch (error) {
      if (error.name !== "AbortError") this.avatar.say(error.message);
    }
  }
}
