// Recorded time: drawings that move go through a scene's signals.

const PAUSE = 300; // ms without a change, after which a recording that plays by itself begins
const PLAY = "▶ Play";

class Player {
  constructor(view, parent) {
    this.view = view;
    this.box = make("div", "player", parent);
    this.playing = null;
    this.recorded = null; // [name, values] of each signal
  }

  show(play) { // the scene's, or none
    if (!play) {
      this.close();
      this.box.replaceChildren();
      this.recorded = null;
      this.view.pose = this.view.cursor = null;
      return;
    }
    const recorded = Object.entries(play.signals).map(([name, place]) => [name, this.view.slice(place).slice()]);
    const first = !this.recorded;
    if (first) this.make();
    else if (play.duration === this.play.duration && alike(recorded, this.recorded)) return;
    this.close();
    this.play = play;
    this.recorded = recorded;
    this.range.max = play.duration;
    this.range.value = 0;
    this.say(0);
    this.view.pose = this.view.cursor = null;
    if (first ? play.at_once : play.auto) this.waiting = setTimeout(() => this.beginUnlessHeld(), PAUSE);
  }

  make() {
    this.button = make("button", "", this.box, PLAY);
    this.button.dataset.name = "play";
    this.range = make("input", "", this.box);
    Object.assign(this.range, { type: "range", min: 0, step: "any" });
    this.range.setAttribute("aria-label", "Time in the recording, s");
    this.clock = make("output", "", this.box);
    this.button.addEventListener("click", () => (this.playing ? this.stop() : this.begin()));
    this.range.addEventListener("input", () => { this.stop(); this.go(Number(this.range.value)); });
  }

  beginUnlessHeld() {
    if (this.view.handles.dragged) this.waiting = setTimeout(() => this.beginUnlessHeld(), PAUSE);
    else if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.begin();
  }

  begin() {
    clearTimeout(this.waiting);
    const at = Number(this.range.value);
    this.playing = { from: at >= this.play.duration ? 0 : at, since: performance.now() };
    this.button.textContent = "❚❚ Pause";
    this.frame = requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    const t = this.playing.from + (now - this.playing.since) / 1000;
    this.go(Math.min(Math.max(t, 0), this.play.duration));
    if (t < this.play.duration) this.frame = requestAnimationFrame((later) => this.tick(later));
    else this.stop();
  }

  go(t) {
    const share = Math.min(1, Math.max(0, t / this.play.duration));
    const at = (values) => values[Math.round(share * (values.length - 1))];
    this.view.pose = Object.fromEntries(this.recorded.map(([name, values]) => [name, at(values)]));
    this.view.cursor = t;
    this.range.value = t;
    this.say(t);
    this.view.draw();
  }

  say(t) {
    this.clock.textContent = `${t.toFixed(2)} s`;
  }

  stop() {
    this.close();
    this.button.textContent = PLAY;
  }

  close() {
    clearTimeout(this.waiting);
    cancelAnimationFrame(this.frame);
    this.playing = null;
    if (this.button) this.button.textContent = PLAY;
  }
}

function alike(one, other) {
  return one.length === other.length && one.every(([name, values], i) =>
    name === other[i][0] && values.length === other[i][1].length && values.every((value, k) => value === other[i][1][k]));
}
