// Intervals of a video: their colours and patterns by reason, the legend, and a table that creates only the visible rows.

import { clock, el, labelled, options } from "./dom.js";

// Reasons for rejection; the order selects colour and pattern.
const REASONS = ["hand not visible", "no person", "close to a cut", "off-screen speaker", "too quiet", "turned away", "jump",
  "too many persons", "no audio", "no speech", "static picture", "person too small", "face not visible", "arms not visible",
  "duplicate hand", "change of person", "too short", "bone length", "missing joints", "duplicate"];
const COLOURS = {
  light: { accepted: "#2f9c8f", reasons: ["#d9713f", "#8a6fc0", "#c25a86", "#b08a1e", "#7d8894", "#c94c4c", "#5b7fc4", "#98633c"] },
  dark: { accepted: "#2f8f84", reasons: ["#d87b4c", "#9a82cf", "#cc6d95", "#bb9936", "#8893a0", "#d66363", "#6f91d1", "#ac7a54"] },
};
// Lines and dots of a pattern in a tile of 8 x 8 px: segments [x0, y0, x1, y1].
const MARKS = [
  [[0, 8, 8, 0], [-1, 1, 1, -1], [7, 9, 9, 7]], [[0, 0, 8, 8], [-1, 7, 1, 9], [7, -1, 9, 1]],
  [[0, 4, 8, 4]], [[4, 0, 4, 8]], [[2, 2, 4, 2], [6, 6, 8, 6]], [[0, 4, 8, 4], [4, 0, 4, 8]],
];
const ROW_PX = 36;
const darkScheme = matchMedia("(prefers-color-scheme: dark)");

export const scheme = () => (darkScheme.matches ? "dark" : "light");
export const onScheme = (action) => darkScheme.addEventListener("change", action);
export const label = (reason) => reason ?? "accepted";

function index(reason) {
  if (!REASONS.includes(reason)) REASONS.push(reason);
  return REASONS.indexOf(reason);
}

export const colour = (reason) => {
  const colours = COLOURS[scheme()];
  return reason === null ? colours.accepted : colours.reasons[index(reason) % colours.reasons.length];
};

const patterns = new Map();

// Fill of an interval: a plain colour if accepted, a pattern by reason if rejected.
export function fill(context, reason) {
  if (reason === null) return colour(null);
  const key = `${scheme()} ${reason}`;
  if (!patterns.has(key)) {
    const tile = el("canvas", { width: "8", height: "8" });
    const pen = tile.getContext("2d");
    pen.fillStyle = colour(reason);
    pen.fillRect(0, 0, 8, 8);
    pen.strokeStyle = scheme() === "dark" ? "#14171a" : "#ffffff";
    pen.lineWidth = 1.6;
    for (const [x0, y0, x1, y1] of MARKS[index(reason) % MARKS.length]) {
      pen.beginPath();
      pen.moveTo(x0, y0);
      pen.lineTo(x1, y1);
      pen.stroke();
    }
    patterns.set(key, context.createPattern(tile, "repeat"));
  }
  return patterns.get(key);
}

// Accepted and rejected intervals sorted by start: {start, end, reason, message}; the reason of an accepted one is null.
export function intervalsOf({ accepted, rejected }) {
  const kept = accepted.map(([start, end]) => ({ start, end, reason: null, message: "" }));
  const dropped = rejected.map(([start, end, reason, message]) => ({ start, end, reason, message }));
  return [...kept, ...dropped].sort((a, b) => a.start - b.start);
}

