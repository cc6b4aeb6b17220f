// Helpers that create DOM elements, and the client of the viewer's server. Strings are never parsed as HTML.

// Time for which the status is shown; errors stay.
const STATUS_MS = 12_000;

// Creates an element with attributes. Function values such as `onclick` become listeners; `true` sets an attribute
// without a value.
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) continue;
    if (typeof value === "function") node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

export const byId = (id) => document.getElementById(id);

export const button = (label, onclick, attributes = {}) => el("button", { type: "button", onclick, ...attributes }, label);

// A select of playback rates.
export function rateSelect(onrate) {
  const select = el("select", { onchange: () => onrate(Number(select.value)) }, ...options([0.25, 0.5, 1, 1.5, 2], (rate) => `${rate} ×`));
  select.value = "1";
  return labelled("Speed", select);
}

export const row = (...children) => el("div", { class: "row" }, ...children);

// A control with its visible label before it.
export const labelled = (label, control) => el("label", { class: "field" }, el("span", {}, label), control);

export const options = (values, label = (value) => value) => values.map((value) => el("option", { value: String(value) }, label(value)));

// A table in a region that scrolls sideways; cells are strings or nodes.
export const table = (label, heads, rows) =>
  el("div", { class: "wide", role: "region", "aria-label": label, tabindex: "0" }, el("table", {},
    el("thead", {}, el("tr", {}, ...heads.map((head) => el("th", { scope: "col" }, head)))),
    el("tbody", {}, ...rows.map((cells) => el("tr", {}, ...cells.map((cell) => el("td", {}, cell ?? "–")))))));

// Shows a status message, which screen readers announce.
export function announce(sentence, isWrong = false) {
  const status = byId("status");
  status.textContent = sentence;
  status.classList.toggle("wrong", isWrong);
  const clear = () => status.textContent === sentence && !isWrong && (status.textContent = "");
  setTimeout(clear, STATUS_MS);
}

// Runs an action that may fail; shows its error as the status.
export async function attempt(action) {
  try {
    return await action();
  } catch (error) {
    announce(error.message, true);
    return null;
  }
}

// "1:02:03.4"; `digits` after the decimal point.
export function clock(secs, digits = 1) {
  const units = Math.max(0, Math.round(secs * 10 ** digits));
  const whole = Math.floor(units / 10 ** digits);
  const two = (number) => `${number}`.padStart(2, "0");
  const fraction = digits ? `.${`${units % 10 ** digits}`.padStart(digits, "0")}` : "";
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor(whole / 60) % 60;
  return `${hours ? `${hours}:${two(minutes)}` : minutes}:${two(whole % 60)}${fraction}`;
}

// A number with four significant digits; a dash for a missing value.
export const number = (value) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(4))));

export const percent = (share) => `${Math.round(100 * share)} %`;

// Fetches from the server; the error of a failed request is the server's sentence.
async function request(url, init = {}) {
  let reply;
  try {
    reply = await fetch(url, { referrerPolicy: "no-referrer", ...init });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Error("The server cannot be reached: is `orator view` still running?");
  }
  if (reply.ok) return reply;
  const { error } = await reply.json().catch(() => ({}));
  throw new Error(error ?? `The server replied with status ${reply.status}.`);
}

export const getJson = async (url) => (await request(url)).json();
export const getBytes = async (url, signal) => (await request(url, { signal })).arrayBuffer();
export const send = async (method, url, body) => (await request(url, { method, body })).json();
export const sendJson = async (url, value) =>
  (await request(url, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(value) })).json();

// Calls `work` now and again `msOf(result)` after each call until it returns null or `isOver()`.
export async function poll(work, msOf, isOver) {
  while (!isOver()) {
    const result = await attempt(work);
    const ms = msOf(result);
    if (ms === null) return;
    await new Promise((resolve) => setTimeout(resolve, ms));
  }
}
