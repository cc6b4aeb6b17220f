// Client of the study's server.

import { keep, recall } from "./memory.js";

const PARAMETERS = ["PROLIFIC_PID", "STUDY_ID", "SESSION_ID", "workerId", "assignmentId", "hitId"];
const REQUEST_MS = 20_000;
const MAX_WAIT_SECS = 30;

// Error reply of the server, with its sentence.
export class ServerError extends Error {
  constructor(status, { error, reason }, retrySecs) {
    super(error ?? `${status}`);
    this.status = status;
    this.reason = reason;
    this.retrySecs = retrySecs;
  }

  get isTemporary() {
    return [408, 425, 429].includes(this.status) || this.status >= 500;
  }
}

async function request(url, options = {}) {
  const reply = await fetch(url, { signal: AbortSignal.timeout(REQUEST_MS), referrerPolicy: "no-referrer", ...options });
  const value = await reply.json().catch(() => ({}));
  if (!reply.ok) throw new ServerError(reply.status, value, Number(reply.headers.get("Retry-After")));
  return value;
}

// Retries `work` until it succeeds or fails permanently; calls `onwait(secs)` before each retry.
export async function withRetries(work, onwait) {
  for (let attempt = 0; ; attempt += 1) {
    try {
      return await work();
    } catch (error) {
      if (error instanceof ServerError && !error.isTemporary) throw error;
      const secs = Math.max(error.retrySecs || 0, Math.min(MAX_WAIT_SECS, 2 ** attempt));
      onwait(secs, error);
      await new Promise((resolve) => {
        const timer = setTimeout(resolve, 1000 * secs);
        window.addEventListener("online", () => (clearTimeout(timer), resolve()), { once: true });
      });
    }
  }
}

// Parameters of a recruiting site in the address.
function parameters() {
  const given = new URLSearchParams(location.search);
  const pairs = PARAMETERS.filter((name) => given.has(name)).map((name) => [name, given.get(name).slice(0, 128)]);
  return Object.fromEntries(pairs);
}

// Random number of 32 hexadecimal digits.
function randomNumber() {
  const digits = (byte) => byte.toString(16).padStart(2, "0");
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), digits).join("");
}

// Random number by which the server recognises a repeated request to begin, where its reply was lost.
function attempt() {
  if (!recall("attempt")) keep("attempt", randomNumber());
  return recall("attempt");
}

// Random number of this load of the page, by which the server recognises films that are seen again after a reload.
const load = randomNumber();

async function post(path, body, options = {}) {
  const headers = { "Content-Type": "application/json" };
  if (recall("token")) headers.Authorization = `Bearer ${recall("token")}`;
  return request(path, { method: "POST", headers, body: JSON.stringify(body), ...options });
}

export const backend = {
  study: () => request("api/study"),
  begin: (language) => post("api/begin", { consent: true, language, parameters: parameters(), attempt: attempt() }),
  state: () => request("api/state", { headers: { Authorization: `Bearer ${recall("token")}` } }),
  // The request is completed even if the page is closed.
  start: (position) => post("api/start", { position, load }, { keepalive: true }),
  answer: (answer) => post("api/answer", answer),
  withdraw: () => post("api/withdraw", {}),
};
