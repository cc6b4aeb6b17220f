// Player: ground truth and prediction side by side, synchronised with the audio if there is any.
(() => {
  const at = (id) => document.getElementById(id);
  if (!at("player")) return;
  const { bones, excerpts } = JSON.parse(document.getElementById("data").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const motions = new Map();
  const sides = ["truth", "predicted"];
  const JOINTS = 49, MISSING = -32768;
  let selected = 0, secs = 0, playing = false, started = 0, audio = null, shown = -1;

  const motion = (side) => {
    const key = `${side}${selected}`;
    if (!motions.has(key)) motions.set(key, new Int16Array(bytes(excerpts[selected][side]).buffer));
    return motions.get(key);
  };
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // Both figures of an excerpt share one scale, so that they can be compared.
  const extent = () => {
    let [left, right, top, bottom] = [-300, 300, -250, 350];
    for (const side of sides) {
      const numbers = motion(side);
      for (let i = 0; i < numbers.length; i += 3) {
        if (numbers[i] === MISSING) continue;
        const radius = Math.hypot(numbers[i], numbers[i + 2]);
        left = Math.min(left, -radius); right = Math.max(right, radius);
        top = Math.min(top, numbers[i + 1]); bottom = Math.max(bottom, numbers[i + 1]);
      }
    }
    return { width: right - left, top, height: bottom - top };
  };
  let box = null;

  const draw = () => {
    const turn = Number(at("turn").value) * Math.PI / 180;
    const excerpt = excerpts[selected];
    const colours = [colour("--ink"), colour("--left"), colour("--right")];
    for (const side of sides) {
      const canvas = at(side), numbers = motion(side), n = numbers.length / (3 * JOINTS);
      const ratio = Math.min(devicePixelRatio || 1, 2), width = canvas.clientWidth * ratio, height = canvas.clientHeight * ratio;
      if (canvas.width !== Math.round(width) || canvas.height !== Math.round(height)) {
        canvas.width = Math.round(width); canvas.height = Math.round(height);
      }
      const pen = canvas.getContext("2d");
      pen.clearRect(0, 0, canvas.width, canvas.height);
      const scale = 0.9 * Math.min(canvas.width / box.width, canvas.height / box.height);
      const above = (canvas.height - scale * box.height) / 2;
      const frame = Math.max(0, Math.min(n - 1, Math.floor(secs * excerpt.fps + 1e-6)));
      const position = (joint) => {
        const i = 3 * (frame * JOINTS + joint);
        if (numbers[i] === MISSING) return null;
        const x = numbers[i] * Math.cos(turn) - numbers[i + 2] * Math.sin(turn);
        return [canvas.width / 2 + scale * x, above + scale * (numbers[i + 1] - box.top)];
      };
      // A head makes the figure recognisable as a person.
      const neck = position(0);
      pen.lineCap = pen.lineJoin = "round";
      if (neck) {
        pen.strokeStyle = colours[0]; pen.globalAlpha = 0.35; pen.lineWidth = 3 * ratio;
        pen.beginPath(); pen.arc(neck[0], neck[1] - scale * 150, scale * 85, 0, 2 * Math.PI); pen.stroke();
        pen.globalAlpha = 1;
      }
      for (const [joint, parent, side] of bones) {
        const [from, to] = [position(parent), position(joint)];
        if (!from || !to) continue;
        pen.strokeStyle = colours[side];
        pen.lineWidth = (joint < 7 ? 5 : 2.2) * ratio;
        pen.beginPath(); pen.moveTo(...from); pen.lineTo(...to); pen.stroke();
      }
    }
    at("at").value = secs;
    at("clock").textContent = `${secs.toFixed(1)} of ${excerpt.secs.toFixed(1)} s`;
    at("at").setAttribute("aria-valuetext", `${secs.toFixed(1)} seconds`);
    for (const card of document.querySelectorAll(".over-time")) {
      if (card.hidden) continue;
      const chart = card.querySelector("svg"), line = chart.querySelector("line.at");
      const [left, right] = [Number(chart.dataset.left), Number(chart.dataset.right)];
      const x = left + (right - left) * secs / Number(card.dataset.secs);
      line.setAttribute("x1", x); line.setAttribute("x2", x);
    }
  };

  const tick = () => {
    if (!playing) return;
    const clock = performance.now() / 1000;
    const isAudible = audio && !audio.paused && audio.readyState > 1;
    secs = isAudible ? audio.currentTime : clock - started;
    if (isAudible) started = clock - secs;
    if (secs >= excerpts[selected].secs) {
      secs = excerpts[selected].secs;
      pause();
    } else {
      requestAnimationFrame(tick);
    }
    draw();
  };
  const pause = () => {
    playing = false;
    if (audio) audio.pause();
    at("play").textContent = "Play";
  };
  const play = () => {
    if (secs >= excerpts[selected].secs - 0.05) secs = 0;
    playing = true;
    started = performance.now() / 1000 - secs;
    at("play").textContent = "Pause";
    if (audio) {
      audio.currentTime = Math.min(secs, audio.duration || secs);
      audio.play().catch(() => { at("message").textContent = "The browser cannot play the audio."; });
    }
    requestAnimationFrame(tick);
  };
  const choose = (next) => {
    pause();
    selected = next; secs = 0;
    const excerpt = excerpts[selected];
    audio = null;
    if (excerpt.audio) {
      audio = new Audio(`data:audio/wav;base64,${excerpt.audio}`);
      audio.preload = "auto";
    }
    at("message").textContent = excerpt.audio ? "" : "No audio.";
    at("at").max = excerpt.secs;
    at("at").step = 1 / excerpt.fps;
    box = extent();
    for (const card of document.querySelectorAll(".over-time")) card.hidden = Number(card.dataset.excerpt) !== selected;
    draw();
  };

  at("play").addEventListener("click", () => (playing ? pause() : play()));
  at("at").addEventListener("input", () => {
    secs = Number(at("at").value);
    started = performance.now() / 1000 - secs;
    if (audio && playing) audio.currentTime = secs;
    draw();
  });
  at("turn").addEventListener("input", () => {
    at("degrees").textContent = `${at("turn").value}\u00b0`;
    draw();
  });
  at("excerpt").addEventListener("change", () => choose(Number(at("excerpt").value)));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  addEventListener("resize", draw);
  choose(0);
})();
