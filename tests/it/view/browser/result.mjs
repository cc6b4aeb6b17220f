// Drops a sound file, generates, plays the result, compares it with another seed, makes an MP4, drives an own VRM avatar
// and records from a simulated microphone. Prints one line of JSON.
//
//   node result.mjs --url URL --sound FILE.wav [--avatar FILE.vrm] [--screenshot FILE]

import { readFileSync } from "node:fs";
import { basename } from "node:path";
import { audit } from "../../study/browser/page.mjs";
import { drawnShare, options, sleep, visit, waitForStatus } from "./view.mjs";

await visit("result", async ({ page }) => {
  await page.waitForFunction(() => document.querySelector("select")?.options.length > 0);
  const findings = await audit(page);
  const items = () => page.$$eval(".results li", (nodes) => nodes.length);
  const before = await items();
  const drop = (name, base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([bytes], name, { type: "audio/wav" }));
    for (const type of ["dragover", "drop"]) document.querySelector(".drop").dispatchEvent(new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }));
  };
  const press = (label) => page.$$eval("button", (nodes, wanted) => nodes.find((node) => node.textContent === wanted).click(), label);
  const generate = async () => {
    await press("Generate");
    await page.waitForSelector("progress:not([hidden])");
    await page.waitForFunction(() => [...document.querySelectorAll("button")].some((node) => node.textContent === "Generate" && !node.disabled), { timeout: 170_000 });
  };
  await page.evaluate(drop, basename(options.sound), readFileSync(options.sound).toString("base64"));
  await waitForStatus(page, "is chosen");
  await generate();
  await page.waitForSelector(".player");
  await press("Play");
  await page.waitForFunction(() => Number(document.querySelector(".player input[type=range]").value) > 1);
  await page.$$eval(".player .main", ([node]) => node.textContent === "Pause" && node.click());
  const drawn = await drawnShare(page, ".player .avatar canvas");
  await page.$eval("input[type=number]", (node) => (node.value = "2"));
  await generate();
  const made = (await items()) - before;
  const links = await page.$eval(".results li", (node) => [...node.querySelectorAll("a")].map((link) => link.textContent));
  for (const k of [1, 2]) {
    await page.$eval(`.results li:nth-child(${k}) input[type=checkbox]`, (node) => node.click());
    await sleep(300);
  }
  await page.waitForFunction(() => document.querySelectorAll(".player .avatar").length === 2);
  const findingsOfTwo = await audit(page);
  await page.$$eval(".results li:first-child button", (nodes) => nodes.find((node) => node.textContent === "Make MP4").click());
  await page.waitForFunction(() => document.querySelector(".results li a:last-of-type")?.textContent === "MP4", { timeout: 170_000 });
  let ownAvatar = null;
  if (options.avatar) {
    await (await page.$("input[accept='.vrm']")).uploadFile(options.avatar);
    await waitForStatus(page, "performs the result");
    ownAvatar = await drawnShare(page, ".player .avatar canvas");
  }
  await press("Record");
  await waitForStatus(page, "Recording");
  await sleep(1500);
  await press("Stop recording");
  await waitForStatus(page, "is chosen");
  const recorded = await page.$eval(".drop .note", (node) => node.textContent);
  await generate();
  await page.waitForSelector(".player");
  await press("Play");
  await page.waitForFunction(() => Number(document.querySelector(".player input[type=range]").value) > 0.5);
  const heard = await page.$eval(".player .clock", (node) => node.textContent);
  return { heard, before, made, links, drawn, ownAvatar, recorded, findings, findingsOfTwo };
});
