// Simulated participants that answer a study by a rule.
//
//   node participant.mjs --url URL --answers FILE [--seed N] [--participants N] [--at-once N]
//
// FILE: {"scores": {FILM: 0 to 1}, "numbers": {FILM: NUMBER}, "certainty": 0 to 1}. A film of two avatars has two scores,
// [LEFT, RIGHT]. The film or avatar of the higher score is chosen, with the probability `certainty`; a single film is
// judged real above 0.5; sliders are set to the score. An attention check is answered with the number of its film. Prints
// one line of JSON per participant.
//
// For tests of the page: --touch, --width, --height, --scheme dark, --language CODE, --audit (axe-core at every step),
// --pictures DIR, --reload-at POSITION, --offline-at POSITION, --away-at POSITION, --interrupt-at POSITION,
// --withdraw-at POSITION.

import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { audit, launch, open } from "./page.mjs";

const text = { type: "string" };
const { values: options } = parseArgs({
  options: {
    url: text, answers: text, seed: text, participants: text, "at-once": text, width: text, height: text, scheme: text,
    language: text, pictures: text, "reload-at": text, "offline-at": text, "withdraw-at": text,
    "away-at": text, "interrupt-at": text,
    touch: { type: "boolean" }, audit: { type: "boolean" },
  },
});
const rule = { scores: {}, numbers: {}, certainty: 1, ...(options.answers ? JSON.parse(readFileSync(options.answers, "utf8")) : {}) };
const at = (name) => (options[name] === undefined ? -1 : Number(options[name]));

// Seeded random numbers from 0 to 1 (mulberry32).
function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let bits = Math.imul(state ^ (state >>> 15), state | 1);
    bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
    return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
  };
}

// State of the page: kind of step, films and options.
const readView = (page) =>
  page.evaluate(() => {
    const has = (selector) => Boolean(document.querySelector(selector));
    const films = [...document.querySelectorAll("main .films video")].map((video) => video.src.match(/([0-9a-f]{16})\.mp4/)?.[1]);
    const kind = has("#agree") ? "consent"
      : has("#tones") ? "sound"
      : has("#code") ? "end"
      : has("main form #number") ? "check"
      : has("main form .score input[type=range]") ? "sliders"
      : has("main form .choices") ? "choice"
      : has("main .main") ? "text" : "nothing";
    const options = [...document.querySelectorAll(".choices input")].map((input) => input.value);
    const heading = document.querySelector("h1")?.textContent;
    return { kind, films, options, heading, inTurn: has(".films.stack") };
  });

// Diagnostics of a page that does not continue: its texts and the state of its films.
const describe = (page) =>
  page.evaluate(() => {
    const { hidden, activeElement } = document;
    const films = [...document.querySelectorAll("main video")].map((video) => {
      const { readyState, networkState, paused, ended, seeking, currentTime, duration, playbackRate } = video;
      return { readyState, networkState, paused, ended, seeking, currentTime, duration, playbackRate, error: video.error?.message };
    });
    const texts = (selector) => [...document.querySelectorAll(selector)].map((node) => node.textContent);
    return { hidden, focus: activeElement?.outerHTML.slice(0, 120), status: texts("#status"), buttons: texts("main button"), films };
  });

// Index of the option that the rule chooses.
function chooseOption({ films, options: values }, draw) {
  const followsRule = draw() < rule.certainty;
  const scores = films.flatMap((film) => rule.scores[film] ?? 0.5);
  if (scores.length === 1) return (scores[0] > 0.5) === followsRule ? 0 : 1;
  const difference = (scores[1] - scores[0]) * (followsRule ? 1 : -1);
  if (values.length === 2) return difference === 0 ? Math.floor(2 * draw()) : Number(difference > 0);
  return Math.max(0, Math.min(4, 2 + Math.sign(difference) * Math.ceil(2 * Math.abs(difference))));
}

