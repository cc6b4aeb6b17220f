// Operator's page: number and progress of the participants. No answers are shown.

import { announce, byId, button, el, show } from "./dom.js";

const REFRESH_MS = 10_000;
const KEY = "orator-operator";
const COUNTS = {
  target: "Target number of participants",
  completed: "Completed",
  active: "In progress",
  abandoned: "Abandoned: no answer for too long, session can be reassigned",
  excluded: "Completed, excluded for failed attention checks",
  replaced: "Session reassigned to another participant",
  withdrawn: "Withdrawn, data deleted",
};
let timer = null;

function askForToken(sentence) {
  clearTimeout(timer);
  const input = el("input", { type: "password", id: "token", autocomplete: "off" });
  const onsubmit = (event) => {
    event.preventDefault();
    sessionStorage.setItem(KEY, input.value.trim());
    refresh();
  };
  const line = el("p", { class: "row" }, el("label", { for: "token" }, "Operator token"), input, el("button", { type: "submit", class: "main" }, "Open"));
  show("Progress", [el("form", { onsubmit }, line)], input);
  announce(sentence);
}

async function refresh() {
  clearTimeout(timer);
  const token = sessionStorage.getItem(KEY);
  if (!token) return askForToken("");
  try {
    const reply = await fetch("api/operator", { headers: { Authorization: `Bearer ${token}` } });
    if (reply.status === 401 || reply.status === 403) {
      sessionStorage.removeItem(KEY);
      return askForToken("This is not the operator token of this study.");
    }
    if (!reply.ok) throw new Error(`${reply.status}`);
    draw(await reply.json());
    announce(`Updated at ${new Date().toLocaleTimeString()}; refreshes every ${REFRESH_MS / 1000} s.`);
  } catch {
    announce("The server cannot be reached; retrying.");
  }
  timer = setTimeout(refresh, REFRESH_MS);
}

const table = (heads, rows, label) =>
  el(
    "div",
    { class: "wide", role: "region", "aria-label": label, tabindex: "0" },
    el(
      "table",
      {},
      el("thead", {}, el("tr", {}, ...heads.map((head) => el("th", { scope: "col" }, head)))),
      el("tbody", {}, ...rows.map((row) => el("tr", {}, ...row.map((cell) => el("td", {}, cell))))),
    ),
  );

function duration(secs) {
  if (secs < 90) return `${Math.round(secs)} s`;
  return secs < 5400 ? `${Math.round(secs / 60)} min` : `${Math.round(secs / 3600)} h`;
}

// Link by which a participant can resume in another browser, or see the completion code again.
const resumeLink = (token) =>
  token ? el("a", { href: new URL(`./#resume=${token}`, location.href).href }, "Link to resume") : "";

function draw(progress) {
  const { title, quota, answers, participants, stalls } = progress;
  byId("title").textContent = title;
  document.title = `Progress: ${title}`;
  byId("tools").replaceChildren(
    button("Sign out", () => {
      sessionStorage.removeItem(KEY);
      askForToken("");
    }, "quiet"),
  );
  const counts = Object.entries(COUNTS).map(([key, label]) => [label, quota[key]]);
  counts.push(["Stored answers", answers]);
  counts.push(["Trials with stalled playback", stalls.trials], ["Total stalled time, s", Math.round(stalls.secs)]);
  const done = el("progress", { max: `${quota.target}`, value: `${Math.min(quota.completed, quota.target)}`, "aria-label": "Participants who completed the study" });
  const nodes = [el("p", {}, `${quota.completed} of ${quota.target} participants have completed the study.`), done, el("h2", {}, "Participants"), table(["Status", "Number"], counts, "Participants")];
  const sessions = participants.map((one) => [one.session, one.status, `${one.position} of ${one.n_trials}`, duration(one.idle_secs), resumeLink(one.token)]);
  nodes.push(el("h2", {}, "Sessions"), table(["Session", "Status", "Answered trials", "Last activity", "For the participant"], sessions, "Sessions"));
  if (document.querySelector("h1")?.textContent === "Progress" && !byId("token")) byId("main").replaceChildren(document.querySelector("h1"), ...nodes);
  else show("Progress", nodes);
}

refresh();
