// Texts of the page in the language that the participant reads.

let texts = {};
let language = "en";

export const currentLanguage = () => language;

// Takes the texts of all languages, `{LANGUAGE: {KEY: TEXT}}`.
export function useTexts(all) {
  texts = all;
}

// Sets the language of the page, its direction with it.
export function useLanguage(wanted) {
  language = wanted;
  document.documentElement.lang = wanted;
  document.documentElement.dir = has("dir") ? t("dir") : "ltr";
}

// The first of the browser's languages that the study has, or the study's first.
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

// Text of a key with `{name}` filled in.
export function t(key, values = {}) {
  const text = find(key) ?? key;
  return text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

// Text of the first key that there is: a task's own before that of its scale or design.
export const firstText = (...keys) => t(keys.find(has) ?? keys.at(-1));