async function participate(browser, seed) {
  const draw = random(seed);
  const { width, height, touch, scheme, language } = options;
  const size = { width: width ? Number(width) : undefined, height: height ? Number(height) : undefined };
  const { page, context, problems, hidePage, input } = await open(browser, options.url, { ...size, touch, scheme, language });
  const report = { seed, steps: [], findings: [], offsets_ms: [], trials: 0, answers: [], code: null, problems };
  page.on("request", (request) => request.url().endsWith("/api/answer") && report.answers.push(JSON.parse(request.postData())));
  let position = 0;
  let hasReloaded = false;
  const step = async (name) => {
    report.steps.push(name);
    if (options.pictures) {
      mkdirSync(options.pictures, { recursive: true });
      const file = `${String(report.steps.length).padStart(2, "0")}-${name}.png`;
      await page.screenshot({ path: join(options.pictures, file) });
    }
    if (options.audit) report.findings.push(...(await audit(page)).map((finding) => `${name}: ${finding}`));
  };
  const isOpen = (selector) => page.waitForSelector(`${selector}:not(:disabled)`);
  // Performs `act` and waits for another step that contains `selector`.
  const nextStep = async (act, selector = "main .main") => {
    await page.evaluate(() => (document.querySelector("h1").dataset.isOld = "yes"));
    await act();
    const isNew = (wanted) => document.querySelector("h1")?.dataset.isOld !== "yes" && document.querySelector(wanted);
    await page.waitForFunction(isNew, {}, selector);
  };
  // Rejects the first play of the muted film, as a browser does that stops it.
  const interrupt = () =>
    page.evaluate(() => {
      const muted = document.querySelectorAll("main video")[1];
      muted.play = () => {
        delete muted.play;
        return Promise.reject(new DOMException("stopped", "AbortError"));
      };
    });
  // Waits for `seen` after a press of the play button, and presses again whenever the page reports a failed load.
  const seenAfter = async (button, seen) => {
    const isSettled = (button, seen) => document.querySelector(seen) ?? document.querySelector(`${button}:not(:disabled)`);
    // A server that does not run fails each press at once.
    for (let presses = 1; ; presses += 1) {
      await page.waitForFunction(isSettled, {}, button, seen);
      if ((await page.$(seen)) || presses === 60) break;
      await new Promise((resolve) => setTimeout(resolve, 500));
      await input.press(button);
    }
    await page.waitForSelector(seen);
  };
  const watchTogether = async () => {
    if (position === at("interrupt-at")) await interrupt();
    const play = "main form button[type=button]";
    await input.press(play);
    if (position === at("away-at")) {
      await page.waitForFunction(() => document.querySelector("video").currentTime > 0);
      await hidePage(1000);
    }
    await seenAfter(play, "main form fieldset:not(:disabled)");
    const { startOffsetMs, maxOffsetMs } = await page.$eval(".films", (stage) => ({ ...stage.dataset }));
    report.offsets_ms.push([Number(startOffsetMs), Number(maxOffsetMs)]);
  };
  const watchInTurn = async (n, after) => {
    for (let k = 0; k < n; k += 1) {
      const play = `.score:nth-child(${k + 1}) button`;
      await input.press(play);
      await seenAfter(play, `${play}[data-seen]`);
      await after(k);
    }
  };
  const answer = async (view) => {
    if (position === at("withdraw-at")) {
      await input.press("#footer button");
      await page.waitForSelector("dialog[open]");
      await step("withdrawal");
      await nextStep(() => input.press("dialog button:last-child"), "main .text");
      await step("withdrawn");
      return false;
    }
    if (position === at("reload-at") && !hasReloaded) {
      hasReloaded = true;
      await input.press("main form button[type=button]");
      await page.waitForFunction(() => document.querySelector("video").currentTime > 0.3);
      await page.reload();
      await page.waitForSelector("main .main");
      await step("resumed");
      await nextStep(() => input.press("main .main"));
      return true;
    }
    if (view.kind === "sliders") {
      await watchInTurn(view.films.length, async (k) => {
        const score = Math.round(100 * (rule.scores[view.films[k]] ?? draw()));
        const slider = `.score:nth-child(${k + 1}) input`;
        await isOpen(`.score:nth-child(${k + 1}) fieldset`);
        await input.slide(slider, score);
      });
    } else if (view.inTurn) await watchInTurn(view.films.length, async () => {});
    else await watchTogether();
    if (view.kind === "choice") await input.choose(chooseOption(view, draw));
    if (view.kind === "check") await input.type("#number", `${view.films.map((film) => rule.numbers[film]).find(Boolean) ?? 11}`);
    await step(`${view.kind}-answered`);
    await nextStep(async () => {
      if (position === at("offline-at")) {
        await page.setOfflineMode(true);
        await input.submit();
        await page.waitForFunction(() => /[1-9]/.test(document.querySelector("#status").textContent));
        await step("offline");
        await page.setOfflineMode(false);
      } else await input.submit();
    });
    position += 1;
    report.trials += 1;
    return true;
  };
  const session = async () => {
    await page.waitForSelector("main .main");
    for (;;) {
      const view = await readView(page);
      await step(view.kind);
      if (view.kind === "consent") {
        await input.press("#agree");
        await isOpen("main .main");
        await nextStep(() => input.press("main .main"));
      } else if (view.kind === "sound") {
        // After a wrong number, the next one needs another play.
        for (const tones of options.audit ? ["2", "3"] : ["3"]) {
          await input.press("main button[type=button]");
          await isOpen("main fieldset");
          await input.type("#tones", tones);
          if (tones === "2") {
            await input.submit();
            await page.waitForSelector("main fieldset:disabled");
          } else await nextStep(() => input.submit());
        }
      } else if (view.kind === "end") {
        report.code = await page.$eval("#code", (input) => input.value);
        break;
      } else if (view.kind === "text") await nextStep(() => input.press("main .main"));
      else if (!(await answer(view))) break;
    }
  };
  try {
    await session();
  } catch (error) {
    throw new Error(`${error.message}; steps: ${report.steps.join(", ")}; ${JSON.stringify(await describe(page))}`, { cause: error });
  }
  await context.close();
  return report;
}

const browser = await launch();
try {
  const seed = Number(options.seed ?? 1);
  const seeds = Array.from({ length: Number(options.participants ?? 1) }, (_, k) => seed + k);
  const worker = async () => {
    for (let next = seeds.shift(); next !== undefined; next = seeds.shift()) console.log(JSON.stringify(await participate(browser, next)));
  };
  await Promise.all(Array.from({ length: Number(options["at-once"] ?? 1) }, worker));
} finally {
  await browser.close();
}
