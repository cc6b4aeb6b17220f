// Start of the page: tabs for the views, which the fragment of the address selects.

import { announce, attempt, button, byId, el, getJson } from "./dom.js";
import { DatasetView } from "./dataset.js";
import { FileView } from "./player.js";
import { LiveView } from "./live.js";
import { ResultView } from "./result.js";
import { RunView } from "./run.js";

const VIEWS = [["dataset", "Dataset", DatasetView], ["run", "Run", RunView], ["result", "Result", ResultView]];
const panels = new Map();
let project = null;

function shownViews() {
  if (project.live) return [["live", "Live", LiveView]];
  return project.file ? [["file", "File", FileView]] : VIEWS;
}
// Parts of the fragment: the view, and what it shows.
const route = () => location.hash.slice(1).split("/");

// Shows the view of the fragment; a view is created when it is first shown.
function showView() {
  const views = shownViews();
  const [name, , View] = views.find(([known]) => known === route()[0]) ?? views[0];
  for (const tab of byId("tabs").children) {
    const isShown = tab.id === `tab-${name}`;
    tab.setAttribute("aria-selected", `${isShown}`);
    tab.tabIndex = isShown ? 0 : -1;
  }
  for (const [other, { panel, view }] of panels) {
    if (other === name) continue;
    if (!panel.hidden) view.leave();
    panel.hidden = true;
  }
  if (!panels.has(name)) {
    const panel = el("section", { role: "tabpanel", id: `panel-${name}`, "aria-labelledby": `tab-${name}` });
    byId("main").append(panel);
    panels.set(name, { panel, view: new View(panel, project) });
  }
  const { panel, view } = panels.get(name);
  panel.hidden = false;
  announce("");
  view.enter(decodeURIComponent(route().slice(1).join("/")));
}

function moveBetweenTabs(event) {
  const tabs = [...byId("tabs").children];
  const at = tabs.indexOf(document.activeElement);
  const next = { ArrowRight: at + 1, ArrowLeft: at - 1 + tabs.length, Home: 0, End: tabs.length - 1 }[event.key];
  if (next === undefined || at < 0) return;
  event.preventDefault();
  tabs[next % tabs.length].focus();
  tabs[next % tabs.length].click();
}

async function start() {
  project = await attempt(() => getJson("./api/project"));
  if (!project) return;
  byId("main").replaceChildren();
  const { title, config, author, editable, file, live } = project;
  const single = file ?? live;
  byId("title").textContent = single ? single.name : title;
  document.title = `${single ? single.name : title} – orator`;
  const access = editable ? `editable as ${author}` : "read-only; start with --edit to correct it";
  byId("project").textContent = single ? "" : `${config}, ${access}`;
  const tab = ([name, label]) =>
    button(label, () => route()[0] === name || (location.hash = name), { role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}` });
  byId("tabs").replaceChildren(...shownViews().map(tab));
  byId("tabs").hidden = Boolean(single);
  byId("tabs").addEventListener("keydown", moveBetweenTabs);
  addEventListener("hashchange", showView);
  showView();
}

start();
