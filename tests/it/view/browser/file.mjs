// Plays and scrubs the file of `orator view FILE`. Prints one line of JSON.
//
//   node file.mjs --url URL [--width 360] [--scheme dark] [--screenshot FILE]

import { audit } from "../../study/browser/page.mjs";
import { drawnShare, focus, since, sleep, visit } from "./view.mjs";

await visit("file", async ({ page }) => {
  const openedMs = await since(page, () => document.querySelector(".player"));
  await sleep(300);
  const drawn = await drawnShare(page, ".avatar canvas");
  const findings = await audit(page);
  const slider = await page.$(".player input[type=range]");
  let [played, scrubbed] = [null, null];
  if (slider) {
    await focus(page, ".player .main");
    await page.keyboard.press("Space");
    await page.waitForFunction(() => Number(document.querySelector(".player input[type=range]").value) > 0.5);
    await page.keyboard.press("Space");
    played = await slider.evaluate((node) => Number(node.value));
    await focus(page, ".player input[type=range]");
    await page.keyboard.press("End");
    await sleep(200);
    scrubbed = await slider.evaluate((node) => node.getAttribute("aria-valuetext"));
  }
  return { openedMs, drawn, findings, played, scrubbed };
});
