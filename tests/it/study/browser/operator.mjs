// The operator's page, opened with the token. Prints a line of JSON: the cells of its two tables, the links in them, the
// findings of axe-core and what went wrong.
//
//   node operator.mjs --url URL --token TOKEN

import { parseArgs } from "node:util";
import { audit, launch, open } from "./page.mjs";

const text = { type: "string" };
const { values: options } = parseArgs({ options: { url: text, token: text } });
const browser = await launch();
try {
  const { page, problems, hands } = await open(browser, options.url, {});
  await hands.type("#token", options.token);
  await hands.submit();
  await page.waitForSelector("table");
  const cells = (tables) =>
    tables.map((table) => [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => cell.textContent)));
  const [quota, places] = await page.$$eval("table", cells);
  const links = await page.$$eval("td a", (nodes) => nodes.map((node) => node.href));
  console.log(JSON.stringify({ quota, places, links, findings: await audit(page), problems }));
} finally {
  await browser.close();
}