// Index of the last element that starts at or before `secs`, or -1; `startOf` reads the start of an element.
export function lastBefore(sorted, secs, startOf) {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (startOf(sorted[middle]) <= secs) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

export function legend(intervals) {
  const secs = new Map([[null, 0]]);
  for (const { start, end, reason } of intervals) secs.set(reason, (secs.get(reason) ?? 0) + end - start);
  const entry = ([reason, total]) => {
    const swatch = el("canvas", { width: "28", height: "16", "aria-hidden": "true" });
    const pen = swatch.getContext("2d");
    pen.fillStyle = fill(pen, reason);
    pen.fillRect(0, 0, 28, 16);
    return el("li", {}, swatch, `${label(reason)}, ${clock(total, 0)}`);
  };
  return el("ul", { class: "legend", "aria-label": "Legend" }, ...[...secs].map(entry));
}

// Table of intervals with the keyboard of a grid: arrows, Page Up and Down, Home and End move between rows, Enter chooses.
export class IntervalTable {
  #shown = []; #at = 0;

  constructor(intervals, onchoose) {
    this.intervals = intervals;
    this.onchoose = onchoose;
    const reasons = [...new Set(intervals.map(({ reason }) => reason))].filter((reason) => reason !== null);
    const choices = ["all", "accepted", "rejected", ...reasons.map((reason) => `=${reason}`)];
    const name = (choice) => (choice.startsWith("=") ? label(choice.slice(1)) : choice);
    this.select = el("select", { onchange: () => this.#filter() }, ...options(choices, name));
    this.count = el("span", { class: "note" });
    const heads = ["Start", "End", "Duration", "State", "Message"].map((head) => el("span", { role: "columnheader" }, head));
    const head = el("div", { role: "row", class: "interval head", "aria-rowindex": "1" }, ...heads);
    this.body = el("div", { class: "rows", role: "rowgroup" });
    this.grid = el("div", { role: "grid", class: "intervals", tabindex: "0", "aria-label": "Intervals" },
      el("div", { role: "rowgroup", class: "heads" }, head), this.body);
    this.grid.addEventListener("scroll", () => this.draw(), { passive: true });
    this.grid.addEventListener("keydown", (event) => this.#key(event));
    this.body.addEventListener("click", (event) => {
      const node = event.target.closest("[data-at]");
      if (node) this.#move(Number(node.dataset.at), true);
    });
    this.element = el("div", {}, el("div", { class: "row" }, labelled("Show", this.select), this.count), this.grid);
    this.sizes = new ResizeObserver(() => this.draw());
    this.sizes.observe(this.grid);
    this.#filter();
  }

  close() { this.sizes.disconnect(); }

  #filter() {
    const choice = this.select.value;
    const isShown = ({ reason }) =>
      choice === "all" || (choice === "accepted" ? reason === null : choice === "rejected" ? reason !== null : `=${reason}` === choice);
    this.#shown = this.intervals.filter(isShown);
    this.#at = 0;
    this.count.textContent = `${this.#shown.length} of ${this.intervals.length} intervals`;
    this.grid.setAttribute("aria-rowcount", `${this.#shown.length + 1}`);
    this.body.style.height = `${ROW_PX * this.#shown.length}px`;
    this.grid.style.height = `min(22rem, ${ROW_PX * (this.#shown.length + 2)}px)`;
    this.grid.scrollTop = 0;
    this.draw();
  }

  // Creates the rows at the scroll position, unless they are there.
  draw() {
    const first = Math.max(0, Math.floor(this.grid.scrollTop / ROW_PX) - 2);
    const last = Math.min(this.#shown.length, first + Math.ceil((this.grid.clientHeight || 320) / ROW_PX) + 4);
    const key = `${first} ${last} ${this.#at} ${this.select.value} ${scheme()}`;
    if (key === this.drawn) return;
    this.drawn = key;
    const row = (at) => {
      const { start, end, reason, message } = this.#shown[at];
      const texts = [clock(start), clock(end), `${(end - start).toFixed(1)} s`, label(reason), message];
      const cells = texts.map((text) => el("span", { role: "gridcell" }, text));
      cells[3].style.setProperty("--reason", colour(reason));
      const isAt = at === this.#at;
      const attributes = { role: "row", class: "interval", id: `interval-${at}`, "data-at": `${at}`, "aria-rowindex": `${at + 2}`, "aria-selected": `${isAt}` };
      const node = el("div", attributes, ...cells);
      node.style.top = `${ROW_PX * at}px`;
      return node;
    };
    this.body.replaceChildren(...Array.from({ length: last - first }, (_, k) => row(first + k)));
    const isVisible = first <= this.#at && this.#at < last;
    this.grid.setAttribute("aria-activedescendant", isVisible ? `interval-${this.#at}` : "");
  }

  #key(event) {
    const page = Math.max(1, Math.floor(this.grid.clientHeight / ROW_PX) - 2);
    const last = this.#shown.length - 1;
    const moves = { ArrowDown: this.#at + 1, ArrowUp: this.#at - 1, PageDown: this.#at + page, PageUp: this.#at - page, Home: 0, End: last };
    if (event.key === "Enter") this.#move(this.#at, true);
    else if (event.key in moves) this.#move(Math.min(Math.max(moves[event.key], 0), last), false);
    else return;
    event.preventDefault();
  }

  // Makes a row the current one and scrolls to it.
  #move(at, isChosen) {
    if (!this.#shown[at]) return;
    this.#at = at;
    const [top, room] = [ROW_PX * at, this.grid.clientHeight - 2 * ROW_PX];
    if (top < this.grid.scrollTop) this.grid.scrollTop = top;
    if (top > this.grid.scrollTop + room) this.grid.scrollTop = top - room;
    this.draw();
    if (isChosen) this.onchoose(this.#shown[at]);
  }
}
