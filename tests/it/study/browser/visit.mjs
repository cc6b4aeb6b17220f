// A visitor who agrees, reads the instructions and begins, then loads the page again. Prints a line of JSON: the
// headings after both, the number of requests to begin, and the fragment that the address still has.
//
//   node visit.mjs --url URL [--adverse]
//
// --adverse: the browser stores nothing, and the first reply to a request to begin is lost.

import { parseArgs } from "node:util";
import { launch, open } from "./page.mjs";

const { values: options } = parseArgs({ options: { url: { type: "string" }, adverse: { type: "boolean" } } });
const browser = await launch();
try {
  const { page, hands } = await open(browser, options.url, { adverse: options.adverse });
  let begins = 0;
  page.on("request", (request) => (begins += request.url().endsWith("/api/begin") ? 1 : 0));
  const heading = () => page.$eval("h1", (h1) => h1.textContent);
  const leave = async () => {
    await page.evaluate(() => (document.querySelector("h1").dataset.isOld = "yes"));
    await hands.press("main .main");
    await page.waitForFunction(() => document.querySelector("h1").dataset.isOld !== "yes");
  };
  await page.waitForSelector("main .main");
  if (await page.$("#agree")) {
    await hands.press("#agree");
    await page.waitForSelector("main .main:not(:disabled)");
    await leave();
    await leave();
  }
  const headings = [await heading()];
  await page.reload();
  await page.waitForSelector("main .main");
  headings.push(await heading());
  console.log(JSON.stringify({ headings, begins, fragment: new URL(page.url()).hash }));
} finally {
  await browser.close();
}
