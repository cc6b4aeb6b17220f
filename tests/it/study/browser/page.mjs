// The study's page in headless Chromium: opened, acted on by keys alone or by touch alone, and looked at by axe-core.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";

const packages = createRequire(join(resolve(process.env.ORATOR_DRIVER ?? "target/driver"), "/"));
const puppeteer = packages("puppeteer-core");

const PATIENCE_MS = 180_000;

export const launch = () =>
  puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    protocolTimeout: 4 * PATIENCE_MS,
    args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--mute-audio"],
  });

// Blocks the storage of the page and loses the first reply to a request to begin.
function makeAdverse() {
  const blocked = () => {
    throw new DOMException("blocked", "SecurityError");
  };
  Object.defineProperty(window, "localStorage", { get: blocked });
  const { fetch } = window;
  let isLost = false;
  window.fetch = async (url, options) => {
    const reply = await fetch(url, options);
    if (isLost || url !== "api/begin") return reply;
    isLost = true;
    throw new TypeError("the reply was lost");
  };
}

// A page at `url`; `touch`: acted on by touch, by keys otherwise; `adverse`: see `makeAdverse`.
export async function open(browser, url, { width = 1280, height = 800, touch = false, scheme = "light", language = "en", adverse = false }) {
  const context = await browser.createBrowserContext();
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  await page.setViewport({ width, height, hasTouch: touch, isMobile: touch, deviceScaleFactor: 1 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
  await page.evaluateOnNewDocument((code) => {
    Object.defineProperty(navigator, "languages", { get: () => [code] });
  }, language);
  if (adverse) await page.evaluateOnNewDocument(makeAdverse);
  const session = await page.createCDPSession();
  await session.send("Emulation.setFocusEmulationEnabled", { enabled: true });
  const problems = [];
  page.on("pageerror", (error) => problems.push(`${error.stack ?? error}`));
  page.on("console", (message) => ["error", "warn"].includes(message.type()) && problems.push(message.text()));
  const origin = new URL(url).origin;
  page.on("request", (request) => {
    const address = request.url();
    if (!address.startsWith(origin) && !address.startsWith("data:")) problems.push(`it wants ${address}`);
  });
  await page.goto(url);
  // Out of sight for some time: the focus is no longer feigned, and another page stands in front.
  const lookAway = async (ms) => {
    await session.send("Emulation.setFocusEmulationEnabled", { enabled: false });
    const other = await context.newPage();
    await other.bringToFront();
    await new Promise((resolve) => setTimeout(resolve, ms));
    await other.close();
    await page.bringToFront();
    await session.send("Emulation.setFocusEmulationEnabled", { enabled: true });
  };
  return { page, context, problems, lookAway, hands: touch ? fingers(page) : keys(page) };
}

// Acts on an element by keys alone: the focus goes there by Tab.
function keys(page) {
  const reach = async (selector) => {
    const target = await page.waitForSelector(selector);
    for (let presses = 0; presses < 60; presses += 1) {
      if (await target.evaluate((node) => node === document.activeElement)) return target;
      await page.keyboard.press("Tab");
    }
    throw new Error(`the focus does not come to ${selector}`);
  };
  return {
    async press(selector) {
      await reach(selector);
      await page.keyboard.press("Space");
    },
    async choose(index) {
      await page.keyboard.press(`${index + 1}`);
    },
    async type(selector, text) {
      await reach(selector);
      await page.keyboard.type(text);
    },
    async slide(selector, value) {
      await reach(selector);
      await page.keyboard.press("Home");
      for (let k = 0; k < Math.floor(value / 10); k += 1) await page.keyboard.press("PageUp");
      for (let k = 0; k < value % 10; k += 1) await page.keyboard.press("ArrowRight");
      if (value === 0) await page.keyboard.press("Space");
    },
    async submit() {
      await page.keyboard.press("Enter");
    },
  };
}

// Acts on an element by touch alone.
function fingers(page) {
  // A finger finds a control that stands still and can be used: films that load move what is below them.
  const isStill = (node) =>
    new Promise((resolve) => {
      const { x, y } = node.getBoundingClientRect();
      const wait = () => requestAnimationFrame(() => requestAnimationFrame(compare));
      const compare = () => {
        const later = node.getBoundingClientRect();
        resolve(!node.disabled && later.x === x && later.y === y);
      };
      wait();
    });
  const tap = async (selector) => {
    const target = await page.waitForSelector(selector);
    do await target.scrollIntoView();
    while (!(await target.evaluate(isStill)));
    await target.tap();
  };
  return {
    press: tap,
    choose: (index) => tap(`.choices label:nth-child(${index + 1})`),
    async type(selector, text) {
      await tap(selector);
      await page.keyboard.type(text);
    },
    async slide(selector, value) {
      const target = await page.waitForSelector(selector);
      await target.scrollIntoView();
      const box = await target.boundingBox();
      const isMirrored = await page.evaluate(() => document.documentElement.dir === "rtl");
      const share = isMirrored ? 1 - value / 100 : value / 100;
      // The thumb's width is left out of the way of its middle.
      await page.touchscreen.tap(box.x + 8 + share * (box.width - 16), box.y + box.height / 2);
    },
    submit: () => tap("main form button[type=submit]"),
  };
}

const axe = () => readFileSync(packages.resolve("axe-core/axe.min.js"), "utf8");

// What shuts people out of what is shown: serious findings of axe-core, a page that must be scrolled sideways, targets
// that are too small for a finger.
export async function audit(page) {
  if (!(await page.evaluate(() => "axe" in window))) await page.evaluate(axe());
  return page.evaluate(async () => {
    const { violations } = await window.axe.run(document, { resultTypes: ["violations"] });
    const grave = violations.filter(({ impact }) => ["serious", "critical"].includes(impact));
    const found = grave.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html.slice(0, 120)).join(" | ")}`);
    const { scrollWidth, clientWidth } = document.documentElement;
    if (scrollWidth > clientWidth) found.push(`${scrollWidth} px wide in a window of ${clientWidth}`);
    for (const node of document.querySelectorAll("button, select, .choices label, .agree, input:not([type=checkbox], [type=radio])")) {
      const { width, height } = node.getBoundingClientRect();
      if (width > 0 && (height < 44 || width < 44)) found.push(`${Math.round(width)} x ${Math.round(height)} px: ${node.outerHTML.slice(0, 120)}`);
    }
    return found;
  });
}
