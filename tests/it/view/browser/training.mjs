// Follows a training to its end and shows generated beside true motion. Prints one line of JSON.
//
//   node training.mjs --url URL [--screenshot FILE]

import { audit } from "../../study/browser/page.mjs";
import { drawnShare, observeLongTasks, since, visit, waitForStatus } from "./view.mjs";

await visit("run", async ({ page }) => {
  const openedMs = await since(page, () => document.querySelector(".chart canvas")?.width > 300 || document.querySelector(".chart canvas")?.clientWidth > 100);
  const progress = () => page.$eval("progress[aria-label=Training]", (node) => [node.value, node.max]);
  await page.waitForSelector("progress[aria-label=Training]");
  const atFirst = await progress();
  const tasks = await observeLongTasks(page);
  await waitForStatus(page, "has ended");
  const atEnd = await progress();
  const longTasks = await tasks();
  await page.$eval("details", (node) => (node.open = true));
  const rows = await page.$$eval("details table", (tables) => tables.map(({ tBodies }) => tBodies[0].rows.length));
  const alarms = await page.$$eval(".alarms li", (nodes) => nodes.map((node) => node.textContent));
  const findings = await audit(page);
  await page.$$eval("button", (nodes) => nodes.find((node) => node.textContent.startsWith("Show generated")).click());
  await page.waitForSelector(".player .avatar");
  const captions = await page.$$eval(".player .caption", (nodes) => nodes.map((node) => node.textContent));
  await page.$eval(".player .main", (node) => node.click());
  await page.waitForFunction(() => Number(document.querySelector(".player input[type=range]").value) > 1);
  await page.$$eval(".player .main", ([node]) => node.textContent === "Pause" && node.click());
  const drawn = await drawnShare(page, ".player .avatar canvas");
  return { openedMs, atFirst, atEnd, longTasks, rows, alarms, findings, captions, drawn, findingsOfPair: await audit(page) };
});
