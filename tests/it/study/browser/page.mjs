// Opens the study's page in headless Chromium, operates it by keyboard only or by touch only, and audits it with axe-core.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";

const packages = createRequire(join(resolve(process.env.ORATOR_DRIVER ?? "target/driver"), "/"));
const puppeteer = packages("puppeteer-core");

const TIMEOUT_MS = 180_000;

// `flags`: further switches of the browser.
export const launch = (flags = []) =>
  puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    protocolTimeout: 4 * TIMEOUT_MS,
    args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--mute-audio", ...flags],
  });

// Blocks the storage of the page and drops the first reply to a request to begin.
function makeAdverse() {
  const blocked = () => {
    throw new DOMException("blocked", "SecurityError");
  };
  Object.defineProperty(window, "localStorage", { get: blocked });
  const { fetch } = window;
  let isDropped = false;
  window.fetch = async (url, options) => {
    const reply = await fetch(url, options);
    if (isDropped || url !== "api/begin") return reply;
    isDropped = true;
    throw new TypeError("the reply was dropped");
  };
}

// Opens a page at `url`; `touch`: operated by touch instead of by keyboard; `adverse`: see `makeAdverse`.
export async function open(browser, url, { width = 1280, height = 800, touch = false, scheme = "light", language = "en", adverse = false }) {
  const context = await browser.createBrowserContext();
  const page = await context.newPage();
  page.setDefaultTimeout(TIMEOUT_MS);
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
    if (![origin, "data:", `blob:${origin}`].some((start) => address.startsWith(start))) problems.push(`request to another origin: ${address}`);
  });
  await page.goto(url);
  // Hides the page for some time: focus emulation is off, and another page is in front.
  const hidePage = async (ms) => {
    await session.send("Emulation.setFocusEmulationEnabled", { enabled: false });
    const other = await context.newPage();
    await other.bringToFront();
    await new Promise((resolve) => setTimeout(resolve, ms));
    await other.close();
    await page.bringToFront();
    await session.send("Emulation.setFocusEmulationEnabled", { enabled: true });
  };
  return { page, context, problems, hidePage, input: touch ? touchInput(page) : keyboardInput(page) };
}

// Operates elements by keyboard only, which are focused with Tab.
function keyboardInput(page) {
  const focus = async (selector) => {
    const target = await page.waitForSelector(selector);
    for (let presses = 0; presses < 60; presses += 1) {
      if (await target.evaluate((node) => node === document.activeElement)) return target;
      await page.keyboard.press("Tab");
    }
    throw new Error(`Tab does not reach ${selector}`);
  };
  return {
    async press(selector) {
      await focus(selector);
      await page.keyboard.press("Space");
    },
    async choose(index) {
      await page.keyboard.press(`${index + 1}`);
    },
    async type(selector, text) {
      await focus(selector);
      await page.keyboard.type(text);
    },
    async slide(selector, value) {
      await focus(selector);
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

// Operates elements by touch only.
function touchInput(page) {
  // A control can be tapped if it is enabled and does not move: films that load move the elements below them.
  const isTappable = (node) =>
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
    while (!(await target.evaluate(isTappable)));
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
      // The centre of the thumb travels the width of the slider minus that of the thumb.
      await page.touchscreen.tap(box.x + 8 + share * (box.width - 16), box.y + box.height / 2);
    },
    submit: () => tap("main form button[type=submit]"),
  };
}

const axe = () => readFileSync(packages.resolve("axe-core/axe.min.js"), "utf8");

// Accessibility problems: serious findings of axe-core, pages that must be scrolled horizontally, placeholders
// without a value, targets that are too small for touch.
export async function audit(page) {
  if (!(await page.evaluate(() => "axe" in window))) await page.evaluate(axe());
  return page.evaluate(async () => {
    const { violations } = await window.axe.run(document, { resultTypes: ["violations"] });
    const serious = violations.filter(({ impact }) => ["serious", "critical"].includes(impact));
    const found = serious.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html.slice(0, 120)).join(" | ")}`);
    const { scrollWidth, clientWidth } = document.documentElement;
    if (scrollWidth > clientWidth) found.push(`${scrollWidth} px wide in a window of ${clientWidth}`);
    const unfilled = document.body.innerText.match(/\{\w+\}/);
    if (unfilled) found.push(`placeholder without a value: ${unfilled[0]}`);
    for (const node of document.querySelectorAll("button, select, .choices label, .agree, input:not([type=checkbox], [type=radio])")) {
      const { width, height } = node.getBoundingClientRect();
      if (width > 0 && (height < 44 || width < 44)) found.push(`${Math.round(width)} x ${Math.round(height)} px: ${node.outerHTML.slice(0, 120)}`);
    }
    return found;
  });
}
