// The sliders: each picks an entry of the table that was computed with the report.
(() => {
  const { thresholds, videos } = JSON.parse(document.getElementById("data").textContent);
  const sliders = [...document.querySelectorAll("input[data-threshold]")];
  if (!sliders.length) return;
  const at = (id) => document.getElementById(id);
  const number = (value, digits) => value.toFixed(digits);
  const length = (secs) => {
    const n = Math.abs(secs);
    return n < 120 ? `${number(secs, 1)} s` : n < 7200 ? `${number(secs / 60, 1)} min` : `${number(secs / 3600, 2)} h`;
  };
  const change = (secs, digits) => {
    const sign = secs > digits / 2 ? "up" : secs < -digits / 2 ? "down" : "";
    return [sign, sign === "up" ? `+${length(secs)}` : sign === "down" ? `\u2212${length(-secs)}` : "no change"];
  };
  const unit = (threshold, i) => `${threshold.values[i].replace(/\.0$/, "")} ${threshold.unit}`.trim();

  const rows = videos.map((video) => {
    const row = at("by-video").tBodies[0].insertRow();
    const link = document.createElement("a");
    link.href = `#${video.id}`;
    link.textContent = video.name;
    row.insertCell().append(link);
    const cells = [row.insertCell(), row.insertCell()];
    cells.forEach((cell) => { cell.className = "num"; });
    return cells;
  });

  const place = (slider, i) => {
    const threshold = thresholds[slider.dataset.threshold], card = slider.closest(".knob");
    const curve = card.querySelector("svg"), dot = curve.querySelector(".dot");
    slider.setAttribute("aria-valuetext", `${unit(threshold, i)}, ${length(threshold.secs[i])} kept`);
    card.querySelector(".value").textContent = unit(threshold, i);
    card.querySelector(".secs").textContent = length(threshold.secs[i]);
    card.classList.toggle("moved", i !== threshold.now);
    dot.setAttribute("cx", curve.dataset.xs.split(" ")[i]);
    dot.setAttribute("cy", curve.dataset.ys.split(" ")[i]);
  };

  const pick = (slider) => {
    const which = Number(slider.dataset.threshold), threshold = thresholds[which], i = Number(slider.value);
    for (const other of sliders) {
      const now = thresholds[other.dataset.threshold].now;
      if (other !== slider && Number(other.value) !== now) {
        other.value = now;
        place(other, now);
      }
    }
    place(slider, i);
    const secs = threshold.secs[i], [sign, words] = change(secs - threshold.secs[threshold.now], 0.002);
    at("now").textContent = length(secs);
    at("now").dataset.secs = secs.toFixed(3);
    at("change").textContent = i === threshold.now ? "as configured" : sign ? `${words} against now` : words;
    at("change").className = sign;
    at("toml").textContent = i === threshold.now
      ? "# as configured"
      : `[segment]\n${threshold.key} = ${threshold.values[i]}`;
    videos.forEach((video, v) => {
      const tenths = video.tenths[which], [cell, difference] = rows[v];
      const [sign, words] = change((tenths[i] - tenths[threshold.now]) / 10, 0.1);
      cell.textContent = length(tenths[i] / 10);
      difference.textContent = i === threshold.now ? "" : words;
      difference.className = `num ${sign}`;
    });
  };
  for (const slider of sliders) slider.addEventListener("input", () => pick(slider));
  for (const slider of sliders) slider.value = thresholds[slider.dataset.threshold].now;
  pick(sliders[0]);

  at("copy").addEventListener("click", () => {
    const words = at("toml"), button = at("copy");
    const chosen = getSelection();
    chosen.selectAllChildren(words);
    const done = document.execCommand("copy");
    button.textContent = done ? "Copied" : "Selected";
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
})();
