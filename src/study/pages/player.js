// Synchronised playback of one or two films, with measurement of stalls, lost focus and asynchrony.

// Asynchrony in seconds above which the mute film's rate is adjusted (half a frame at 30 fps), and below which the rate
// returns to normal.
const MAX_OFFSET = 1 / 60;
const SYNCED_OFFSET = 1 / 200;
// Seconds after the start during which films that are far apart are restarted, and the maximum number of restarts.
const START = 0.4;
const MAX_RESTARTS = 2;
// Asynchrony in seconds that is too large to correct by the playback rate.
const LARGE_OFFSET = 0.12;
const TICK_MS = 40;
const LOAD_MS = 60_000;
// Time without progress, while the page is visible, after which films count as broken.
const STUCK_MS = 30_000;

// Total duration of a condition.
class Stopwatch {
  #since = null;
  #ms = 0;

  set(runs) {
    const now = performance.now();
    if (this.#since !== null) this.#ms += now - this.#since;
    this.#since = runs ? now : null;
  }

  get secs() {
    return this.#ms / 1000;
  }
}

const isInFront = () => !document.hidden && document.hasFocus();

// Playback of one film or two. Only the first has sound, because both have the same speech.
export class Screening {
  #timer = null;
  #waiting = new Set();
  #restarts = 0;
  #starting = false;
  #stalled = new Stopwatch();
  #unfocused = new Stopwatch();
  #settle = null;
  // Position of the film that lags behind, the time of its last progress, and whether playback made no progress for too
  // long.
  #progress = { at: 0, since: 0 };
  #wasStuck = false;

