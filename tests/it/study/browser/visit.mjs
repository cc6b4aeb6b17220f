// A visitor who consents, reads the instructions, begins, and then reloads the page. Prints one line of JSON: the headings
// after both, the number of requests to begin, and the fragment of the address.
//
//   node visit.mjs --url URL [--adverse]
//
// --adverse: the browser has no storage, and the first reply to a request to begin is dropped.

import { parseArgs } from "node:util";
import { launch, open } from "./page.mjs";

const { values: options } = parseArgs({ options: { url: { type: "string" }, adverse: { type: "boolean" } } });
const browser = await launch();
try {
  const { page, input } = await open(browser, options.url, { adverse: options.adverse });
  let begins = 0;
  page.on("request", (request) => (begins += request.url().endsWith("/api/begin") ? 1 : 0));
  const heading = () => page.$eval("h1", (h1) => h1.textContent);
  const nextStep = async () => {
    await page.evaluate(() => (document.querySelector("h1").dataset.isOld = "yes"));
    await input.press("main .main");
    await page.waitForFunction(() => document.querySelector("h1").dataset.isOld !== "yes");
  };
  await page.waitForSelector("main .main");
  if (await page.$("#agree")) {
    await input.press("#agree");
    await page.waitForSelector("main .main:not(:disabled)");
    await nextStep();
    await nextStep();
  }
  const headings = [await heading()];
  await page.reload();
  await page.waitForSelector("main .main");
  headings.push(await heading());
  console.log(JSON.stringify({ headings, begins, fragment: new URL(page.url()).hash }));
} finally {
  await browser.close();
}
