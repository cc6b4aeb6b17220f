// Texts of the page in the participant's language.

let texts = {};
let language = "en";

export const currentLanguage = () => language;

// Sets the texts of all languages, `{LANGUAGE: {KEY: TEXT}}`.
export function useTexts(all) {
  texts = all;
}

// Sets the language and the text direction of the page.
export function useLanguage(wanted) {
  language = wanted;
  document.documentElement.lang = wanted;
  document.documentElement.dir = has("dir") ? t("dir") : "ltr";
}

// First of the browser's preferred languages that the study has, otherwise the study's first language.
export function preferredLanguage(languages) {
  const base = (code) => code.toLowerCase().split("-")[0];
  for (const wanted of navigator.languages) {
    const found = languages.find((one) => one.toLowerCase() === wanted.toLowerCase());
    const near = found ?? languages.find((one) => base(one) === base(wanted));
    if (near) return near;
  }
  return languages[0];
}

export const nameOfLanguage = (code) => texts[code]?.["language.name"] ?? code;

const find = (key) => texts[language]?.[key] ?? texts.en?.[key];

export const has = (key) => Boolean(find(key));

// Text of a key, with placeholders `{name}` replaced.
export function t(key, values = {}) {
  const text = find(key) ?? key;
  return text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

// Text of the first key that exists: a task's own text precedes that of its scale or design.
export const firstText = (...keys) => t(keys.find(has) ?? keys.at(-1));