  constructor(urls) {
    // Callbacks: playback stalled (true) or continued (false); playback begins.
    this.onstall = (_isStalled) => {};
    this.onbegin = () => {};
    this.plays = 0;
    // Maximum asynchrony in seconds right after the start, and later.
    this.offset = { start: 0, max: 0 };
    this.videos = urls.map((url, at) => {
      const video = document.createElement("video");
      video.preload = "auto";
      video.playsInline = true;
      video.disablePictureInPicture = true;
      video.muted = at > 0;
      video.tabIndex = -1;
      video.addEventListener("loadedmetadata", () => {
        if (video.videoWidth) video.style.setProperty("--ratio", video.videoWidth / video.videoHeight);
      });
      video.addEventListener("waiting", () => this.#wait(video));
      video.addEventListener("stalled", () => video.readyState < 3 && this.#wait(video));
      video.addEventListener("ended", () => this.#tick());
      video.addEventListener("error", () => this.#settle?.reject(new Error("film")));
      video.addEventListener("contextmenu", (event) => event.preventDefault());
      video.src = url;
      return video;
    });
    this.watch = () => this.#checkVisibility();
    for (const event of ["blur", "focus"]) window.addEventListener(event, this.watch);
    document.addEventListener("visibilitychange", this.watch);
  }

  get playing() {
    return this.#timer !== null;
  }

  get stalledSecs() {
    return this.#stalled.secs;
  }

  get unfocusedSecs() {
    return this.#unfocused.secs;
  }

  // Resolves when every film can be played through; rejects if one cannot be loaded.
  load() {
    if (this.#wasStuck) for (const video of this.videos) video.load();
    this.#wasStuck = false;
    return Promise.all(this.videos.map((video) => this.#loaded(video)));
  }

  #loaded(video) {
    if (video.readyState === 4) return Promise.resolve();
    return new Promise((resolve, reject) => {
      const end = (result) => () => {
        clearTimeout(late);
        result(new Error("film"));
      };
      const late = setTimeout(() => (video.readyState >= 3 ? resolve() : reject(new Error("film"))), LOAD_MS);
      video.addEventListener("canplaythrough", end(resolve), { once: true });
      video.addEventListener("error", end(reject), { once: true });
      // Retries a film that failed, and loads one that a phone loads only after a touch.
      if (video.error || video.readyState < 2) video.load();
    });
  }

  // Plays the films from start to end. Rejects if they cannot be loaded, the browser refuses, or they make no progress
  // for too long.
  async play() {
    await this.load();
    this.plays += 1;
    this.onbegin();
    this.#restarts = 0;
    this.#progress = { at: 0, since: performance.now() };
    return new Promise((resolve, reject) => {
      this.#settle = { resolve: () => this.#stop(resolve), reject: (error) => this.#stop(() => reject(error)) };
      this.#timer = setInterval(() => this.#tick(), TICK_MS);
      this.#start().catch((error) => this.#settle?.reject(error));
      this.#checkVisibility();
    });
  }

  async #start() {
    this.#starting = true;
    this.offset = { start: 0, max: 0 };
    await Promise.all(
      this.videos.map((video) => {
        video.pause();
        video.playbackRate = 1;
        if (video.currentTime === 0) return null;
        video.currentTime = 0;
        return new Promise((resolve) => video.addEventListener("seeked", resolve, { once: true }));
      }),
    );
    if (!this.playing) return;
    // A film may be paused meanwhile, for example while the other waits for data; it continues later.
    const isStopped = (error) => error.name === "AbortError";
    const begin = (video) => video.play().catch((error) => isStopped(error) || Promise.reject(error));
    await Promise.all(this.videos.map(begin));
    this.#starting = false;
  }

  // Whether the films have made no progress for too long although the page is visible.
  #isStuck() {
    const at = Math.min(...this.videos.filter((video) => !video.ended).map((video) => video.currentTime));
    const now = performance.now();
    if (at !== this.#progress.at || document.hidden) this.#progress = { at, since: now };
    this.#wasStuck = now - this.#progress.since > STUCK_MS;
    return this.#wasStuck;
  }

  #stop(after) {
    clearInterval(this.#timer);
    this.#timer = null;
    this.#settle = null;
    this.#waiting.clear();
    this.#stalled.set(false);
    this.#unfocused.set(false);
    for (const video of this.videos) video.pause();
    after();
  }

  // Releases the films and listeners; the screening cannot be played again.
  close() {
    if (this.playing) this.#stop(() => {});
    for (const event of ["blur", "focus"]) window.removeEventListener(event, this.watch);
    document.removeEventListener("visibilitychange", this.watch);
    for (const video of this.videos) {
      video.removeAttribute("src");
      video.load();
    }
  }

  // Records whether the page is in front, and pauses the films while it is hidden.
  #checkVisibility() {
    this.#unfocused.set(this.playing && !isInFront());
    if (!this.playing || this.#starting || this.#waiting.size > 0) return;
    for (const video of this.videos) {
      if (document.hidden) video.pause();
      else if (video.paused && !video.ended) video.play().catch(() => {});
    }
  }

  #wait(video) {
    const isAtEnd = video.ended || video.currentTime > video.duration - 0.1;
    if (!this.playing || isAtEnd || this.#waiting.has(video)) return;
    this.#waiting.add(video);
    this.#stalled.set(true);
    this.onstall(true);
    for (const other of this.videos) if (other !== video) other.pause();
  }

  #tick() {
    if (!this.playing) return;
    // The page has replaced its content.
    if (!this.videos[0].isConnected) return this.close();
    if (this.#isStuck()) return this.#settle.reject(new Error("film"));
    if (this.#starting) return;
    if (this.videos.every((video) => video.ended)) return this.#settle.resolve();
    const hasWaited = this.#waiting.size > 0;
    for (const video of this.#waiting) if (video.readyState >= 3) this.#waiting.delete(video);
    if (this.#waiting.size > 0) return;
    if (hasWaited) {
      this.#stalled.set(false);
      this.onstall(false);
    }
    this.#checkVisibility();
    this.#synchronise();
  }

  #synchronise() {
    const [audible, muted] = this.videos;
    if (!muted || [audible, muted].some((video) => video.ended || video.paused || video.seeking)) return;
    const lead = muted.currentTime - audible.currentTime;
    const offset = Math.abs(lead);
    if (audible.currentTime < START) this.offset.start = Math.max(this.offset.start, offset);
    else this.offset.max = Math.max(this.offset.max, offset);
    if (offset > LARGE_OFFSET) {
      if (audible.currentTime < START && this.#restarts < MAX_RESTARTS) {
        this.#restarts += 1;
        this.#start().catch((error) => this.#settle?.reject(error));
      } else muted.currentTime = audible.currentTime;
    } else if (offset > MAX_OFFSET) muted.playbackRate = lead > 0 ? 0.9 : 1.1;
    else if (offset < SYNCED_OFFSET) muted.playbackRate = 1;
  }
}
