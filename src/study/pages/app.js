// Steps of a session: consent, instructions, sound check, trials, completion.

import { backend, ServerError, withRetries } from "./backend.js";
import { announce, button, byId, el, paragraphs, show } from "./dom.js";
import { forget, keep, recall, takeLinkedToken } from "./memory.js";
import { checkSound } from "./sound.js";
import { currentLanguage, firstText, has, nameOfLanguage, preferredLanguage, t, useLanguage, useTexts } from "./texts.js";
import { runTrial } from "./trial.js";

let study = null;
// Index of the task whose instructions were shown last since the page was loaded.
let instructed = null;

const text = (words) => el("div", { class: "text" }, ...paragraphs(words));
const row = (...nodes) => el("p", { class: "row" }, ...nodes);
const onWait = (secs) => announce(t("answer.offline", { seconds: Math.round(secs) }));

// Shows a step with one button and resolves when it is pressed.
function step(heading, nodes, label) {
  return new Promise((resolve) => show(heading, [...nodes, row(button(label, resolve))]));
}

async function start() {
  show("\u2026", []);
  try {
    study = await backend.study();
  } catch {
    // The texts are part of the study, so this message cannot be translated.
    const advice = el("p", {}, "Please check your internet connection and try again.");
    show("The study cannot be reached", [advice, row(button("Try again", start))]);
    return;
  }
  useTexts(study.texts);
  const stored = recall("language");
  useLanguage(study.languages.includes(stored) ? stored : preferredLanguage(study.languages));
  updateTitle();
  // From a link of the researcher, for participants who can no longer use the browser in which they started.
  takeLinkedToken();
  if (recall("token")) await resume();
  else consent();
}

function updateTitle() {
  const title = has("study.title") ? t("study.title") : study.title;
  document.title = title;
  byId("title").textContent = title;
}

function languageChoice() {
  if (study.languages.length < 2) return null;
  const options = study.languages.map((code) =>
    el("option", { value: code, lang: code, selected: code === currentLanguage() }, nameOfLanguage(code)),
  );
  const onchange = (event) => {
    useLanguage(event.target.value);
    keep("language", event.target.value);
    updateTitle();
    consent();
    byId("language").focus();
  };
  return row(el("label", { for: "language" }, t("language.choose")), el("select", { id: "language", onchange }, ...options));
}

function consent() {
  const box = el("input", { type: "checkbox", id: "agree", onchange: () => (go.disabled = !box.checked) });
  const go = button(t("continue"), () => instructions());
  go.disabled = true;
  const onsubmit = (event) => {
    event.preventDefault();
    if (!go.disabled) instructions();
  };
  const agree = el("label", { class: "agree", for: "agree" }, box, el("span", {}, t("consent.agree")));
  show(t("consent.title"), [languageChoice(), text(t("consent.text")), el("form", { onsubmit }, agree, row(go))]);
}

async function instructions() {
  keep("language", currentLanguage());
  const checks = study.has_checks ? t("instructions.checks") : "";
  const words = t("instructions.text", { n: study.n_trials, checks });
  await step(t("instructions.title"), [text(words)], t("continue"));
  if (study.sound_check) await checkSound(`films/${study.sound_check}.mp4`);
  await begin();
}

async function begin() {
  // Another tab may have started the session in the meantime.
  if (recall("token")) return resume();
  let begun;
  try {
    begun = await withRetries(() => backend.begin(currentLanguage()), onWait);
  } catch (error) {
    const { reason } = error;
    if (["full", "known", "id-missing"].includes(reason)) show(t(`${reason}.title`), [text(t(`${reason}.text`))]);
    else showError(error);
    return;
  }
  keep("token", begun.token);
  await proceed(begun.state);
}

// Resumes after a reload: a pending answer is sent first.
async function resume() {
  try {
    let state = await withRetries(() => backend.state(), onWait);
    if (!state.completion) await step(t("resume.title"), [text(t("resume.text"))], t("resume.go"));
    const pending = recall("pending");
    if (pending && pending.position === state.position) state = (await send(pending)).state;
    await proceed(state);
  } catch (error) {
    showError(error);
  }
}

async function proceed(state) {
  try {
    while (!state.completion) state = await oneTrial(state);
    complete(state.completion);
  } catch (error) {
    showError(error);
  }
}

