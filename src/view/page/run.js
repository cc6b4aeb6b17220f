// Run view: stages and failures, live curves of a training, and generated beside true motion.

import { announce, attempt, button, el, getJson, labelled, number, options, poll, row, send, table } from "./dom.js";
import { openPlayer } from "./player.js";

const RUNNING_MS = 2_000;
const IDLE_MS = 10_000;
const MAX_ROWS = 200;
// Key, heading, and whether the curve is one of validations.
const CURVES = [
  ["l1", "L1 loss", false], ["adversarial", "Adversarial loss", false], ["discriminator", "Discriminator loss", false],
  ["score", "Validation score", true], ["pck", "Validation PCK", true],
];
const VALIDATION_KEYS = ["step", "score", "l1", "mean_pose_l1", "pck", "frechet", "energy"];

// Waits for the end of a result; returns it, or throws its message. `isOver()`: nobody waits any more.
export async function finished(id, isOver, onstate) {
  let result = null;
  await poll(async () => {
    result = (await getJson("./api/results")).results.find((one) => one.id === id) ?? null;
    onstate(result?.state ?? "queued");
    return result;
  }, (one) => (["done", "failed"].includes(one?.state) ? null : 1000), isOver);
  if (result?.state === "failed") throw new Error(result.message);
  return result?.state === "done" ? result : null;
}

// A curve of [step, value]; a missing value is a gap.
function drawCurve(canvas, points) {
  const ratio = Math.min(devicePixelRatio, 2);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width) return;
  [canvas.width, canvas.height] = [width * ratio, height * ratio];
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  const style = getComputedStyle(canvas);
  const known = points.filter(([, value]) => value !== null && value !== undefined);
  pen.font = "11px system-ui, sans-serif";
  pen.fillStyle = style.getPropertyValue("--soft");
  if (!known.length) return pen.fillText("no values yet", 8, height / 2);
  const [low, high] = known.reduce(([a, b], [, value]) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
  const last = points.at(-1)[0] || 1;
  const x = (step) => 44 + (step / last) * (width - 54);
  const y = (value) => height - 20 - ((value - low) / (high - low || 1)) * (height - 32);
  for (const value of new Set([low, high])) {
    pen.fillText(String(Number(value.toPrecision(3))), 0, y(value) + 4);
    pen.fillRect(44, y(value), width - 54, 0.5);
  }
  pen.fillText("0", 44, height - 4);
  pen.fillText(`${last}`, width - 10 - pen.measureText(`${last}`).width, height - 4);
  pen.strokeStyle = pen.fillStyle = style.getPropertyValue("--accent");
  pen.lineWidth = 1.8;
  pen.beginPath();
  known.forEach(([step, value], k) => (k ? pen.lineTo(x(step), y(value)) : pen.moveTo(x(step), y(value))));
  pen.stroke();
  const [step, value] = known.at(-1);
  pen.fillRect(x(step) - 2.5, y(value) - 2.5, 5, 5);
}

export class RunView {
  #shown = 0; #name = null;
  #rows = { train: new Map(), validations: new Map() };

