"use strict";
// Timelines: the description of an interval is shown under the pointer, on touch, and while moving with the arrow keys.
(() => {
  const tip = document.getElementById("tip");
  for (const part of document.querySelectorAll(".timeline > li")) {
    part.dataset.description = part.title;
    part.removeAttribute("title");
  }
  let shown = null;
  const hide = () => {
    if (shown) shown.classList.remove("at");
    shown = null;
    tip.hidden = true;
  };
  const show = (part, x) => {
    if (shown && shown !== part) shown.classList.remove("at");
    if (shown !== part) tip.textContent = part.dataset.description;
    shown = part;
    part.classList.add("at");
    tip.hidden = false;
    const box = part.getBoundingClientRect();
    const width = tip.offsetWidth, room = document.documentElement.clientWidth - width - 8;
    const left = Math.max(8, Math.min((x ?? box.left + box.width / 2) - width / 2, room));
    const below = box.bottom + 8, above = box.top - tip.offsetHeight - 8;
    tip.style.left = `${left}px`;
    tip.style.top = `${below + tip.offsetHeight > innerHeight && above > 0 ? above : below}px`;
  };
  const intervalAt = (target) => (target instanceof Element ? target.closest(".timeline > li") : null);
  addEventListener("pointermove", (event) => {
    const part = intervalAt(event.target);
    if (part) show(part, event.clientX);
    else if (shown && !shown.parentElement.matches(":focus-visible")) hide();
  });
  addEventListener("pointerdown", (event) => {
    const part = intervalAt(event.target);
    if (part) show(part, event.clientX);
    else hide();
  });
  addEventListener("scroll", () => { if (shown && !shown.parentElement.matches(":focus-visible")) hide(); }, { passive: true });
  addEventListener("keydown", (event) => {
    if (event.key === "Escape") return hide();
    const line = document.activeElement;
    const step = { ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity }[event.key];
    if (!step || !line || !line.matches(".timeline") || !line.children.length) return;
    event.preventDefault();
    const at = shown && shown.parentElement === line ? [...line.children].indexOf(shown) : step > 0 ? -1 : line.children.length;
    show(line.children[Math.max(0, Math.min(at + step, line.children.length - 1))]);
  });
  addEventListener("focusin", (event) => {
    if (shown && event.target !== shown.parentElement) hide();
  });
})();
