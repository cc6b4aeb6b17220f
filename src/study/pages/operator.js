// Operator's page: number and progress of the participants. No answers are shown.

import { byId, button, el, say, show } from "./dom.js";

const REFRESH_MS = 10_000;
const KEY = "orator-operator";
const COUNTS = {
  wanted: "Participants wanted",
  completed: "Completed",
  active: "Taking part now",
  abandoned: "Without an answer for too long; their places are free",
  excluded: "Completed with too many failed attention checks",
  replaced: "Whose place was given to another",
  withdrawn: "Withdrawn, their data deleted",
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
  const line = el("p", { class: "row" }, el("label", { for: "token" }, "The operator's token"), input, el("button", { type: "submit", class: "main" }, "Open"));
  show("Progress", [el("form", { onsubmit }, line)], input);
  say(sentence);
}

async function refresh() {
  clearTimeout(timer);
  const token = sessionStorage.getItem(KEY);
  if (!token) return askForToken("");
  try {
    const reply = await fetch("api/operator", { headers: { Authorization: `Bearer ${token}` } });
    if (reply.status === 401 || reply.status === 403) {
      sessionStorage.removeItem(KEY);
      return askForToken("That token is not this study's.");
    }
    if (!reply.ok) throw new Error(`${reply.status}`);
    draw(await reply.json());
    say(`As of ${new Date().toLocaleTimeString()}; looked up anew every ${REFRESH_MS / 1000} s.`);
  } catch {
    say("The server cannot be reached; the page tries again.");
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
  token ? el("a", { href: new URL(`./#resume=${token}`, location.href).href }, "Link to the session") : "";

function draw(progress) {
  const { title, quota, answers, participants, stalls } = progress;
  byId("title").textContent = title;
  document.title = `Progress: ${title}`;
  byId("tools").replaceChildren(
    button("Forget the token", () => {
      sessionStorage.removeItem(KEY);
      askForToken("");
    }, "quiet"),
  );
  const counts = Object.entries(COUNTS).map(([key, label]) => [label, quota[key]]);
  counts.push(["Answers stored", answers]);
  counts.push(["Trials with a stalled film", stalls.trials], ["Seconds stalled in all", Math.round(stalls.secs)]);
  const done = el("progress", { max: `${quota.wanted}`, value: `${Math.min(quota.completed, quota.wanted)}`, "aria-label": "Completed of the wanted" });
  const nodes = [el("p", {}, `${quota.completed} of ${quota.wanted} participants have completed the study.`), done, el("h2", {}, "Quota"), table(["What", "Number"], counts, "Quota")];
  const places = participants.map((one) => [one.place, one.status, `${one.position} of ${one.n_trials}`, duration(one.idle_secs), resumeLink(one.token)]);
  nodes.push(el("h2", {}, "Places"), table(["Place", "State", "Trials answered", "Since the last", "For the participant"], places, "Places"));
  if (document.querySelector("h1")?.textContent === "Progress" && !byId("token")) byId("main").replaceChildren(document.querySelector("h1"), ...nodes);
  else show("Progress", nodes);
}

refresh();
