// Helpers that create DOM elements. Strings from the server or a study file are never parsed as HTML.

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

// One `p` element per paragraph of a text.
export const paragraphs = (text) => text.split(/\n\s*\n/).map((part) => el("p", {}, part.trim()));

export const byId = (id) => document.getElementById(id);

// Shows a status message, which screen readers announce.
export function announce(sentence) {
  byId("status").textContent = sentence;
}

// Replaces the content of the page and moves the focus to `focus` or the heading.
export function show(heading, nodes, focus) {
  const h1 = el("h1", { tabindex: "-1" }, heading);
  byId("main").replaceChildren(h1, ...nodes.filter(Boolean));
  announce("");
  window.scrollTo(0, 0);
  (focus ?? h1).focus({ preventScroll: true });
  return h1;
}

export const button = (label, onclick, kind = "main") => el("button", { type: "button", class: kind, onclick }, label);
