// Timeline of a video on two canvases: every second with its state, resting hands, sound wave, words and strokes; above
// them the playhead and the selected range.

import { clock, el } from "./dom.js";
import { colour, fill, label, lastBefore } from "./intervals.js";

const GUTTER = 50;
const MIN_SPAN = 1;
const WAVE_HZ = 20;
const ZOOM = 1.5;
const TICKS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200];
// Top and height of each band in px.
const BANDS = { time: [0, 18], edits: [22, 10], state: [36, 32], resting: [72, 10], sound: [86, 44], words: [134, 22], left: [160, 14], right: [178, 14] };
const HEIGHT = 194;

export class Timeline {
  #base; #top; #view; #time = 0; #range = null; #isStale = false; #width = 0; #colours = {};

  // `on`: functions seek(secs), play(), step(frames), range([start, end] or null), word(index).
  constructor(video, intervals, wave, on) {
    Object.assign(this, { video, intervals, wave, on });
    this.#view = [0, video.duration_secs];
    this.strokes = Object.groupBy(video.strokes, ([hand]) => hand);
    this.#base = el("canvas", { "aria-hidden": "true" });
    this.#top = el("canvas", {
      class: "top", role: "slider", tabindex: "0", "aria-label": "Position in the video", "aria-valuemin": "0",
      "aria-valuemax": `${video.duration_secs}`, "aria-valuenow": "0", "aria-describedby": "timeline-keys",
    });
    this.element = el("div", { class: "timeline" }, this.#base, this.#top);
    this.element.style.height = `${HEIGHT}px`;
    this.#top.addEventListener("keydown", (event) => this.#key(event));
    this.#top.addEventListener("pointerdown", (event) => this.#press(event));
    this.#top.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    this.sizes = new ResizeObserver(() => this.#resize());
    this.sizes.observe(this.element);
  }

  close() { this.sizes.disconnect(); }

  // Interval at a time, or undefined.
  intervalAt(secs) {
    const interval = this.intervals[lastBefore(this.intervals, secs, ({ start }) => start)];
    return interval && secs < interval.end ? interval : undefined;
  }

  wordAt(secs) { return lastBefore(this.video.words, secs, ([start]) => start); }
  get range() { return this.#range; }

  set range(range) {
    const clamp = (secs) => Math.min(Math.max(secs, 0), this.video.duration_secs);
    this.#range = range && [clamp(Math.min(...range)), clamp(Math.max(...range))];
    this.on.range(this.#range);
    this.#drawTop();
  }

  set time(secs) {
    this.#time = secs;
    const [from, to] = this.#view;
    if (secs < from || secs > to) this.#show(secs - 0.1 * (to - from), to - from);
    const { reason } = this.intervalAt(secs) ?? {};
    this.#top.setAttribute("aria-valuenow", secs.toFixed(2));
    this.#top.setAttribute("aria-valuetext", reason === undefined ? clock(secs) : `${clock(secs)}, ${label(reason)}`);
    this.#drawTop();
  }

  // Shows a shorter (factor below 1) or longer part of the video around the playhead or a time.
  zoom(factor, around = this.#time) {
    const [from, to] = this.#view;
    const span = Math.min(Math.max((to - from) * factor, MIN_SPAN), this.video.duration_secs);
    this.#show(around - ((around - from) * span) / (to - from), span);
  }

  showAll() { this.#show(0, this.video.duration_secs); }

  #show(from, span) {
    const start = Math.min(Math.max(from, 0), Math.max(0, this.video.duration_secs - span));
    this.#view = [start, start + span];
    this.refresh();
  }

  #x(secs) {
    const [from, to] = this.#view;
    return GUTTER + ((secs - from) / (to - from)) * (this.#width - GUTTER);
  }

  #secs(x) {
    const [from, to] = this.#view;
    const secs = from + ((x - GUTTER) / (this.#width - GUTTER)) * (to - from);
    return Math.min(Math.max(secs, 0), this.video.duration_secs);
  }

  #press(event) {
    if (event.button !== 0) return;
    const box = this.#top.getBoundingClientRect();
    const at = (moved) => this.#secs(moved.clientX - box.left);
    const start = at(event);
    if (event.clientY - box.top >= BANDS.words[0] && event.clientY - box.top < BANDS.left[0]) this.on.word(this.wordAt(start));
    const move = event.shiftKey ? (moved) => (this.range = [start, at(moved)]) : (moved) => this.on.seek(at(moved));
    if (!event.shiftKey) move(event);
    this.#top.setPointerCapture(event.pointerId);
    this.#top.addEventListener("pointermove", move);
    const end = () => this.#top.removeEventListener("pointermove", move);
    for (const name of ["pointerup", "pointercancel"]) this.#top.addEventListener(name, end, { once: true });
  }

  #wheel(event) {
    const [from, to] = this.#view;
    const along = event.shiftKey ? event.deltaX || event.deltaY : event.deltaX;
    if (event.ctrlKey) this.zoom(ZOOM ** (event.deltaY / 100), this.#secs(event.offsetX));
    else if (Math.abs(along) > 0) this.#show(from + (along / this.#width) * (to - from), to - from);
    else return;
    event.preventDefault();
  }

  #key(event) {
    // Brackets need AltGr on some keyboards, which some systems report as Ctrl and Alt.
    if ((event.ctrlKey || event.metaKey || event.altKey) && !event.getModifierState("AltGraph")) return;
    const { duration_secs: duration } = this.video;
    const step = (sign) => () => (event.shiftKey ? this.on.seek(this.#time + sign) : this.on.step(sign));
    const actions = {
      " ": () => this.on.play(),
      ArrowRight: step(1), ArrowUp: step(1), ArrowLeft: step(-1), ArrowDown: step(-1),
      PageUp: () => this.on.seek(this.#time + 10), PageDown: () => this.on.seek(this.#time - 10),
      Home: () => this.on.seek(0), End: () => this.on.seek(duration),
      "[": () => this.setRangeEnd(0), "]": () => this.setRangeEnd(1),
      Escape: () => (this.range = null),
      "+": () => this.zoom(1 / ZOOM), "=": () => this.zoom(1 / ZOOM), "-": () => this.zoom(ZOOM), 0: () => this.showAll(),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }

  // Sets the start (0) or end (1) of the range to the playhead.
  setRangeEnd(which) {
    const range = this.#range ?? [this.#time, this.#time];
    range[which] = this.#time;
    if (range[0] > range[1]) range[1 - which] = this.#time;
    this.range = range;
  }

  #resize() {
    this.#width = this.element.clientWidth;
    const ratio = Math.min(devicePixelRatio, 2);
    for (const canvas of [this.#base, this.#top]) {
      canvas.width = this.#width * ratio;
      canvas.height = HEIGHT * ratio;
      canvas.getContext("2d").setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    this.#drawBase();
  }

  refresh() {
    if (this.#isStale) return;
    this.#isStale = true;
    requestAnimationFrame(() => this.#drawBase());
  }

  // Draws the parts of a sorted list that are in view, each at least one px wide; of several within a px, the first one.
  #parts(list, draw, startOf = ([start]) => start, endOf = ([, end]) => end) {
    const [from, to] = this.#view;
    let at = Math.max(0, lastBefore(list, from, startOf));
    while (at < list.length && startOf(list[at]) <= to) {
      const left = Math.max(this.#x(startOf(list[at])), GUTTER);
      const right = Math.min(this.#x(endOf(list[at])), this.#width);
      if (right >= left) draw(list[at], left, Math.max(right - left, 1));
      at = Math.max(at + 1, lastBefore(list, this.#secs(left + 1), startOf));
    }
  }

  #drawBase() {
    this.#isStale = false;
    if (!this.#width) return;
    const pen = this.#base.getContext("2d");
    const style = getComputedStyle(this.element);
    for (const name of ["ink", "soft", "rule", "shade", "left", "right", "accent"]) this.#colours[name] = style.getPropertyValue(`--${name}`);
    pen.clearRect(0, 0, this.#width, HEIGHT);
    pen.font = "11px system-ui, sans-serif";
    pen.textBaseline = "middle";
    for (const [name, [top, height]] of Object.entries(BANDS)) {
      pen.fillStyle = this.#colours.shade;
      if (name !== "time") pen.fillRect(GUTTER, top, this.#width - GUTTER, height);
      pen.fillStyle = this.#colours.soft;
      pen.fillText(name, 0, top + height / 2);
    }
    this.#drawTicks(pen);
    this.#drawStates(pen);
    this.#drawWave(pen);
    this.#drawWords(pen);
    this.#drawStrokes(pen);
    this.#drawTop();
  }

  #drawTicks(pen) {
    const [from, to] = this.#view;
    const step = TICKS.find((secs) => (secs / (to - from)) * (this.#width - GUTTER) > 70) ?? TICKS.at(-1);
    for (let k = Math.ceil(from / step); k * step <= to; k += 1) {
      const x = this.#x(k * step);
      pen.fillStyle = this.#colours.rule;
      pen.fillRect(x, 0, 1, HEIGHT);
      pen.fillStyle = this.#colours.soft;
      if (x < this.#width - 52) pen.fillText(clock(k * step, step < 1 ? 1 : 0), x + 3, 9);
    }
  }

  // More intervals than a third of the px: each column is filled from below by the accepted share of its seconds, and
  // above that by the share of the reason that rejects most of them.
  #drawShares(pen, first, last) {
    const [top, height] = BANDS.state;
    let at = first;
    for (let x = GUTTER; x < this.#width; x += 1) {
      const [from, to] = [this.#secs(x), this.#secs(x + 1)];
      const secs = new Map([[null, 0]]);
      for (let k = at; k < last && this.intervals[k].start < to; k += 1) {
        const { start, end, reason } = this.intervals[k];
        secs.set(reason, (secs.get(reason) ?? 0) + Math.min(end, to) - Math.max(start, from));
        if (end <= to) at = k + 1;
      }
      const pxPerSec = height / (to - from);
      const accepted = pxPerSec * secs.get(null);
      const rejected = [...secs].slice(1).sort((a, b) => b[1] - a[1]);
      const tall = pxPerSec * rejected.reduce((sum, [, one]) => sum + one, 0);
      pen.fillStyle = colour(null);
      pen.fillRect(x, top + height - accepted, 1, accepted);
      if (tall > 0) pen.fillStyle = colour(rejected[0][0]);
      pen.fillRect(x, top + height - accepted - tall, 1, tall);
    }
  }

  #drawStates(pen) {
    const [first, last] = this.#view.map((secs) => Math.max(0, lastBefore(this.intervals, secs, ({ start }) => start)));
    const isDense = 3 * (last - first) > this.#width;
    // Rejected intervals are lower than accepted ones: their state does not depend on the colour alone.
    const drawState = ({ reason }, x, width) => {
      pen.fillStyle = width < 3 ? colour(reason) : fill(pen, reason);
      this.#fillBand(pen, "state", x, width, reason === null ? 0 : 6, 0);
    };
    if (isDense) this.#drawShares(pen, first, last + 1);
    else this.#parts(this.intervals, drawState, ({ start }) => start, ({ end }) => end);
    pen.fillStyle = this.#colours.soft;
    this.#parts(this.video.resting, (_, x, width) => this.#fillBand(pen, "resting", x, width, 2, 2));
    pen.fillStyle = this.#colours.accent;
    const decisions = [...this.video.decisions].sort((a, b) => a.start_secs - b.start_secs);
    const draw = (_, x, width) => this.#fillBand(pen, "edits", x, Math.max(width, 3), 2, 2);
    this.#parts(decisions, draw, ({ start_secs: start }) => start, ({ end_secs: end }) => end);
  }

  // Fills a part of a band, inset at its top and bottom.
  #fillBand(pen, band, x, width, above, below) {
    const [top, height] = BANDS[band];
    pen.fillRect(x, top + above, width, height - above - below);
  }

  #drawWave(pen) {
    const [top, height] = BANDS.sound;
    const [from, to] = this.#view;
    const perPx = ((to - from) / (this.#width - GUTTER)) * WAVE_HZ;
    pen.fillStyle = this.#colours.soft;
    for (let x = 0; x < this.#width - GUTTER; x += 1) {
      const first = Math.floor(from * WAVE_HZ + x * perPx);
      const last = Math.max(first + 1, Math.floor(from * WAVE_HZ + (x + 1) * perPx));
      let peak = 0;
      for (let k = first; k < last && k < this.wave.length; k += 1) peak = Math.max(peak, this.wave[k]);
      const tall = Math.max(1, (peak / 255) * height);
      pen.fillRect(GUTTER + x, top + (height - tall) / 2, 1, tall);
    }
  }

  #drawWords(pen) {
    const [top, height] = BANDS.words;
    this.#parts(this.video.words, ([, , text], x, width) => {
      pen.fillStyle = this.#colours.rule;
      pen.fillRect(x, top, width, height);
      if (width < 12) return;
      pen.save();
      pen.beginPath();
      pen.rect(x, top, width, height);
      pen.clip();
      pen.fillStyle = this.#colours.ink;
      pen.fillText(text, x + 3, top + height / 2);
      pen.restore();
    });
  }

  // Strokes are full, holds half as high, rests and other phases thin.
  #drawStrokes(pen) {
    for (const hand of ["left", "right"]) {
      pen.fillStyle = this.#colours[hand];
      const draw = ([, phase], x, width) => {
        const inset = { stroke: 0, hold: 3.5, rest: 6 }[phase] ?? 5;
        this.#fillBand(pen, hand, x, width, inset, inset);
      };
      this.#parts(this.strokes[hand] ?? [], draw, ([, , start]) => start, ([, , , end]) => end);
    }
  }

  #drawTop() {
    if (!this.#width) return;
    const pen = this.#top.getContext("2d");
    pen.clearRect(0, 0, this.#width, HEIGHT);
    if (this.#range) {
      const [left, right] = this.#range.map((secs) => Math.min(Math.max(this.#x(secs), GUTTER), this.#width));
      pen.fillStyle = this.#colours.accent;
      pen.globalAlpha = 0.18;
      pen.fillRect(left, BANDS.time[1], right - left, HEIGHT);
      pen.globalAlpha = 1;
      for (const x of [left, right]) pen.fillRect(x - 1, BANDS.time[1], 2, HEIGHT);
    }
    const x = this.#x(this.#time);
    if (x < GUTTER) return;
    pen.fillStyle = this.#colours.ink;
    pen.fillRect(x - 1, 0, 2, HEIGHT);
    pen.beginPath();
    pen.moveTo(x - 6, 0);
    pen.lineTo(x + 6, 0);
    pen.lineTo(x, 8);
    pen.fill();
  }
}
