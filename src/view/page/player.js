// Playback of a sound with one avatar or two in sync, and the view of a single file.

import { AvatarView } from "./avatar.js";
import { attempt, button, clock, el, getBytes, rateSelect, row } from "./dom.js";

export class Player {
  // Time of a motion without sound, and the clock that moves it.
  #secs = 0; #before = null;

  // `views`: avatars; `sound`: URL of a sound file, or null.
  constructor(views, sound) {
    this.views = views;
    this.sound = sound ? el("audio", { src: sound, preload: "auto" }) : null;
    this.playButton = button("Play", () => this.toggle(), { class: "main" });
    this.slider = el("input", { type: "range", min: "0", step: "0.01", value: "0", "aria-label": "Position", oninput: () => this.seek(Number(this.slider.value)) });
    this.place = el("span", { class: "clock" });
    this.rate = 1;
    this.element = el("div", { class: "player" }, el("div", { class: "pictures" }, ...views.map((view) => view.element)),
      row(this.playButton, this.slider, this.place, rateSelect((rate) => this.#setRate(rate))));
    this.sound?.addEventListener("loadedmetadata", () => this.draw());
    this.sound?.addEventListener("error", () => (this.place.textContent = "This browser cannot play the sound."));
    this.draw();
  }

  get duration() {
    if (this.#hasSoundClock && Number.isFinite(this.sound.duration)) return this.sound.duration;
    return Math.max(...this.views.map((view) => view.duration));
  }

  // The sound is the clock if it can be played.
  get #hasSoundClock() { return this.sound && !this.sound.error; }
  get time() { return this.#hasSoundClock ? this.sound.currentTime : this.#secs; }
  get isPlaying() { return this.#before !== null; }

  toggle() {
    if (this.isPlaying) return this.pause();
    if (this.time >= this.duration - 0.05) this.seek(0);
    this.#before = performance.now();
    this.playButton.textContent = "Pause";
    if (this.#hasSoundClock) this.sound.play().catch(() => this.pause());
    requestAnimationFrame(() => this.#tick());
  }

  pause() {
    this.#before = null;
    this.playButton.textContent = "Play";
    this.sound?.pause();
  }

  seek(secs) {
    this.#secs = Math.min(Math.max(secs, 0), this.duration);
    if (this.sound) this.sound.currentTime = this.#secs;
    this.draw();
  }

  draw() {
    const { time, duration } = this;
    for (const view of this.views) view.time = time;
    this.slider.max = `${duration}`;
    this.slider.value = `${time}`;
    this.slider.setAttribute("aria-valuetext", `${clock(time)} of ${clock(duration)}`);
    this.place.textContent = `${clock(time)} / ${clock(duration)}`;
  }

  close() {
    this.pause();
    this.sound?.removeAttribute("src");
    for (const view of this.views) view.close();
    this.element.remove();
  }

  #setRate(rate) {
    this.rate = rate;
    if (this.sound) this.sound.playbackRate = rate;
  }

  #tick() {
    if (!this.isPlaying) return;
    const now = performance.now();
    this.#secs = this.#hasSoundClock ? this.sound.currentTime : this.#secs + (this.rate * (now - this.#before)) / 1000;
    this.#before = now;
    this.draw();
    const isOver = this.#hasSoundClock ? this.sound.ended : this.#secs >= this.duration;
    if (isOver) return this.pause();
    requestAnimationFrame(() => this.#tick());
  }
}

// A player of motions: `items` are [caption, URL]; fails if a file cannot be read.
export async function openPlayer(items, sound) {
  const views = items.map(([caption]) => {
    const view = new AvatarView(caption);
    view.element.append(el("p", { class: "caption" }, caption));
    return view;
  });
  try {
    await Promise.all(items.map(async ([, url], k) => views[k].load(await getBytes(url))));
  } catch (error) {
    for (const view of views) view.close();
    throw error;
  }
  return new Player(views, sound);
}

export class FileView {
  constructor(panel, { file }) { Object.assign(this, { panel, file }); }

  async enter() {
    this.player ??= await attempt(() => openPlayer([[this.file.name, "./file"]], this.file.audio ? "./file-audio" : null));
    if (!this.player) return;
    const isStatic = this.player.duration === 0;
    if (isStatic) this.player.element.lastChild.replaceChildren(el("p", { class: "note" }, "This file has no animation."));
    this.panel.replaceChildren(this.player.element);
  }

  leave() { this.player?.pause(); }
}
