// Rejects the first second of a video by keyboard. Prints one line of JSON.
//
//   node reject.mjs --url URL --video SPEAKER/NAME

import { focus, options, visit, waitForStatus } from "./view.mjs";

await visit(`dataset/${options.video}`, async ({ page }) => {
  await page.waitForFunction(() => document.querySelector("video").readyState >= 2);
  await focus(page, ".timeline [role=slider]");
  await page.keyboard.press("Home");
  await page.keyboard.press("[");
  await page.keyboard.down("Shift");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.up("Shift");
  await page.waitForFunction(() => document.querySelector("video").currentTime >= 0.9);
  await page.keyboard.press("]");
  await page.$$eval(".decisions button", (nodes) => nodes.find((node) => node.textContent === "Reject").click());
  await waitForStatus(page, "Saved: Reject");
  return { status: await page.$eval("#status", (node) => node.textContent) };
});
