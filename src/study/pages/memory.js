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

let kept = read();
// Other tabs of the same browser share the session.
window.addEventListener("storage", () => (kept = read()));

export const recall = (key) => kept[key];

export function keep(key, value) {
  kept = { ...kept, [key]: value };
  try {
    localStorage.setItem(name, JSON.stringify(kept));
  } catch {
    // Storage is unavailable: the session then ends with the page.
  }
}

export function forget() {
  kept = {};
  try {
    localStorage.removeItem(name);
  } catch {
    // Nothing was stored.
  }
}
