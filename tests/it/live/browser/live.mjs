// Watches the page of `orator live` until the speech ends. Prints `ready` and a line of JSON.
//
//   node live.mjs --url URL [--avatar FILE.vrm] [--width 360] [--scheme dark] [--screenshot FILE]

import { audit } from "../../study/browser/page.mjs";
import { drawnShare, options, since, sleep, visit } from "../../view/browser/view.mjs";

await visit("live", async ({ page }) => {
  const requests = [];
  page.on("request", (request) => request.url().startsWith(options.url) || requests.push(request.url()));
  await since(page, () => /poses per second/.test(document.querySelector("#live-rate")?.textContent));
  if (options.avatar) {
    const input = await page.$("input[type=file]");
    await input.uploadFile(options.avatar);
    await page.waitForFunction(() => document.querySelector("#status").textContent.includes("performs the speech"), { timeout: 60_000 });
  }
  // Whoever reads this line now speaks, and the avatar moves.
  console.log("ready");
  await sleep(4000);
  const canvas = await page.$(".avatar canvas");
  const pictures = new Set();
  for (let n = 0; n < 6; n += 1) {
    pictures.add(await canvas.screenshot({ encoding: "base64" }));
    await sleep(200);
  }
  const drawn = await drawnShare(page, ".avatar canvas");
  const findings = await audit(page);
  await page.waitForFunction(() => /has ended/.test(document.querySelector("#live-rate").textContent), { polling: 200, timeout: 60_000 });
  return { pictures: pictures.size, drawn, findings, requests };
});
