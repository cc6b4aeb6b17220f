// Films shown together: started at once, held together to a frame, with what went wrong measured.

// Seconds by which two films may be apart, half a frame at 30 a second; and how near the pace brings them.
const MOST_APART = 1 / 60;
const NEAR = 1 / 200;
// Seconds after the start in which films that are far apart begin anew, and how often they may.
const START = 0.4;
const MOST_RESTARTS = 2;
// Seconds that are far apart: too many for the mute film to make up by its pace.
const FAR = 0.12;
const TICK_MS = 40;
const LOAD_MS = 60_000;
// Time in which films that somebody sees do not go on, after which they are taken for broken.
const STAND_MS = 30_000;

// Sum of the times in which something was the case.
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

// One film or two. The first is heard, the other is mute: both have the same speech.
export class Screening {
  #timer = null;
  #waiting = new Set();
  #restarts = 0;
  #starting = false;
  #stalled = new Stopwatch();
  #unfocused = new Stopwatch();
  #settle = null;
  // Position of the film that is behind, when it last moved, and whether it stood for too long.
  #progress = { at: 0, since: 0 };
  #hasStood = false;

  constructor(urls) {
    // Told when the films stand still for want of data and when they go on, and when they begin.
    this.onstall = (_stands) => {};
    this.onbegin = () => {};
    this.plays = 0;
    // Largest distance in seconds right after the start, and later.
    this.apart = { start: 0, most: 0 };
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
    this.watch = () => this.#look();
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

  // Waits until every film can be played through. Rejects where one cannot be loaded.
  load() {
    if (this.#hasStood) for (const video of this.videos) video.load();
    this.#hasStood = false;
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
      // A film that failed, and one that a phone loads only at a touch.
      if (video.error || video.readyState < 2) video.load();
    });
  }

  // Plays the films from their beginning to their end. Rejects where they cannot be loaded, the browser refuses, or they
  // stand still for too long.
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
      this.#look();
    });
  }

  async #start() {
    this.#starting = true;
    this.apart = { start: 0, most: 0 };
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
    // A film that is stopped meanwhile, as while the other waits for data, goes on later.
    const isStopped = (error) => error.name === "AbortError";
    const begin = (video) => video.play().catch((error) => isStopped(error) || Promise.reject(error));
    await Promise.all(this.videos.map(begin));
    this.#starting = false;
  }

  // Whether the films have not gone on for too long, though the page is seen.
  #stands() {
    const at = Math.min(...this.videos.filter((video) => !video.ended).map((video) => video.currentTime));
    const now = performance.now();
    if (at !== this.#progress.at || document.hidden) this.#progress = { at, since: now };
    this.#hasStood = now - this.#progress.since > STAND_MS;
    return this.#hasStood;
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

  // Ends for good, as when the page shows something else.
  close() {
    if (this.playing) this.#stop(() => {});
    for (const event of ["blur", "focus"]) window.removeEventListener(event, this.watch);
    document.removeEventListener("visibilitychange", this.watch);
    for (const video of this.videos) {
      video.removeAttribute("src");
      video.load();
    }
  }

  // Notes whether the page is in front. Films that nobody can see stand still until somebody can.
  #look() {
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
    // The page shows something else by now.
    if (!this.videos[0].isConnected) return this.close();
    if (this.#stands()) return this.#settle.reject(new Error("film"));
    if (this.#starting) return;
    if (this.videos.every((video) => video.ended)) return this.#settle.resolve();
    const hasWaited = this.#waiting.size > 0;
    for (const video of this.#waiting) if (video.readyState >= 3) this.#waiting.delete(video);
    if (this.#waiting.size > 0) return;
    if (hasWaited) {
      this.#stalled.set(false);
      this.onstall(false);
    }
    this.#look();
    this.#holdTogether();
  }

  #holdTogether() {
    const [heard, mute] = this.videos;
    if (!mute || [heard, mute].some((video) => video.ended || video.paused || video.seeking)) return;
    const lead = mute.currentTime - heard.currentTime;
    const apart = Math.abs(lead);
    if (heard.currentTime < START) this.apart.start = Math.max(this.apart.start, apart);
    else this.apart.most = Math.max(this.apart.most, apart);
    if (apart > FAR) {
      if (heard.currentTime < START && this.#restarts < MOST_RESTARTS) {
        this.#restarts += 1;
        this.#start().catch((error) => this.#settle?.reject(error));
      } else mute.currentTime = heard.currentTime;
    } else if (apart > MOST_APART) mute.playbackRate = lead > 0 ? 0.9 : 1.1;
    else if (apart < NEAR) mute.playbackRate = 1;
  }
}