  constructor(panel) {
    this.panel = panel;
    const part = () => el("div", {});
    [this.stages, this.progress, this.tables, this.pair] = [part(), part(), part(), part()];
    this.alarms = el("div", { role: "alert" });
    this.select = el("select", { onchange: () => this.#choose(this.select.value) });
    this.canvases = CURVES.map(() => el("canvas", { "aria-hidden": "true" }));
    this.values = CURVES.map(() => el("span", {}));
    const charts = CURVES.map(([, heading], k) => el("figure", { class: "chart" }, el("figcaption", {}, `${heading} `, this.values[k]), this.canvases[k]));
    const compare = button("Show generated beside true motion", () => attempt(() => this.#showPair()));
    this.training = el("div", { hidden: true }, row(labelled("Training", this.select), compare), this.progress, this.alarms,
      this.pair, el("div", { class: "charts" }, ...charts), el("details", {}, el("summary", {}, "Values as tables"), this.tables));
    this.none = el("p", { class: "note" }, "No training yet: run `orator train`.");
    panel.append(el("h2", {}, "Stages"), this.stages, el("h2", {}, "Trainings"), this.none, this.training);
    new ResizeObserver(() => this.#draw()).observe(this.training);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#draw());
  }

  enter() {
    const visit = (this.#shown += 1);
    const msOf = (isRunning) => (isRunning ? RUNNING_MS : IDLE_MS);
    poll(() => this.#refresh(), msOf, () => this.#shown !== visit);
  }

  leave() {
    this.#shown += 1;
    this.player?.pause();
  }

  // Reads the state of everything; returns whether a training is running.
  async #refresh() {
    const [{ stages, failures }, { trainings }] = await Promise.all([getJson("./api/stages"), getJson("./api/trainings")]);
    const counts = stages.map(({ name, done, stale, failed, waiting }) => [name, ...[done, stale, failed, waiting].map(String)]);
    const failed = failures.map(({ video, stage, message }) => [video, stage, message]);
    this.#replace(this.stages, [stages, failures], () => [table("Stages", ["Stage", "Done", "Out of date", "Failed", "Waiting"], counts),
      ...(failed.length ? [el("h3", {}, "Failures"), table("Failures", ["Video", "Stage", "Message"], failed)] : [])]);
    this.none.hidden = trainings.length > 0;
    this.training.hidden = !trainings.length;
    if (!trainings.length) return false;
    const names = trainings.map(({ name }) => name);
    if (names.join() !== [...this.select.options].map(({ value }) => value).join()) this.select.replaceChildren(...options(names));
    this.#name ??= (trainings.find(({ state }) => state === "running") ?? trainings[0]).name;
    this.select.value = this.#name;
    await this.#follow(trainings.find(({ name }) => name === this.#name));
    return trainings.some(({ state }) => state === "running");
  }

  async #choose(name) {
    this.#name = name;
    this.#rows = { train: new Map(), validations: new Map() };
    this.player?.close();
    this.pair.replaceChildren();
    await attempt(() => this.#refresh());
  }

  // Adds the rows since the last validation: a validation may be written after the training row of its step.
  async #follow({ name, state, step, steps, best_step: best, best_score: score }) {
    const known = [...this.#rows.validations.keys()];
    const after = known.length ? `&after=${Math.max(...known)}` : "";
    const reply = await getJson(`./api/training?name=${encodeURIComponent(name)}${after}`);
    if (name !== this.#name) return;
    for (const kind of ["train", "validations"]) for (const one of reply[kind]) this.#rows[kind].set(one.step, one);
    const words = `${state}, step ${step ?? 0}${steps === null ? "" : ` of ${steps}`}${best === null ? "" : `; best: step ${best}, score ${number(score)}`}`;
    this.#replace(this.progress, [words], () => [steps === null ? null : el("progress", { max: `${steps}`, value: `${step ?? 0}`, "aria-label": "Training" }), el("p", {}, words)].filter(Boolean));
    if (this.state && this.state !== state && state === "ended") announce(`The training ${name} has ended.`);
    this.state = state;
    const { alarms } = reply;
    this.#replace(this.alarms, alarms, () => (alarms.length ? [el("ul", { class: "alarms" }, ...alarms.map((one) => el("li", {}, one)))] : []));
    this.#draw();
  }

  // Replaces the content of a part if what it shows has changed.
  #replace(part, shown, create) {
    const key = JSON.stringify(shown);
    if (part.shown === key) return;
    part.shown = key;
    part.replaceChildren(...create());
  }

  #draw() {
    const lists = ["train", "validations"].map((kind) => [...this.#rows[kind].values()].sort((a, b) => a.step - b.step));
    CURVES.forEach(([key, , isValidation], k) => {
      const points = lists[Number(isValidation)].map((one) => [one.step, one[key]]);
      drawCurve(this.canvases[k], points);
      this.values[k].textContent = number(points.at(-1)?.[1]);
    });
    const every = Math.ceil(lists[0].length / MAX_ROWS);
    const train = lists[0].filter((_, k) => k % every === 0 || k === lists[0].length - 1);
    const cells = (list, keys) => list.map((one) => keys.map((key) => number(one[key])));
    const keys = ["step", "l1", "adversarial", "discriminator"];
    this.#replace(this.tables, [train.at(-1), lists[1].at(-1)], () => [
      el("h3", {}, "Validations"), table("Validations", ["Step", "Score", "L1", "L1 of the mean pose", "PCK", "Fréchet distance", "Energy distance"], cells(lists[1], VALIDATION_KEYS)),
      el("h3", {}, "Training losses"), table("Training losses", ["Step", "L1", "Adversarial", "Discriminator"], cells(train, keys))]);
  }

  async #showPair() {
    const name = this.#name;
    const isOver = () => this.#name !== name;
    announce("Generating with the newest checkpoint …");
    const { id } = await send("POST", `./api/pair?name=${encodeURIComponent(name)}`);
    if (!(await finished(id, isOver, () => {}))) return;
    this.player?.close();
    const file = (one) => `./results/${encodeURIComponent(id)}/${one}`;
    this.player = await openPlayer([["Generated", file("generated.glb")], ["True motion", file("truth.glb")]], file("speech.wav"));
    this.pair.replaceChildren(this.player.element);
    announce("Generated and true motion of a validation clip are ready to play.");
    this.player.playButton.focus();
  }
}
