// State stored in the browser, so that a session survives a reload or a crash: the participant's token, the language,
// the number of plays, a pending answer. None of it identifies the browser or the person.

const name = `orator-study ${location.pathname}`;

function read() {
  try {
    return JSON.parse(localStorage.getItem(name)) ?? {};
  } catch {
    return {};
  }
}

let stored = read();
// Other tabs of the same browser share the session.
window.addEventListener("storage", () => (stored = read()));

export const recall = (key) => stored[key];

const linkOf = (token) => `#resume=${token}`;
const setFragment = (fragment) => history.replaceState(null, "", location.pathname + location.search + fragment);

// Stores a value; returns false where storage is unavailable. The address then holds the token, which survives a reload.
export function keep(key, value) {
  stored = { ...stored, [key]: value };
  try {
    localStorage.setItem(name, JSON.stringify(stored));
    return true;
  } catch {
    if (key === "token") setFragment(linkOf(value));
    return false;
  }
}

// Takes the token out of a link to resume a session. The address keeps it where it cannot be stored.
export function takeLinkedToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get("resume");
  if (token && !stored.token && keep("token", token)) setFragment("");
}

export function forget() {
  if (location.hash === linkOf(stored.token)) setFragment("");
  stored = {};
  try {
    localStorage.removeItem(name);
  } catch {
    // Storage is unavailable.
  }
}
