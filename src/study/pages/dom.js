// Elements, made without any HTML text: what comes from a server or a study file is never read as markup.

// An element with attributes (`onclick` and the like are listeners; `true` is an attribute without a value).
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

// One `p` for each paragraph of a text.
export const paragraphs = (text) => text.split(/\n\s*\n/).map((part) => el("p", {}, part.trim()));

export const byId = (id) => document.getElementById(id);

// Tells the state to everybody, to screen readers too.
export function say(sentence) {
  byId("status").textContent = sentence;
}

// Replaces what the page shows, and moves the focus to its heading or to `focus`.
export function show(heading, nodes, focus) {
  const h1 = el("h1", { tabindex: "-1" }, heading);
  byId("main").replaceChildren(h1, ...nodes.filter(Boolean));
  say("");
  window.scrollTo(0, 0);
  (focus ?? h1).focus({ preventScroll: true });
  return h1;
}

export const button = (label, onclick, kind = "main") => el("button", { type: "button", class: kind, onclick }, label);
