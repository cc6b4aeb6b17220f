// Opens the operator's page with the token. Prints one line of JSON: the cells of its two tables, the links in them, the
// findings of axe-core and the problems of the page.
//
//   node operator.mjs --url URL --token TOKEN

import { parseArgs } from "node:util";
import { audit, launch, open } from "./page.mjs";

const text = { type: "string" };
const { values: options } = parseArgs({ options: { url: text, token: text } });
const browser = await launch();
try {
  const { page, problems, input } = await open(browser, options.url, {});
  await input.type("#token", options.token);
  await input.submit();
  await page.waitForSelector("table");
  const cells = (tables) =>
    tables.map((table) => [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => cell.textContent)));
  const [quota, sessions] = await page.$$eval("table", cells);
  const links = await page.$$eval("td a", (nodes) => nodes.map((node) => node.href));
  console.log(JSON.stringify({ quota, sessions, links, findings: await audit(page), problems }));
} finally {
  await browser.close();
}