async function oneTrial({ position, n_trials: total, trial }) {
  const task = study.tasks[trial.task];
  withdrawal(true);
  byId("tools").replaceChildren(
    el("progress", { max: `${total}`, value: `${position}`, "aria-label": t("trial.progress") }),
  );
  if (instructed !== trial.task) {
    const words = firstText(`instructions.${task.name}`, `instructions.${task.scale || task.design}`);
    const heading = firstText(`title.${task.name}`, `title.${task.scale || task.design}`);
    await step(heading, [text(words)], t("continue"));
    instructed = trial.task;
  }
  const plays = recall("plays");
  // Request that reports the start of the films once per load of the page, sent at their first play.
  let started = null;
  const answer = await runTrial({
    task,
    trial,
    heading: t("trial.title", { n: position + 1, total }),
    playsBefore: plays?.position === position ? plays.n : 0,
    onplay(n) {
      keep("plays", { position, n });
      started ??= withRetries(() => backend.start(position), onWait).catch(() => {});
    },
  });
  const { feedback, state } = await send({ position, ...answer }, started);
  if (feedback) await showFeedback(task, answer.response, feedback);
  return state;
}

// Sends an answer until it is stored, after the start of its films. If the server has a different answer or state, that
// of the server is used.
async function send(answer, started = null) {
  keep("pending", answer);
  announce(t("answer.saving"));
  await started;
  let reply;
  try {
    reply = await withRetries(() => backend.answer(answer), onWait);
  } catch (error) {
    if (error.status !== 409 && error.status !== 400) throw error;
    keep("pending", null);
    reply = { state: await withRetries(() => backend.state(), onWait) };
    if (error.status === 400 && reply.state.position === answer.position) throw error;
  }
  keep("pending", null);
  announce("");
  return reply;
}

// Shows the correct response of a training trial.
async function showFeedback(task, given, right) {
  const isRight = JSON.stringify(given) === JSON.stringify(right);
  const [[, value]] = Object.entries(right);
  const words = firstText(`feedback.${task.design}.${value}`, "feedback.none");
  const result = el("p", { class: isRight ? "right" : "wrong" }, t(isRight ? "feedback.right" : "feedback.wrong"));
  await step(t("feedback.title"), [result, el("p", {}, words)], t("continue"));
}

function complete({ code, return_url: address }) {
  withdrawal(true);
  byId("tools").replaceChildren();
  const field = el("input", { type: "text", id: "code", class: "code", readonly: true, value: code });
  const copy = button(t("done.copy"), async () => {
    field.select();
    try {
      await navigator.clipboard.writeText(code);
    } catch {
      document.execCommand("copy");
    }
    announce(t("done.copied"));
  });
  const isLink = address && ["https:", "http:"].includes(new URL(address, location.href).protocol);
  const back = isLink ? row(el("a", { class: "button main", href: address, rel: "noreferrer" }, t("done.return"))) : null;
  show(t("done.title"), [text(t("done.text")), row(el("label", { for: "code" }, t("done.code")), field, copy), back]);
}

// Button in the footer by which a participant withdraws.
function withdrawal(isShown) {
  const leave = button(t("withdraw.button"), confirmWithdrawal, "quiet");
  byId("footer").replaceChildren(...(isShown ? [leave] : []));
}

function confirmWithdrawal() {
  const note = el("p", { role: "status" });
  const cancel = button(t("withdraw.cancel"), () => dialog.close());
  const confirm = button(t("withdraw.confirm"), async () => {
    confirm.disabled = true;
    try {
      await withRetries(() => backend.withdraw(), (secs) => (note.textContent = t("answer.offline", { seconds: Math.round(secs) })));
    } catch (error) {
      // There is no data to delete.
      if (![401, 410].includes(error.status)) {
        note.textContent = t("error.text", { sentence: error.message });
        confirm.disabled = false;
        return;
      }
    }
    dialog.close();
    forget();
    withdrawal(false);
    byId("tools").replaceChildren();
    show(t("withdraw.done.title"), [text(t("withdraw.done.text"))]);
  }, "");
  const heading = el("h2", { id: "withdraw-title" }, t("withdraw.title"));
  const dialog = el("dialog", { "aria-labelledby": "withdraw-title", onclose: () => dialog.remove() }, heading, text(t("withdraw.text")), note, row(cancel, confirm));
  document.body.append(dialog);
  dialog.showModal();
}

// Shows an error that stops the session. A session that has ended is forgotten.
function showError(error) {
  const isOver = error instanceof ServerError && [401, 404, 410].includes(error.status);
  withdrawal(!isOver && Boolean(recall("token")));
  if (isOver) {
    forget();
    show(t("gone.title"), [text(t("gone.text")), row(button(t("gone.again"), () => location.reload()))]);
    return;
  }
  const sentence = error instanceof ServerError ? error.message : t("error.unknown");
  show(t("error.title"), [text(t("error.text", { sentence })), row(button(t("error.retry"), () => location.reload()))]);
}

start();
