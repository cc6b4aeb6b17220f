// Sound check: a film with some tones, which the participant counts.

import { announce, button, el, show } from "./dom.js";
import { Screening } from "./player.js";
import { t } from "./texts.js";

// Number of tones in the film.
const TONES = 3;

// Resolves when the participant has entered the correct number of tones.
export function checkSound(film) {
  return new Promise((resolve) => {
    const screening = new Screening([film]);
    const input = el("input", {
      type: "number", id: "tones", min: "0", max: "9", inputmode: "numeric", autocomplete: "off",
      oninput: () => (go.disabled = input.value === ""),
    });
    const go = el("button", { type: "submit", class: "main", disabled: true }, t("continue"));
    const asked = el(
      "fieldset",
      { disabled: true },
      el("p", { class: "row" }, el("label", { for: "tones" }, t("sound.question")), input),
    );
    const play = button(t("sound.play"), async () => {
      play.disabled = true;
      announce(t("films.playing"));
      try {
        await screening.play();
      } catch {
        play.disabled = false;
        announce(t("films.failed"));
        return;
      }
      play.disabled = false;
      play.textContent = t("sound.again");
      asked.disabled = false;
      announce("");
      input.focus({ preventScroll: true });
    });
    const onsubmit = (event) => {
      event.preventDefault();
      if (screening.playing || input.value === "") return;
      if (Number(input.value) !== TONES) {
        input.value = "";
        // The next answer needs another play.
        go.disabled = asked.disabled = true;
        announce(t("sound.wrong"));
        play.focus();
        return;
      }
      screening.close();
      resolve();
    };
    const video = screening.videos[0];
    video.setAttribute("aria-label", t("sound.title"));
    const words = el("div", { class: "text" }, el("p", {}, t("sound.text")));
    const stage = el("div", { class: "films one sound" }, el("figure", {}, video));
    const form = el("form", { onsubmit, novalidate: true }, asked, el("p", { class: "row" }, go));
    show(t("sound.title"), [words, stage, el("p", { class: "row" }, play), form], play);
  });
}
