// Result view: speech from a file or the microphone becomes motion, which is played, compared and downloaded.

import { announce, attempt, button, el, getBytes, getJson, labelled, options, row, send } from "./dom.js";
import { openPlayer } from "./player.js";
import { finished } from "./run.js";

const MAX_BYTES = 200e6;
const DOWNLOADS = [["motion.bvh", "BVH"], ["motion.glb", "GLB"], ["motion.vrma", "VRMA"], ["motion.mp4", "MP4"]];

// Name of a result.
const caption = ({ name, checkpoint, speaker, step, seed }) =>
  [name, checkpoint, speaker, `step ${step}`, seed === null ? null : `seed ${seed}`].filter((part) => part !== null).join(", ");

export class ResultView {
  #visit = 0; #compared = []; #recorder = null; #open = [];

  constructor(panel) {
    this.checkpoint = el("select", { required: true });
    this.seed = el("input", { type: "number", min: "0", step: "1", placeholder: "none" });
    const input = el("input", { type: "file", accept: "audio/*,video/*", onchange: () => this.#setSound(input.files[0]) });
    this.recordButton = button("Record", () => attempt(() => this.#record()));
    this.sound = el("p", { class: "note" }, "No sound chosen. A sound file can be dropped here.");
    this.preview = el("audio", { controls: true, hidden: true, "aria-label": "Chosen sound" });
    const drop = el("div", { class: "drop" }, row(labelled("Sound file", input), this.recordButton), this.sound, this.preview);
    const over = (event) => {
      event.preventDefault();
      drop.classList.toggle("over-drop", event.type === "dragover");
    };
    for (const name of ["dragover", "dragleave", "drop"]) drop.addEventListener(name, over);
    drop.addEventListener("drop", (event) => this.#setSound(event.dataTransfer.files[0]));
    this.generateButton = button("Generate", () => this.#generate(), { class: "main" });
    this.progress = el("progress", { hidden: true, "aria-label": "Generating" });
    this.avatar = el("input", { type: "file", accept: ".vrm", onchange: () => attempt(() => this.#loadOwn()) });
    const own = row(labelled("Own VRM avatar (stays on this computer)", this.avatar));
    this.stage = el("div", {});
    this.list = el("div", {});
    panel.append(el("h2", {}, "Speech to motion"), row(labelled("Checkpoint", this.checkpoint), labelled("Seed of a variant", this.seed)), drop,
      row(this.generateButton, this.progress), this.stage, own, el("h2", {}, "Results"), this.list);
  }

  async enter() {
    this.#visit += 1;
    const reply = await attempt(() => getJson("./api/checkpoints"));
    const before = this.checkpoint.value;
    const checkpoints = reply?.checkpoints ?? [];
    // A model of several speakers is listed once for each.
    const choices = new Map(checkpoints.flatMap(({ name, step, speakers }) =>
      (speakers.length ? speakers : [null]).map((speaker) => [JSON.stringify([name, speaker]), `${name}${speaker ? `, ${speaker}` : ""}, step ${step}`])));
    this.checkpoint.replaceChildren(...options([...choices.keys()], (choice) => choices.get(choice)));
    if (choices.has(before)) this.checkpoint.value = before;
    if (reply && !checkpoints.length) announce("There is no checkpoint yet: run `orator train`.");
    await this.#refresh();
  }

  leave() {
    this.#visit += 1;
    this.player?.pause();
    this.#recorder?.stop();
  }

  #setSound(file) {
    if (!file) return;
    if (file.size > MAX_BYTES) return announce(`${file.name} is larger than 200 MB.`, true);
    this.file = file;
    this.sound.textContent = `${file.name}, ${Math.max(1, Math.round(file.size / 1000))} kB`;
    URL.revokeObjectURL(this.preview.src);
    this.preview.src = URL.createObjectURL(file);
    this.preview.hidden = false;
    announce(`${file.name} is chosen.`);
  }

  async #record() {
    if (this.#recorder) return this.#recorder.stop();
    if (!navigator.mediaDevices || !window.MediaRecorder) throw new Error("This browser cannot record here. Choose a sound file instead.");
    const stream = await navigator.mediaDevices.getUserMedia({ audio: true }).catch(({ name }) => {
      throw new Error(name === "NotFoundError" ? "No microphone was found. Choose a sound file instead." : "The browser refused the microphone: allow it for this page, or choose a sound file.");
    });
    const parts = [];
    const recorder = new MediaRecorder(stream);
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    recorder.addEventListener("stop", () => {
      for (const track of stream.getTracks()) track.stop();
      this.#recorder = null;
      this.recordButton.textContent = "Record";
      const type = recorder.mimeType.split(";")[0];
      this.#setSound(new File(parts, `recording.${type.split("/")[1]}`, { type }));
    });
    recorder.start();
    this.#recorder = recorder;
    this.recordButton.textContent = "Stop recording";
    announce("Recording. Press the button again to stop.");
  }

  async #generate() {
    if (!this.file) return announce("Choose or record a sound first.", true);
    if (!this.checkpoint.value) return announce("There is no checkpoint yet: run `orator train`.", true);
    this.generateButton.disabled = true;
    this.progress.hidden = false;
    const [checkpoint, speaker] = JSON.parse(this.checkpoint.value);
    const query = new URLSearchParams({ checkpoint, name: this.file.name });
    if (speaker) query.set("speaker", speaker);
    if (this.seed.value) query.set("seed", this.seed.value);
    await attempt(async () => {
      announce("Sending the sound …");
      const { id } = await send("POST", `./api/results?${query}`, this.file);
      await this.#refresh();
      const states = { queued: "Waiting for the other results …", running: "Generating …" };
      const result = await finished(id, () => false, (state) => states[state] && announce(states[state]));
      await this.#refresh();
      if (result) await this.#play([result]);
    });
    this.generateButton.disabled = false;
    this.progress.hidden = true;
    await this.#refresh();
  }

  // Plays one result, or two side by side.
  async #play(results) {
    const url = ({ id }, name) => `./results/${encodeURIComponent(id)}/${name}`;
    const player = await openPlayer(results.map((one) => [caption(one), url(one, "motion.glb")]), url(results[0], results[0].files[0]));
    this.player?.close();
    this.player = player;
    this.#open = results;
    this.stage.replaceChildren(player.element);
    if (this.avatar.files.length) await this.#loadOwn();
    announce(`Ready to play: ${results.map(caption).join(" beside ")}.`);
    player.playButton.focus();
    player.element.scrollIntoView({ block: "nearest" });
  }

  // Shows the open results on the user's VRM avatar, which is read in the browser only.
  async #loadOwn() {
    const [file] = this.avatar.files;
    if (!file || !this.#open.length) return announce("Open a result first; the avatar is then driven by it.");
    for (const [k, { id }] of this.#open.entries()) {
      await this.player.views[k].load(await file.arrayBuffer(), await getBytes(`./results/${encodeURIComponent(id)}/motion.vrma`));
    }
    this.player.draw();
    return announce(`${file.name} performs the result.`);
  }

  async #makeVideo(id) {
    await send("POST", `./api/results/${encodeURIComponent(id)}/video`);
    announce("Rendering the video …");
    const visit = this.#visit;
    for (;;) {
      const found = (await this.#refresh()).find((one) => one.id === id);
      if (!found || found.film === "failed" || this.#visit !== visit) throw new Error(found?.message || "The video is being rendered.");
      if (found.files.includes("motion.mp4")) return announce("The video is ready to download.");
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }

  async #refresh() {
    const { results } = (await attempt(() => getJson("./api/results"))) ?? { results: [] };
    const rows = results.filter(({ files, state }) => state !== "done" || files.includes("motion.glb")).filter(({ files }) => !files.includes("truth.glb")).reverse();
    const focused = document.activeElement?.id;
    this.list.replaceChildren(rows.length ? el("ul", { class: "results" }, ...rows.map((one) => this.#item(one, results))) : el("p", { class: "note" }, "No results yet."));
    if (focused?.startsWith("result-")) document.getElementById(focused)?.focus();
    return results;
  }

  #item(result, results) {
    const { id, name, seed, state, film: filmState, message, files } = result;
    const title = caption(result);
    if (state !== "done") return el("li", {}, el("b", {}, title), el("span", { class: state === "failed" ? "wrong" : "note" }, message ? `${state}: ${message}` : state));
    const box = el("input", { type: "checkbox", id: `result-${id}-compare`, checked: this.#compared.includes(id), onchange: () => this.#compare(id, box.checked, results) });
    const link = ([file, kind]) => files.includes(file) && el("a", { href: `./results/${encodeURIComponent(id)}/${file}`, download: `${name.replace(/\.\w+$/, "")}${seed === null ? "" : `-seed-${seed}`}.${file.split(".").pop()}`, "aria-label": `${kind} of ${title}` }, kind);
    const links = DOWNLOADS.map(link).filter(Boolean);
    const film = files.includes("motion.mp4") || filmState === "queued" ? null : button("Make MP4", () => attempt(() => this.#makeVideo(id)), { id: `result-${id}-mp4`, "aria-label": `Make MP4 of ${title}` });
    return el("li", {}, el("b", {}, title), filmState === "failed" ? el("span", { class: "wrong" }, `no video: ${message}`) : null,
      row(button("Open", () => attempt(() => this.#play([result])), { id: `result-${id}-open`, "aria-label": `Open ${title}` }),
        el("label", { class: "field" }, box, el("span", {}, "Compare")), ...links, film));
  }

  // Plays two results side by side once two are marked.
  #compare(id, isMarked, results) {
    this.#compared = [...this.#compared.filter((other) => other !== id), ...(isMarked ? [id] : [])].slice(-2);
    this.#refresh();
    const chosen = this.#compared.map((one) => results.find((result) => result.id === one)).filter(Boolean);
    if (chosen.length === 2) attempt(() => this.#play(chosen));
    else announce("Mark a second result to compare.");
  }
}
