// The server of the study, and, for a host of plain files, what stands in for it.

import { keep, recall } from "./memory.js";

const PARAMETERS = ["PROLIFIC_PID", "STUDY_ID", "SESSION_ID", "workerId", "assignmentId", "hitId"];
const REQUEST_MS = 20_000;
const LONGEST_WAIT_SECS = 30;

// A server that refuses, with its sentence.
export class Refusal extends Error {
  constructor(status, sentence, retrySecs) {
    super(sentence);
    this.status = status;
    this.retrySecs = retrySecs;
  }

  get isPassing() {
    return [408, 425, 429].includes(this.status) || this.status >= 500;
  }
}

async function ask(url, options = {}) {
  const reply = await fetch(url, { signal: AbortSignal.timeout(REQUEST_MS), referrerPolicy: "no-referrer", ...options });
  const value = await reply.json().catch(() => ({}));
  if (!reply.ok) throw new Refusal(reply.status, value.error ?? `${reply.status}`, Number(reply.headers.get("Retry-After")));
  return value;
}

// Does `work` until it succeeds or is refused for good; `onwait(secs)` before each new attempt.
export async function patiently(work, onwait) {
  for (let attempt = 0; ; attempt += 1) {
    try {
      return await work();
    } catch (error) {
      if (error instanceof Refusal && !error.isPassing) throw error;
      const secs = Math.max(error.retrySecs || 0, Math.min(LONGEST_WAIT_SECS, 2 ** attempt));
      onwait(secs, error);
      await new Promise((resolve) => {
        const timer = setTimeout(resolve, 1000 * secs);
        window.addEventListener("online", () => (clearTimeout(timer), resolve()), { once: true });
      });
    }
  }
}

// What a recruiting site gave along in the address.
function parameters() {
  const given = new URLSearchParams(location.search);
  const pairs = PARAMETERS.filter((name) => given.has(name)).map((name) => [name, given.get(name).slice(0, 128)]);
  return Object.fromEntries(pairs);
}

function served() {
  const post = (path, body) => {
    const headers = { "Content-Type": "application/json" };
    if (recall("token")) headers.Authorization = `Bearer ${recall("token")}`;
    return ask(path, { method: "POST", headers, body: JSON.stringify(body) });
  };
  return {
    study: () => ask("api/study"),
    begin: (language) => post("api/begin", { consent: true, language, parameters: parameters() }),
    state: () => ask("api/state", { headers: { Authorization: `Bearer ${recall("token")}` } }),
    answer: (answer) => post("api/answer", answer),
    withdraw: () => post("api/withdraw", {}),
  };
}

const randomName = () =>
  Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, "0")).join("");

// Plain files: the session lies in a file, the browser counts its trials, and what is said goes to `address`.
function bundled(address) {
  let about = null;
  const study = async () => (about ??= await ask("api/study.json"));
  const places = () => recall("place") ?? {};
  // Without a preflight: a collector need not know more than POST.
  const post = (kind, more) =>
    fetch(address, {
      method: "POST",
      headers: { "Content-Type": "text/plain" },
      body: JSON.stringify({ study: about.study, kind, ...recall("token"), ...more }),
      signal: AbortSignal.timeout(REQUEST_MS),
      referrerPolicy: "no-referrer",
    }).then((reply) => {
      if (!reply.ok) throw new Refusal(reply.status, `${reply.status}`, 0);
    });
  const state = async () => {
    await study();
    const { session, participant } = recall("token");
    const { trials } = await ask(`sessions/${session}.json`);
    const position = places().position ?? 0;
    const n_trials = trials.length;
    if (position < n_trials) return { position, n_trials, trial: trials[position] };
    const code = participant.slice(0, 10).toUpperCase();
    return { position, n_trials, completion: { code, return_url: about.return_url?.replace("{code}", code) } };
  };
  return {
    study,
    state,
    async begin(language) {
      const { sessions } = await study();
      const number = Number(new URLSearchParams(location.search).get("place"));
      const isPlace = Number.isInteger(number) && number >= 1 && number <= sessions.length;
      const drawn = crypto.getRandomValues(new Uint32Array(1))[0] % sessions.length;
      const token = { session: sessions[isPlace ? number - 1 : drawn], participant: randomName() };
      keep("token", token);
      await post("begin", { consent: true, language, parameters: parameters() });
      return { token, state: await state() };
    },
    async answer(answer) {
      await study();
      await post("answer", answer);
      keep("place", { position: answer.position + 1 });
      return { state: await state() };
    },
    async withdraw() {
      await study();
      await post("withdraw", {});
    },
  };
}

// The address that collects what is said, where there is no server.
const collector = document.documentElement.dataset.collector;

export const backend = collector ? bundled(collector) : served();
