// A visitor of the dataset view by keyboard only: plays, steps, selects a range, rejects it, chooses the speaker, corrects
// a word, undoes all, opens an interval from the table and moves between the tabs. Prints one line of JSON.
//
//   node dataset.mjs --url URL --video SPEAKER/NAME [--width 360] [--scheme dark] [--screenshot FILE]

import { audit } from "../../study/browser/page.mjs";
import { focus, options, since, sleep, visit, waitForStatus } from "./view.mjs";

await visit(`dataset/${options.video}`, async ({ page }) => {
  const openedMs = await since(page, () => document.querySelector(".rows .interval:not([hidden])"));
  await page.waitForFunction(() => document.querySelector("video").readyState >= 2 && document.querySelector(".avatar .over").hidden);
  const findings = await audit(page);
  const seconds = () => page.$eval("video", (video) => video.currentTime);
  const slider = ".timeline [role=slider]";
  const keys = async (...names) => {
    for (const name of names) await page.keyboard.press(name);
    await sleep(300);
  };

  await focus(page, slider);
  await keys("Space");
  await page.waitForFunction(() => document.querySelector("video").currentTime > 1);
  await keys("Space");
  const playedSecs = await seconds();
  await keys("Home");
  await keys("ArrowRight", "ArrowRight");
  const steppedSecs = await seconds();
  await page.keyboard.down("Shift");
  await keys("ArrowRight");
  await page.keyboard.up("Shift");
  const shiftedSecs = await seconds();
  await keys("[");
  await page.keyboard.down("Shift");
  await keys("ArrowRight");
  await page.keyboard.up("Shift");
  await keys("]");
  const valueText = await page.$eval(slider, (node) => node.getAttribute("aria-valuetext"));

  const isEditable = (await page.$(".decisions")) !== null;
  const rows = () => page.$$eval(".decisions tbody tr", (nodes) => nodes.map((row) => [...row.cells].slice(0, 4).map((cell) => cell.textContent)));
  let [made, left, isFocusKept] = [[], [], null];
  if (isEditable) {
    await page.$$eval(".decisions button, .decisions input, .decisions select", (nodes) =>
      nodes.forEach((node) => (node.id ||= (node.labels?.[0] ?? node).textContent.split(",")[0].replaceAll(" ", "-").toLowerCase())));
    const press = async (id, status) => {
      await focus(page, `#${id}`);
      await page.keyboard.press("Enter");
      await waitForStatus(page, status);
    };
    await press("reject", "Saved: Reject");
    isFocusKept = await page.evaluate(() => document.activeElement.id === "reject");
    for (const [id, value] of [["x", "300"], ["y", "200"]]) {
      await focus(page, `#${id}`);
      await page.keyboard.type(value);
    }
    await press("set-the-speaker", "Saved: Choose the speaker");
    if (await page.$("#correct-text")) {
      await focus(page, "#correct-text");
      await page.keyboard.type("!");
      await press("correct-the-word", "Saved: Correct a word");
    }
    made = await rows();
    for (let k = made.length; k > 0; k -= 1) {
      await focus(page, ".decisions tbody button");
      await page.keyboard.press("Enter");
      await page.waitForFunction((n) => document.querySelectorAll(".decisions tbody tr").length === n, {}, k - 1);
    }
    await waitForStatus(page, "Undone");
    left = await rows();
  }

  await focus(page, "[role=grid]");
  await keys("End", "Enter");
  await waitForStatus(page, "The playhead is at");
  const activeRow = await page.$eval(".rows [aria-selected=true]", (row) => row.textContent);
  const state = await page.$eval(".state", (node) => node.textContent);

  await focus(page, ".avatar canvas");
  await keys("ArrowLeft", "+", "0");
  await page.focus("[role=tab]");
  await keys("ArrowRight");
  const hash = new URL(page.url()).hash;
  await page.reload();
  const shownAfterReload = await page.waitForSelector("[role=tabpanel]:not([hidden])").then((node) => node.evaluate(({ id }) => id));
  await page.focus("[role=tab][aria-selected=true]");
  await keys("Home");
  await page.waitForSelector(".timeline");
  return { openedMs, findings, playedSecs, steppedSecs, shiftedSecs, valueText, isEditable, made, left, isFocusKept, activeRow, state, hash, shownAfterReload };
});
