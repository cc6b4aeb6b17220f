// Dataset view: the list of videos, and the chosen video with its timeline, decisions and intervals.

import { Clip } from "./clip.js";
import { DecisionPanel } from "./decisions.js";
import { announce, attempt, button, clock, el, getBytes, getJson, labelled, options, percent, row } from "./dom.js";
import { IntervalTable, intervalsOf, label, legend, onScheme } from "./intervals.js";
import { Timeline } from "./timeline.js";

const KEYS = [
  ["Space", "play or pause"], ["← →", "one frame"], ["Shift + ← →", "one second"], ["Home End", "start, end"],
  ["[ ]", "start and end of the range"], ["Esc", "no range"], ["+ − 0", "zoom"],
];

export class DatasetView {
  #parts = []; #second = null; #chosen = null;

  constructor(panel, project) {
    Object.assign(this, { panel, project, videos: [] });
    this.list = el("nav", { class: "videos", "aria-label": "Videos" });
    this.detail = el("div", { class: "detail" });
    panel.classList.add("dataset");
    panel.append(this.list, this.detail);
    onScheme(() => this.onscheme?.());
  }

  async enter(id) {
    const reply = await attempt(() => getJson("./api/videos"));
    if (!reply) return;
    this.videos = reply.videos;
    const known = (wanted) => this.videos.find((video) => video.id === wanted);
    const wanted = known(id) ?? known(this.#chosen) ?? this.videos.find(({ state }) => state === "done");
    this.#drawList(wanted?.id);
    if (wanted && wanted.id !== this.#chosen) await this.#openVideo(wanted.id);
    else if (!wanted) this.detail.replaceChildren(el("p", {}, "No video has been processed yet: run `orator run`."));
  }

  leave() {
    this.clip?.film.pause();
    this.#second?.film.pause();
  }

  #drawList(chosen) {
    const item = ({ id, file, speaker, state, message, duration_secs: secs, accepted_secs: accepted, n_decisions: n }) => {
      const share = secs ? accepted / secs : 0;
      const bar = el("progress", { max: "1", value: `${share}`, "aria-hidden": "true" });
      const note = state !== "done" ? state : `${percent(share)} accepted of ${clock(secs ?? 0, 0)}`;
      const link = el("a", { href: `#dataset/${id}`, "aria-current": id === chosen && "true" }, el("b", {}, file),
        el("span", { class: state === "failed" ? "wrong" : "note" }, `${speaker}, ${note}${n ? `, decisions: ${n}` : ""}`),
        state === "done" ? bar : null, message ? el("span", { class: "note" }, message) : null);
      return el("li", {}, link);
    };
    this.list.replaceChildren(el("h2", {}, `Videos (${this.videos.length})`), el("ul", {}, ...this.videos.map(item)));
  }

  async #openVideo(id) {
    this.#chosen = id;
    const replies = await attempt(() =>
      Promise.all([getJson(`./api/videos/${id}`), getBytes(`./api/videos/${id}/wave`).catch(() => new ArrayBuffer(0))]));
    if (this.#chosen !== id) return;
    for (const part of this.#parts) part.close();
    this.#parts = [];
    if (!replies) {
      this.#chosen = null;
      return this.detail.replaceChildren(el("p", {}, `Nothing to show of ${id}.`));
    }
    const [video, wave] = replies;
    if (this.#second?.video.id === id) await this.#openSecond("");
    const intervals = intervalsOf(video);
    this.clip = new Clip(video, (secs) => this.#follow(secs));
    const seek = (secs) => this.clip.seek(secs);
    this.timeline = new Timeline(video, intervals, new Uint8Array(wave), {
      seek,
      play: () => this.#play(),
      step: (frames) => this.clip.step(frames),
      range: (chosen) => this.#showRange(chosen),
      word: (index) => this.decisions?.showWord(index),
    });
    this.state = el("p", { class: "state" });
    this.rangeText = el("span", { class: "note" });
    const table = new IntervalTable(intervals, ({ start, end }) => {
      this.timeline.range = [start, end];
      seek(start);
      announce(`The playhead is at ${clock(start)}; the range is the interval.`);
    });
    this.decisions = this.project.editable ? new DecisionPanel(video, this) : null;
    this.#parts = [this.clip, this.timeline, table];
    const zooms = row(
      button("Zoom in", () => this.timeline.zoom(1 / 2)), button("Zoom out", () => this.timeline.zoom(2)),
      button("Show all", () => this.timeline.showAll()), button("Range starts here", () => this.timeline.setRangeEnd(0)),
      button("Range ends here", () => this.timeline.setRangeEnd(1)), this.rangeText,
    );
    const keys = el("p", { class: "keys note", id: "timeline-keys" }, ...KEYS.flatMap(([key, what]) => [el("span", {}, el("kbd", {}, key), ` ${what}`), "   "]));
    const legends = el("div", {});
    this.onscheme = () => {
      legends.replaceChildren(legend(intervals));
      this.timeline.refresh();
      table.draw();
    };
    this.onscheme();
    this.besides = el("div", { class: "beside" }, this.clip.element);
    this.detail.replaceChildren(
      row(el("h2", {}, video.file), this.#beside(id)), this.besides, this.state, this.timeline.element, keys, zooms, legends,
      ...(this.decisions ? [this.decisions.element] : []), el("h2", {}, "Intervals"), table.element,
    );
    this.timeline.range = null;
    this.clip.redraw();
    if (this.#second) this.besides.append(this.#second.element);
  }

  // Choice of a second video, which is played next to the first one.
  #beside(id) {
    const files = new Map(this.videos.filter((video) => video.id !== id && video.state === "done").map((video) => [video.id, video.file]));
    const choose = el("select", { onchange: () => this.#openSecond(choose.value) },
      ...options(["", ...files.keys()], (other) => files.get(other) ?? "none"));
    choose.value = this.#second?.video.id ?? "";
    return labelled("Second video beside", choose);
  }

  async #openSecond(id) {
    this.#second?.close();
    this.#second = null;
    const video = id && (await attempt(() => getJson(`./api/videos/${id}`)));
    if (!video) return;
    this.#second = new Clip(video, () => {});
    this.#second.film.muted = true;
    this.besides.append(this.#second.element);
    this.#second.redraw();
    announce(`${video.file} is beside, without its sound; space on the timeline plays both.`);
  }

  #play() {
    const isStart = !this.clip.isPlaying;
    for (const clip of [this.clip, this.#second]) if (clip && clip.isPlaying !== isStart) clip.toggle();
  }

  // Shows state, reason and message at the playhead.
  #follow(secs) {
    this.timeline.time = secs;
    this.decisions?.follow(secs);
    const interval = this.timeline.intervalAt(secs);
    const sentence = !interval ? "Between intervals" : interval.reason === null ? "Accepted" : `Rejected: ${interval.message || label(interval.reason)}`;
    if (this.state.textContent !== sentence) this.state.textContent = sentence;
    this.state.classList.toggle("wrong", Boolean(interval?.reason));
  }

  #showRange(range) {
    this.rangeText.textContent = range ? `Range: ${clock(range[0], 2)} to ${clock(range[1], 2)}` : "No range: shift-drag on the timeline sets one";
    this.decisions?.showRange(range);
  }
}
