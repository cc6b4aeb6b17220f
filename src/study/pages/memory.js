// What the page keeps in the browser, so that a reload or a crash goes on where it was: the participant's token, the
// language, an answer on its way. Nothing of it tells the browser or the person.

const name = `orator-study ${location.pathname}`;

function read() {
  try {
    return JSON.parse(localStorage.getItem(name)) ?? {};
  } catch {
    return {};
  }
}

let kept = read();
// Another tab of the same browser goes on with the same session.
window.addEventListener("storage", () => (kept = read()));

export const recall = (key) => kept[key];

export function keep(key, value) {
  kept = { ...kept, [key]: value };
  try {
    localStorage.setItem(name, JSON.stringify(kept));
  } catch {
    // A browser that keeps nothing: the session then ends with the page.
  }
}

export function forget() {
  kept = {};
  try {
    localStorage.removeItem(name);
  } catch {
    // Nothing was kept.
  }
}
