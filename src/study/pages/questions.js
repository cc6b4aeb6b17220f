// Questions: answer controls of a trial, one form per design.

import { el } from "./dom.js";
import { firstText, t } from "./texts.js";

// Keys of the question's text, most specific first.
export function questionKeys(task, phase) {
  if (phase === "attention-check") return ["question.attention-check"];
  return [`question.${task.name}`, `question.${task.scale || task.design}`];
}

// Whether the only film of a trial shows both avatars of a comparison.
export const isSideBySide = (task, trial) => trial.films.length === 1 && task.design !== "turing-single";

// Names of what is compared, left and right: two films, or the halves of one.
export const sideNames = (trial) => (trial.films.length > 1 ? [t("film.left"), t("film.right")] : [t("film.a"), t("film.b")]);

// Creates a question: `node` to show, `enable()` to call after the films were seen, `response()`, which is `null` until
// it is answered.
export function question(task, trial, onchange) {
  const legend = firstText(...questionKeys(task, trial.phase));
  if (trial.phase === "attention-check") return numberQuestion(legend, onchange);
  switch (task.design) {
    case "turing-single": {
      const options = [["true", t("answer.real")], ["false", t("answer.generated")]];
      return choice(legend, "two", options, (value) => ({ real: value === "true" }), onchange);
    }
    case "preference": {
      const options = [-2, -1, 0, 1, 2].map((step, at) => [String(step), t(`answer.step.${at + 1}`)]);
      return choice(legend, "five", options, (value) => ({ step: Number(value) }), onchange);
    }
    default: {
      const [left, right] = sideNames(trial);
      const options = [["left", left], ["right", right]];
      return choice(legend, "two", options, (side) => ({ side }), onchange);
    }
  }
}

// Row of radio buttons, also operated by digit and arrow keys.
function choice(legend, kind, options, responseOf, onchange) {
  const inputs = options.map(([value]) => el("input", { type: "radio", name: "answer", value, onchange }));
  const labels = options.map(([, label], at) =>
    el("label", {}, inputs[at], el("span", { dir: "auto" }, el("kbd", { class: "keys", "aria-hidden": "true" }, `${at + 1}`), label)),
  );
  const choose = (at) => {
    inputs[at].checked = true;
    inputs[at].focus();
    onchange();
  };
  const onkeydown = (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const digit = Number(event.key);
    const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
    if (digit >= 1 && digit <= inputs.length) choose(digit - 1);
    else if (step) {
      const last = inputs.length - 1;
      const chosen = inputs.findIndex((input) => input.checked);
      choose(Math.max(0, Math.min(last, (chosen < 0 ? last / 2 : chosen) + step)));
    } else return;
    event.preventDefault();
  };
  const node = el(
    "fieldset",
    { disabled: true, onkeydown },
    el("legend", {}, legend),
    el("div", { class: `choices ${kind}` }, ...labels),
    el("p", { class: "keys" }, t(kind === "two" ? "keys.two" : "keys.five")),
  );
  return {
    node,
    enable() {
      if (!node.disabled) return;
      node.disabled = false;
      (inputs.find((input) => input.checked) ?? inputs[0]).focus({ preventScroll: true });
    },
    response() {
      const chosen = inputs.find((input) => input.checked);
      return chosen ? responseOf(chosen.value) : null;
    },
  };
}

// Input for the number of an attention check.
function numberQuestion(legend, onchange) {
  const input = el("input", {
    type: "number", id: "number", min: "10", max: "99", step: "1", inputmode: "numeric", autocomplete: "off", required: true,
    oninput: onchange,
  });
  const row = el("p", { class: "row" }, el("label", { for: "number" }, t("answer.number")), input);
  const node = el("fieldset", { disabled: true }, el("legend", {}, legend), row, el("p", { class: "keys" }, t("keys.number")));
  return {
    node,
    enable() {
      if (!node.disabled) return;
      node.disabled = false;
      input.focus({ preventScroll: true });
    },
    response() {
      const number = Number(input.value);
      return Number.isInteger(number) && number >= 10 && number <= 99 ? { number } : null;
    },
  };
}

// Slider from 0 to 100 for the film with this number. `score()` is `null` until the slider was moved.
export function slider(number, onchange) {
  let isMoved = false;
  const output = el("output", {}, "\u2013");
  const note = () => {
    isMoved = true;
    output.textContent = input.value;
    onchange();
  };
  const input = el("input", {
    type: "range", min: "0", max: "100", value: "50", "aria-label": t("answer.score", { n: number }),
    oninput: note,
    // A press or touch also confirms the initial middle value.
    onpointerup: () => !input.disabled && note(),
    onkeydown: (event) => event.key === " " && (event.preventDefault(), note()),
  });
  const words = [1, 2, 3, 4, 5].map((at) => el("span", {}, t(`answer.scale.${at}`)));
  const inner = el("div", { class: "scale" }, el("div", {}, input, output), el("p", { "aria-hidden": "true" }, ...words));
  const node = el("fieldset", { disabled: true }, inner);
  return {
    node,
    enable() {
      if (!node.disabled) return;
      node.disabled = false;
      input.focus({ preventScroll: true });
    },
    score: () => (isMoved ? Number(input.value) : null),
  };
}
