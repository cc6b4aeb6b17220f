// Trial: its films, its question, and measurements up to the answer.

import { announce, button, el, show } from "./dom.js";
import { Screening } from "./player.js";
import { isSideBySide, question, questionKeys, sideNames, slider } from "./questions.js";
import { firstText, t } from "./texts.js";

const filmUrl = (film) => `films/${film}.mp4`;
const rounded = (secs) => Math.round(secs * 1000) / 1000;

// Shows a trial and resolves with its answer: response, plays, stalled_secs, unfocused_secs, response_secs.
// `playsBefore`: number of plays before the page was reloaded; `onplay(plays)` saves the count.
export function runTrial({ task, trial, heading, playsBefore, onplay }) {
  const inTurn = trial.films.length > 2 || (task.design === "sliders" && trial.phase !== "attention-check");
  return new Promise((resolve) => {
    const view = inTurn ? filmsInTurn(task, trial) : filmsTogether(task, trial);
    const next = el("button", { type: "submit", class: "main", disabled: true }, t("answer.send"));
    let endedAt = 0;
    view.onchange = () => {
      next.disabled = view.isPlaying() || view.response() === null;
    };
    view.onend = () => {
      endedAt = performance.now();
      view.onchange();
    };
    view.onplay = () => onplay(playsBefore + view.plays());
    const onsubmit = (event) => {
      event.preventDefault();
      if (next.disabled) return;
      next.disabled = true;
      const total = (name) => rounded(view.screenings.reduce((sum, one) => sum + one[name], 0));
      const answer = {
        response: view.response(),
        plays: Math.min(1000, playsBefore + view.plays()),
        stalled_secs: total("stalledSecs"),
        unfocused_secs: total("unfocusedSecs"),
        response_secs: rounded((performance.now() - endedAt) / 1000),
      };
      for (const screening of view.screenings) screening.close();
      resolve(answer);
    };
    const phase = ["practice", "training"].includes(trial.phase) ? el("p", { class: "note" }, t(`phase.${trial.phase}`)) : null;
    const form = el("form", { onsubmit, novalidate: true }, ...view.nodes, el("p", { class: "row" }, next));
    show(heading, [phase, form], view.focus);
  });
}

// A film with its name, or with the names of its left and right half.
const captioned = (video, ...names) => {
  video.setAttribute("aria-label", names.join(", "));
  const captions = names.map((name) => el("span", { dir: "auto" }, name));
  return el("figure", {}, video, el("figcaption", { "aria-hidden": "true" }, ...captions));
};

// Button that plays a screening; calls `onseen` after the first complete play. Without `replay` the films play once.
function playButton(screening, labels, replay, { onstart, onbegin, onseen, onend }) {
  let wasPlayed = false;
  const press = async () => {
    play.disabled = true;
    play.textContent = t("films.loading");
    announce(t("films.loading"));
    try {
      onstart();
      await screening.play();
    } catch (error) {
      play.disabled = false;
      play.textContent = labels.play;
      announce(t(error?.name === "NotAllowedError" ? "films.again-please" : "films.failed"));
      play.focus();
      onend();
      return;
    }
    play.dataset.seen = "yes";
    play.disabled = !replay;
    play.textContent = replay ? labels.again : labels.seen;
    announce(t("films.ended"));
    if (!wasPlayed) onseen();
    wasPlayed = true;
    onend();
  };
  const play = button(labels.play, press);
  screening.onbegin = onbegin;
  screening.onstall = (isStalled) => announce(isStalled ? t("films.stalled") : "");
  screening.videos[0].addEventListener("playing", () => {
    play.textContent = t("films.playing");
    announce(t("films.playing"));
  });
  return play;
}

