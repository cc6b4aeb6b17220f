// Opens the viewer's page in headless Chromium with WebGL in software, and measures it.

import { parseArgs } from "node:util";
import { launch, open } from "../../study/browser/page.mjs";

const WEBGL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const MICROPHONE = ["--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream"];

const text = { type: "string" };
export const { values: options } = parseArgs({
  options: { url: text, video: text, sound: text, avatar: text, width: text, height: text, scheme: text, screenshot: text },
});

// Opens the view at a fragment of the address, runs `work(session)` and prints its result with the problems of the page.
export async function visit(fragment, work) {
  const browser = await launch([...WEBGL, ...MICROPHONE]);
  try {
    const { width = "1280", height = "800", scheme = "light" } = options;
    const session = await open(browser, `${options.url}#${fragment}`, { width: Number(width), height: Number(height), scheme });
    const report = await work(session);
    if (options.screenshot) await session.page.screenshot({ path: options.screenshot, fullPage: true });
    // Messages of the graphics driver in software are not about the page.
    const problems = session.problems.filter((problem) => !problem.includes("GL Driver Message"));
    console.log(JSON.stringify({ ...report, problems }));
  } finally {
    await browser.close();
  }
}

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// Milliseconds since the navigation at which `condition` holds in the page.
export const since = (page, condition, ...args) =>
  page
    .waitForFunction(condition, { polling: "raf", timeout: 60_000 }, ...args)
    .then(() => page.evaluate(() => Math.round(performance.now())));

// Observes main-thread tasks above 50 ms; the returned function stops it and gives their durations in ms.
export async function observeLongTasks(page) {
  await page.evaluate(() => {
    window.longTasks = [];
    window.taskObserver = new PerformanceObserver((list) =>
      window.longTasks.push(...list.getEntries().map(({ duration }) => Math.round(duration))),
    );
    window.taskObserver.observe({ type: "longtask" });
  });
  return () =>
    page.evaluate(() => {
      window.taskObserver.disconnect();
      return window.longTasks;
    });
}

// Presses Tab until `selector` has the focus.
export async function focus(page, selector) {
  const target = await page.waitForSelector(selector);
  for (let presses = 0; presses < 120; presses += 1) {
    if (await target.evaluate((node) => node === document.activeElement)) return target;
    await page.keyboard.press("Tab");
  }
  throw new Error(`Tab does not reach ${selector}`);
}

export const statusText = (page) => page.$eval("#status", (node) => node.textContent);

export const waitForStatus = (page, part) =>
  page.waitForFunction((wanted) => document.querySelector("#status").textContent.includes(wanted), { timeout: 60_000 }, part);

// Share of the pixels of an element that differ clearly from its corner: 0 for an empty 3D canvas.
export async function drawnShare(page, selector) {
  const element = await page.waitForSelector(selector);
  const picture = await element.screenshot({ encoding: "base64" });
  return page.evaluate(async (base64) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]));
    const canvas = new OffscreenCanvas(64, 64);
    const pen = canvas.getContext("2d");
    pen.drawImage(bitmap, 0, 0, 64, 64);
    const { data } = pen.getImageData(0, 0, 64, 64);
    const isDrawn = (at) => [0, 1, 2].some((k) => Math.abs(data[4 * at + k] - data[4 * 63 + k]) > 60);
    return Array.from({ length: 4096 }, (_, at) => isDrawn(at)).filter(Boolean).length / 4096;
  }, picture);
}
