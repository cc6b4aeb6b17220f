// Decisions on the chosen video: overrides of a range, the speaker among several persons, the text of a word. The server
// saves them; the next run applies them.

import { announce, attempt, button, clock, el, getJson, labelled, options, row, send, sendJson, table } from "./dom.js";

const ACTIONS = { reject: "Reject", accept: "Accept", "swap-hands": "Swap hands", speaker: "Choose the speaker", word: "Correct a word" };
// Number of words around the playhead that can be chosen.
const NEAR_WORDS = 12;
const REST_MS = 200;
// Least time between the range of a decision on a word and the midpoints of its neighbours, seconds.
const WORD_SECS = 0.001;

const numberInput = (attributes) => el("input", { type: "number", step: "any", min: "0", ...attributes });

export class DecisionPanel {
  #word = null; #firstWord = -1;

  // `view` is the dataset view, with the timeline and the clip of the video.
  constructor(video, view) {
    Object.assign(this, { video, view });
    const setRange = () => (view.timeline.range = [this.from.valueAsNumber || 0, this.to.valueAsNumber || video.duration_secs]);
    this.from = numberInput({ onchange: setRange });
    this.to = numberInput({ onchange: setRange });
    const act = (action) => button(ACTIONS[action], () => this.#decide(action, {}));
    this.actions = ["reject", "accept", "swap-hands"].map(act);
    this.x = numberInput({ max: video.width, onchange: () => this.#mark() });
    this.y = numberInput({ max: video.height, onchange: () => this.#mark() });
    const pick = button("Choose the speaker on the video", () => {
      announce("Press the speaker on the video, or enter x and y.");
      view.clip.pick((x, y) => {
        [this.x.value, this.y.value] = [x, y];
        this.#mark();
        announce(`Speaker at ${x}, ${y} px. "Set the speaker" saves it.`);
      });
    });
    const set = button("Set the speaker", () => {
      if (!this.x.value || !this.y.value) return announce("Choose the position of the speaker first: press the video or enter x and y.", true);
      return this.#decide("speaker", { x: this.x.valueAsNumber, y: this.y.valueAsNumber });
    });
    this.words = el("select", { onchange: () => this.showWord(Number(this.words.value)) });
    this.text = el("input", { type: "text", autocomplete: "off" });
    const correct = button("Correct the word", () => this.#correct());
    this.heading = el("h2", { tabindex: "-1" }, "Decisions");
    this.list = el("div", {});
    const note = "Decisions are saved beside the configuration. The next `orator run` applies them; the dataset is unchanged until then.";
    this.element = el("section", { class: "decisions", "aria-label": "Decisions" },
      this.heading, el("p", { class: "note" }, note),
      row(labelled("From, s", this.from), labelled("To, s", this.to), ...this.actions),
      row(pick, labelled("x, px", this.x), labelled("y, px", this.y), set),
      video.words.length ? row(labelled("Word", this.words), labelled("Correct text", this.text), correct) : null,
      this.list);
    this.#drawList();
  }

  #drawList() {
    const { decisions } = this.video;
    const cells = ({ id, action, start_secs: start, end_secs: end, x, y, text, author, time }) => {
      const name = `${ACTIONS[action] ?? action}, ${clock(start)} to ${clock(end)}`;
      const detail = text ?? (action === "speaker" ? `at ${x}, ${y} px` : "");
      return [ACTIONS[action] ?? action, `${clock(start)} to ${clock(end)}`, detail, author, new Date(time).toLocaleString(),
        button("Undo", () => this.#undo(id, name), { "aria-label": `Undo: ${name}` })];
    };
    const heads = ["Decision", "Range", "Detail", "Author", "Time", "Undo"];
    this.list.replaceChildren(decisions.length ? table("Decisions on this video", heads, decisions.map(cells)) : el("p", { class: "note" }, "No decisions on this video."));
  }

  // Reads decisions and words again, and the keypoints, which show the decisions at once; the rest follows the next run.
  async #refresh() {
    const { decisions, words } = await getJson(`./api/videos/${this.video.id}`);
    Object.assign(this.video, { decisions, words });
    this.#firstWord = -1;
    this.#drawList();
    this.view.clip.reload();
    this.view.timeline.refresh();
    await this.view.enter(this.video.id);
  }

  showRange(range) {
    [this.from.value, this.to.value] = range ? range.map((secs) => secs.toFixed(2)) : ["", ""];
    for (const action of this.actions) action.disabled = !range || range[0] === range[1];
  }

  // Offers the words around the playhead once it rests.
  follow(secs) {
    clearTimeout(this.timer);
    const offer = () => {
      const at = Math.max(this.view.timeline.wordAt(secs), 0);
      if (at !== this.#word && ![this.words, this.text].includes(document.activeElement)) this.showWord(at);
    };
    if (!this.view.clip.isPlaying) this.timer = setTimeout(offer, REST_MS);
  }

  showWord(index) {
    const { words } = this.video;
    if (!words[index]) return;
    this.#word = index;
    const first = Math.max(0, index - NEAR_WORDS);
    const near = words.slice(first, index + NEAR_WORDS + 1);
    if (first !== this.#firstWord || !this.words.children.length) {
      this.#firstWord = first;
      this.words.replaceChildren(...options(near.map((_, k) => first + k), (at) => `${clock(words[at][0])} ${words[at][2]}`));
    }
    this.words.value = `${index}`;
    this.text.value = words[index][2];
  }

  #mark() {
    const { x, y } = this;
    this.view.clip.marker = x.value && y.value ? [x.valueAsNumber, y.valueAsNumber] : null;
    this.view.clip.redraw();
  }

  #correct() {
    const word = this.video.words[this.#word];
    const text = this.text.value.trim();
    if (!word || text === word[2]) return announce("Choose a word and enter another text, or none to remove it.", true);
    // The midpoint is in the range, and those of neighbours that overlap the word are not.
    const middle = (at) => (this.video.words[at] ? (this.video.words[at][0] + this.video.words[at][1]) / 2 : null);
    const [before, own, after] = [-1, 0, 1].map((k) => middle(this.#word + k));
    const start = Math.min(Math.max(word[0], (before ?? -1) + WORD_SECS), own);
    const end = Math.max(Math.min(word[1], (after ?? Infinity) - WORD_SECS), own + WORD_SECS);
    return this.#decide("word", { text }, [Math.max(start, 0), end]);
  }

  async #decide(action, detail, range = this.view.timeline.range ?? [0, this.video.duration_secs]) {
    const [start, end] = range;
    const decision = { video: this.video.id, action, start_secs: start, end_secs: end, ...detail };
    await attempt(async () => {
      await sendJson("./api/decisions", decision);
      await this.#refresh();
      announce(`Saved: ${ACTIONS[action]}, ${clock(start)} to ${clock(end)}. The next run applies it.`);
    });
  }

  #undo(id, name) {
    return attempt(async () => {
      await send("DELETE", `./api/decisions/${encodeURIComponent(id)}`);
      await this.#refresh();
      this.heading.focus();
      announce(`Undone: ${name}.`);
    });
  }
}
