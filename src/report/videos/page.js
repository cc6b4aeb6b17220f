// Sliders: each selects an entry of the table that was computed with the report.
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

  const position = (slider, i) => {
    const threshold = thresholds[slider.dataset.threshold], card = slider.closest(".knob");
    const curve = card.querySelector("svg"), dot = curve.querySelector(".dot");
    slider.setAttribute("aria-valuetext", `${unit(threshold, i)}, ${length(threshold.secs[i])} accepted`);
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
        position(other, now);
      }
    }
    position(slider, i);
    const secs = threshold.secs[i], [sign, text] = change(secs - threshold.secs[threshold.now], 0.002);
    at("now").textContent = length(secs);
    at("now").dataset.secs = secs.toFixed(3);
    at("change").textContent = i === threshold.now ? "as configured" : sign ? `${text} vs. configured` : text;
    at("change").className = sign;
    at("toml").textContent = i === threshold.now
      ? "# as configured"
      : `[segment]\n${threshold.key} = ${threshold.values[i]}`;
    videos.forEach((video, v) => {
      const tenths = video.tenths[which], [cell, difference] = rows[v];
      const [sign, text] = change((tenths[i] - tenths[threshold.now]) / 10, 0.1);
      cell.textContent = length(tenths[i] / 10);
      difference.textContent = i === threshold.now ? "" : text;
      difference.className = `num ${sign}`;
    });
  };
  for (const slider of sliders) slider.addEventListener("input", () => pick(slider));
  for (const slider of sliders) slider.value = thresholds[slider.dataset.threshold].now;
  pick(sliders[0]);

  at("copy").addEventListener("click", () => {
    const code = at("toml"), button = at("copy");
    const chosen = getSelection();
    chosen.selectAllChildren(code);
    const done = document.execCommand("copy");
    button.textContent = done ? "Copied" : "Selected";
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
})();

// Previews: each figure is animated while it is visible.
(() => {
  const { previews } = JSON.parse(document.getElementById("data").textContent);
  const JOINTS = 49, MISSING = -32768;
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const isStatic = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const inView = new Set();
  const figures = [...document.querySelectorAll("canvas[data-preview]")].map((canvas) => {
    const { fps, joints } = previews.motions[Number(canvas.dataset.preview)];
    const bytes = Uint8Array.from(atob(joints), (letter) => letter.charCodeAt(0));
    const numbers = new Int16Array(bytes.buffer);
    let [halfWidth, top, bottom] = [300, -250, 350];
    for (let i = 0; i < numbers.length; i += 2) {
      if (numbers[i] === MISSING) continue;
      halfWidth = Math.max(halfWidth, Math.abs(numbers[i]));
      top = Math.min(top, numbers[i + 1]); bottom = Math.max(bottom, numbers[i + 1]);
    }
    return { canvas, fps, numbers, n: numbers.length / (2 * JOINTS), halfWidth, top, bottom };
  });
  const draw = ({ canvas, fps, numbers, n, halfWidth, top, bottom }, secs) => {
    const pen = canvas.getContext("2d"), frame = Math.floor(secs * fps) % n;
    const scale = 0.92 * Math.min(canvas.width / (2 * halfWidth), canvas.height / (bottom - top));
    const position = (joint) => {
      const i = 2 * (frame * JOINTS + joint);
      return numbers[i] === MISSING ? null
        : [canvas.width / 2 + scale * numbers[i], (canvas.height - scale * (bottom + top)) / 2 + scale * numbers[i + 1]];
    };
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.lineCap = "round";
    const colours = [colour("--ink"), colour("--left"), colour("--right")];
    for (const [joint, parent, side] of previews.bones) {
      const [from, to] = [position(parent), position(joint)];
      if (!from || !to) continue;
      pen.strokeStyle = colours[side];
      pen.lineWidth = joint < 7 ? 4 : 1.6;
      pen.beginPath(); pen.moveTo(...from); pen.lineTo(...to); pen.stroke();
    }
    canvas.dataset.frame = frame;
  };
  for (const figure of figures) draw(figure, 0);
  if (isStatic || !figures.length) return;
  const watch = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) inView[isIntersecting ? "add" : "delete"](target);
  });
  for (const { canvas } of figures) watch.observe(canvas);
  const tick = (now) => {
    for (const figure of figures) if (inView.has(figure.canvas)) draw(figure, now / 1000);
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
})();
