// Opens a video with many intervals and scrolls through all of them, in the table and on the timeline. Prints one line of
// JSON with the time to open it and the main-thread tasks above 50 ms, in ms.
//
//   node intervals.mjs --url URL --video SPEAKER/NAME

import { audit } from "../../study/browser/page.mjs";
import { observeLongTasks, options, since, sleep, visit } from "./view.mjs";

await visit(`dataset/${options.video}`, async ({ page }) => {
  const openedMs = await since(page, () => document.querySelector(".rows .interval:not([hidden])") && document.querySelector(".timeline .top").width > 300);
  await sleep(1500);
  const scrollTasks = await observeLongTasks(page);
  const scrolled = await page.evaluate(async () => {
    const grid = document.querySelector(".intervals");
    const frame = () => new Promise(requestAnimationFrame);
    let [frames, shown] = [0, new Set()];
    const step = grid.scrollHeight / 300;
    for (let top = 0; top < grid.scrollHeight; top += step) {
      grid.scrollTop = top;
      await frame();
      frames += 1;
      shown.add(document.querySelector(".rows .interval:not([hidden])").textContent);
    }
    return { frames, distinct: shown.size, rows: Number(grid.getAttribute("aria-rowcount")) - 1, nodes: document.querySelectorAll(".rows .interval").length };
  });
  await sleep(300);
  const longWhileScrolling = await scrollTasks();
  const timelineTasks = await observeLongTasks(page);
  await page.focus(".timeline [role=slider]");
  for (let k = 0; k < 12; k += 1) await page.keyboard.press("+");
  for (let k = 0; k < 20; k += 1) await page.keyboard.press("PageUp");
  await page.keyboard.press("End");
  await page.keyboard.press("0");
  await sleep(500);
  const longOnTimeline = await timelineTasks();
  return { openedMs, ...scrolled, longWhileScrolling, longOnTimeline, findings: await audit(page) };
});
