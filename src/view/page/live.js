// Live view: an avatar that performs speech as it arrives.

import { AvatarView } from "./avatar.js";
import { announce, attempt, el, getBytes, labelled, row } from "./dom.js";

// Time without a connection after which the session counts as ended.
const MAX_LOST_MS = 3000;

export class LiveView {
  #latest = null; #isShown = false; #n = 0; #since = 0; #lost = null;

  constructor(panel, { live }) {
    this.live = live;
    this.view = new AvatarView(`Avatar of ${live.name}`);
    this.rate = el("p", { class: "note", id: "live-rate" }, "Waiting for speech …");
    this.own = el("input", { type: "file", accept: ".vrm", onchange: () => attempt(() => this.#loadOwn()) });
    const stage = el("div", { class: "pictures" }, this.view.element);
    panel.append(el("div", { class: "player" }, stage, row(labelled("Your VRM avatar", this.own), this.rate)));
    this.poses = new EventSource("./live/poses");
    this.poses.addEventListener("message", (event) => (this.#latest = JSON.parse(event.data)));
    this.poses.addEventListener("end", () => this.#end());
    this.poses.addEventListener("open", () => (this.#lost = null));
    this.poses.addEventListener("error", () => this.#connectAgain());
  }

  async enter() {
    if (this.#isShown) return;
    this.#isShown = true;
    await attempt(async () => this.view.load(await getBytes("./live/avatar.vrm")));
    requestAnimationFrame(() => this.#draw());
  }

  leave() {}

  // The user's avatar is read in the browser only.
  async #loadOwn() {
    const [file] = this.own.files;
    if (!file) return;
    await this.view.load(await file.arrayBuffer());
    announce(`${file.name} performs the speech.`);
  }

  // The browser tries again by itself; a program that does not answer for a while has ended.
  #connectAgain() {
    this.#lost ??= performance.now();
    this.rate.textContent = "Connecting …";
    if (performance.now() - this.#lost > MAX_LOST_MS) this.#end();
  }

  #end() {
    this.poses.close();
    this.rate.textContent = "The speech has ended.";
    announce("The speech has ended.");
  }

  // Shows the latest pose; the frame rate is that of the browser.
  #draw() {
    const pose = this.#latest;
    if (pose) {
      this.#latest = null;
      this.view.pose(pose, this.live.hips_height);
      this.#n += 1;
      if (performance.now() - this.#since > 1000) {
        this.rate.textContent = `${pose.secs.toFixed(0)} s, ${this.#n} poses per second`;
        [this.#n, this.#since] = [0, performance.now()];
      }
    }
    if (this.poses.readyState !== EventSource.CLOSED) requestAnimationFrame(() => this.#draw());
  }
}