// One film of one avatar or of two side by side, or two films side by side and in synchrony.
function filmsTogether(task, trial) {
  const screening = new Screening(trial.films.map(filmUrl));
  const isWide = isSideBySide(task, trial);
  const isPair = trial.films.length > 1 || isWide;
  const names = isPair ? sideNames(trial) : [t("film.one")];
  const films = isWide ? [captioned(screening.videos[0], ...names)] : screening.videos.map((video, at) => captioned(video, names[at]));
  const kind = isWide ? "wide" : "pair";
  const stage = el("div", { class: `films ${isPair ? kind : "one"}`, role: "group", "aria-label": t("films.group") }, ...films);
  const asked = question(task, trial, () => view.onchange());
  const labels = { play: t(isPair ? "films.play.both" : "films.play.one"), again: t("films.play.again"), seen: t("films.seen") };
  const play = playButton(screening, labels, task.replay, {
    onstart: () => {},
    onbegin() {
      view.onplay();
      view.onchange();
    },
    onseen: () => asked.enable(),
    onend() {
      view.onend();
      // Measured asynchrony of the two films, for tests of the page.
      stage.dataset.startOffsetMs = Math.round(1000 * screening.offset.start);
      stage.dataset.maxOffsetMs = Math.round(1000 * screening.offset.max);
    },
  });
  const hint = el("p", { class: "note" }, t(task.replay ? "films.often" : "films.once"));
  const view = {
    screenings: [screening],
    nodes: [stage, el("p", { class: "row" }, play, el("span", { class: "keys" }, t("keys.play"))), hint, asked.node],
    focus: play,
    plays: () => screening.plays,
    isPlaying: () => screening.playing,
    response: () => (asked.node.disabled ? null : asked.response()),
  };
  return view;
}

// Several films shown in turn at one position, each with a button and a slider.
function filmsInTurn(task, trial) {
  const isCheck = trial.phase === "attention-check";
  const seen = new Set();
  const screenings = trial.films.map((film) => new Screening([filmUrl(film)]));
  const films = screenings.map((screening, at) => captioned(screening.videos[0], t("film.number", { n: at + 1 })));
  const stage = el("div", { class: "films stack", role: "group", "aria-label": t("films.group") }, ...films);
  const asked = isCheck ? question(task, trial, () => view.onchange()) : null;
  const sliders = isCheck ? [] : screenings.map((_, at) => slider(at + 1, () => view.onchange()));
  const shown = (at) => films.forEach((film, k) => film.classList.toggle("shown", k === at));
  shown(0);
  // No film can start while another plays.
  const lock = (on) => plays.forEach((play, at) => (play.disabled = on || (seen.has(at) && !task.replay)));
  const plays = screenings.map((screening, at) => {
    const n = at + 1;
    const labels = {
      play: t("films.play.number", { n }),
      again: t("films.play.number-again", { n }),
      seen: t("films.seen.number", { n }),
    };
    return playButton(screening, labels, task.replay, {
      onstart() {
        shown(at);
        lock(true);
        view.onchange();
      },
      onbegin: () => view.onplay(),
      onseen() {
        seen.add(at);
        sliders[at]?.enable();
        if (seen.size === trial.films.length) asked?.enable();
      },
      onend() {
        lock(false);
        view.onend();
      },
    });
  });
  const rows = plays.map((play, at) => el("div", { class: "score" }, play, sliders[at]?.node ?? null));
  const head = isCheck ? null : el("h2", { id: "question" }, firstText(...questionKeys(task, trial.phase)));
  const group = el("div", { class: "scores", role: "group", "aria-labelledby": isCheck ? null : "question" }, ...rows);
  const hint = el("p", { class: "note" }, t(task.replay ? "films.often" : "films.once"));
  const keys = isCheck ? null : el("p", { class: "keys" }, t("keys.sliders"));
  const view = {
    screenings,
    nodes: [stage, head, hint, group, asked?.node, keys].filter(Boolean),
    focus: plays[0],
    // Plays of the film played most often, comparable to films that are played together.
    plays: () => Math.max(...screenings.map((screening) => screening.plays)),
    isPlaying: () => screenings.some((screening) => screening.playing),
    response() {
      if (seen.size < trial.films.length) return null;
      if (isCheck) return asked.response();
      const scores = sliders.map((one) => one.score());
      return scores.includes(null) ? null : { scores };
    },
  };
  return view;
}
