// The page's side of every explorer: draws a scene that Python sends, and sends back what the reader does with it.
//
// A scene is plain data (see scene.py): plots with handles that can be dragged, controls, readouts. There is one message
// at a time under way: while Python works on one, only the latest of those that follow is kept.

const MARKS = { met: "✓", missed: "✗", unknown: "?" };
const NARROW = 620; // px; below, columns stand below each other
const PATIENCE = 4000; // ms without an answer, after which the reader is told
const SILENCE = 2000; // ms without a new picture of a running bench, after which the reader is told
const ALIVE = 400; // ms between two signs of life while a bench runs
const PANELS = { plot, moving };

export function render({ model, el }) {
  const view = new View(model, el);
  return () => view.close();
}

export default { render };

class View {
  constructor(model, el) {
    this.model = model;
    this.id = crypto.randomUUID?.() ?? String(Math.random());
    this.sent = 0;
    this.open = false; // an event is under way
    this.pending = null; // the latest that waits for its answer
    this.queue = []; // presses that wait
    this.dragged = null;
    this.host = make("div", "rotflex-explorer", el);
    this.host.dataset.lmSuppressShortcuts = "true"; // keys are for the explorer, not for the notebook around it
    this.notice = make("div", "notice", this.host);
    this.notice.setAttribute("role", "status");
    this.above = make("div", "controls", this.host);
    this.stage = make("div", "stage", this.host);
    this.canvas = make("canvas", "", this.stage);
    this.canvas.setAttribute("role", "img");
    this.player = make("div", "player", this.host);
    this.readouts = make("div", "readouts", this.host);
    this.controls = new Map();
    this.handles = new Map();
    this.colors = {};
    this.playing = null;
    this.onScene = () => this.update();
    this.onEscape = (key) => { // anywhere on the page, while a bench runs
      if (key.key === "Escape") this.urgent({ kind: "press", name: "stop" });
    };
    model.on("change:scene", this.onScene);
    this.resized = new ResizeObserver(() => this.draw());
    this.resized.observe(this.stage);
    this.themed = new MutationObserver(() => { this.colors = {}; this.drawSoon(); });
    this.themed.observe(document.body, { attributes: true, attributeFilter: ["data-jp-theme-light", "class"] });
    this.update();
  }

  close() {
    this.model.off("change:scene", this.onScene);
    this.resized.disconnect();
    this.themed.disconnect();
    clearTimeout(this.waiting);
    this.endLife();
    cancelAnimationFrame(this.frame);
    cancelAnimationFrame(this.drawing);
  }

  // --- messages -----------------------------------------------------------------------------------------------------

  tell(event) {
    if (this.open) {
      if (event.kind !== "press") {
        const other = this.pending && (this.pending.name !== event.name || this.pending.kind !== event.kind);
        if (other) this.queue.push(this.pending); // only a later word on the same thing replaces an earlier one
        this.pending = event;
        return;
      }
      if (this.pending) this.queue.push(this.pending); // a press comes after the movements before it
      this.pending = null;
      this.queue.push(event);
      return;
    }
    this.open = true;
    this.host.setAttribute("aria-busy", "true");
    this.sent += 1;
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.unanswered(), PATIENCE);
    this.post(event);
  }

  urgent(event) { // goes out at once, whatever is under way; and what waited before it is not to come after it
    this.forget();
    this.post(event);
  }

  forget() {
    this.queue = [];
    this.pending = this.last = null;
  }

  post(event) {
    try {
      this.model.send({ ...event, view: this.id, n: this.sent, at: Date.now() });
    } catch { // the kernel is gone
      this.unanswered();
    }
  }

  unanswered() {
    this.say({ kind: "error", text: "Python does not answer. Either another cell is running, or the kernel was restarted: wait, or run this cell again." });
    this.open = false;
    this.host.setAttribute("aria-busy", "false");
    this.forget();
    this.letGo();
  }

  answered(n) {
    if (n < this.sent || !this.open) return;
    clearTimeout(this.waiting);
    this.open = false;
    const next = this.queue.shift() ?? this.pending;
    if (next && next === this.pending) this.pending = null;
    if (next) this.tell(next);
    else {
      this.host.setAttribute("aria-busy", "false");
      this.last = null;
      if (this.released) this.letGo();
    }
  }

  // --- a new scene --------------------------------------------------------------------------------------------------

  update() {
    this.scene = this.model.get("scene");
    if (!this.scene || !this.scene.columns) return;
    const data = this.model.get("data");
    const bytes = data ? new Uint8Array(data.buffer ?? data, data.byteOffset ?? 0, data.byteLength) : new Uint8Array();
    this.numbers = new Float32Array(bytes.slice().buffer);
    this.updated = performance.now();
    this.say(this.scene.notice);
    if (this.scene.answered?.view === this.id) this.answered(this.scene.answered.n);
    this.showControls();
    this.showReadouts();
    this.showPlayer();
    this.stayAlive();
    this.drawSoon();
  }

  stayAlive() {
    if (this.scene.live && !this.alive) {
      this.alive = setInterval(() => this.showLife(), ALIVE);
      document.addEventListener("keydown", this.onEscape, true);
    } else if (!this.scene.live && this.alive) {
      this.endLife();
    }
  }

  showLife() {
    this.post({ kind: "alive" });
    if (performance.now() - this.updated > SILENCE) {
      this.say({ kind: "error", text: "Nothing is heard of the running bench. STOP may not be heard either: use the bench's own emergency stop." });
    }
  }

  endLife() {
    clearInterval(this.alive);
    this.alive = null;
    document.removeEventListener("keydown", this.onEscape, true);
  }

  say(notice) {
    const text = notice?.text ?? "";
    if (this.notice.textContent !== text) this.notice.textContent = text;
    this.notice.dataset.kind = notice?.kind ?? "";
  }

  showControls() {
    const rows = this.scene.controls ?? [];
    const shape = JSON.stringify(rows.map((row) => row.map(({ value, disabled, look, ...fixed }) => fixed)));
    if (shape !== this.shape) {
      const inside = this.above.contains(document.activeElement); // another view may have the focus
      const focused = inside ? document.activeElement.dataset.name : "";
      this.shape = shape;
      this.controls.clear();
      this.above.replaceChildren();
      for (const row of rows) {
        const line = make("div", "row", this.above);
        for (const control of row) this.controls.set(control.name, CONTROLS[control.kind](control, line, this));
      }
      if (focused) this.above.querySelector(`[data-name="${CSS.escape(focused)}"]`)?.focus();
    }
    for (const row of rows) for (const control of row) this.controls.get(control.name)(control);
  }

  showReadouts() {
    const wanted = this.scene.readouts ?? [];
    while (this.readouts.children.length > wanted.length) this.readouts.lastChild.remove();
    wanted.forEach((readout, i) => {
      const box = this.readouts.children[i] ?? make("table", "readout", this.readouts);
      const text = JSON.stringify(readout);
      if (box.dataset.text === text) return;
      box.dataset.text = text;
      box.replaceChildren();
      make("caption", "", box).textContent = readout.title;
      if (readout.head) {
        const line = make("tr", "", make("thead", "", box));
        for (const cell of readout.head) { const head = make("th", "", line, cell); head.scope = "col"; }
      }
      const body = make("tbody", "", box);
      for (const row of readout.rows) {
        const line = make("tr", row.mark ?? "", body);
        make("th", "", line, row.label).scope = "row";
        for (const value of row.values) make("td", value.includes("\n") ? "matrix" : "", line, value);
        if (row.mark) make("td", "mark", line, `${MARKS[row.mark]} ${row.words}`);
      }
    });
  }

  // --- drawing ------------------------------------------------------------------------------------------------------

  color(name) {
    return (this.colors[name] ??= getComputedStyle(this.host).getPropertyValue(name).trim() || "#888");
  }

  drawSoon() {
    cancelAnimationFrame(this.drawing);
    this.drawing = requestAnimationFrame(() => this.draw());
  }

  draw() {
    if (!this.scene?.columns || !this.host.isConnected) return;
    const width = this.stage.clientWidth;
    if (!width) return;
    const columns = this.scene.columns;
    const stacked = width < NARROW;
    const each = this.scene.height;
    const height = columns.length && each ? (stacked ? each * columns.length : each) : 0;
    const scale = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(width * scale) || this.canvas.height !== Math.round(height * scale)) {
      this.canvas.width = Math.round(width * scale);
      this.canvas.height = Math.round(height * scale);
      this.canvas.style.height = `${height}px`;
      this.stage.style.height = `${height}px`;
    }
    this.canvas.setAttribute("aria-label", this.scene.alt);
    const pen = this.canvas.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    const total = columns.reduce((sum, column) => sum + column.width, 0);
    const seen = new Set();
    let left = 0;
    columns.forEach((column, i) => {
      const wide = stacked ? width : (width * column.width) / total;
      const parts = column.panels.reduce((sum, panel) => sum + panel.height, 0);
      let top = stacked ? i * each : 0;
      for (const panel of column.panels) {
        const high = (each * panel.height) / parts;
        const box = { left: stacked ? 0 : left, top, width: wide, height: high };
        PANELS[panel.kind](this, pen, panel, box, seen);
        top += high;
      }
      left += wide;
    });
    for (const [name, handle] of this.handles) {
      if (!seen.has(name)) { handle.remove(); this.handles.delete(name); }
    }
    this.host.dataset.version = String(this.scene.version);
    this.host.dispatchEvent(new CustomEvent("painted", { detail: this.scene.version }));
  }

  slice([offset, count]) {
    return this.numbers.subarray(offset, offset + count);
  }

  // --- handles ------------------------------------------------------------------------------------------------------

  placeHandle(handle, scales, inner) {
    let knob = this.handles.get(handle.name);
    if (!knob) {
      knob = make("div", "handle", this.stage);
      knob.tabIndex = 0;
      knob.setAttribute("role", "slider");
      knob.dataset.name = handle.name;
      knob.addEventListener("pointerdown", (event) => this.grab(event, handle.name));
      knob.addEventListener("keydown", (event) => this.press(event, handle.name));
      this.handles.set(handle.name, knob);
    }
    knob.handle = handle;
    knob.scales = scales;
    knob.dataset.shape = handle.shape;
    knob.style.setProperty("--own", `var(${ROLES[handle.role].color})`);
    knob.setAttribute("aria-label", handle.label);
    knob.setAttribute("aria-valuetext", handle.text);
    knob.setAttribute("aria-valuenow", String(handle.x));
    knob.setAttribute("aria-orientation", "horizontal");
    knob.title = `${handle.label}: ${handle.text}. Drag it, or use the arrow keys (with Shift: ten times as far).`;
    if (this.dragged !== handle.name) this.moveKnob(knob, handle.x, handle.y, inner);
  }

  moveKnob(knob, x, y, inner) {
    const { X, Y } = knob.scales;
    const px = Math.min(Math.max(X(x), inner?.left ?? 0), inner ? inner.left + inner.width : Infinity);
    const py = Math.min(Math.max(Y(y), inner?.top ?? 0), inner ? inner.top + inner.height : Infinity);
    knob.style.transform = `translate(${px}px, ${py}px)`;
    knob.dataset.x = x;
    knob.dataset.y = y;
  }

  grab(event, name) {
    if (event.button !== 0) return;
    const knob = this.handles.get(name);
    event.preventDefault();
    knob.focus();
    knob.setPointerCapture(event.pointerId);
    this.dragged = name;
    this.released = false;
    const move = (moved) => {
      const frame = this.stage.getBoundingClientRect();
      const ratio = this.stage.clientWidth / frame.width; // JupyterLab may be zoomed
      const { x, y } = knob.scales;
      const at = [x((moved.clientX - frame.left) * ratio), y((moved.clientY - frame.top) * ratio)];
      const { axis } = knob.handle;
      if (axis === "x") at[1] = knob.handle.y;
      if (axis === "y") at[0] = knob.handle.x;
      this.moveKnob(knob, ...at);
      this.tell({ kind: "moved", name, x: at[0], y: at[1] });
    };
    const end = () => {
      knob.removeEventListener("pointermove", move);
      this.released = true; // it stays where it was let go until Python has said where that is
      if (!this.open) this.letGo();
    };
    knob.addEventListener("pointermove", move);
    knob.addEventListener("pointerup", end, { once: true });
    knob.addEventListener("pointercancel", end, { once: true });
  }

  press(event, name) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!steps || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    const handle = this.handleOf(name);
    const [dx, dy] = handle.step;
    const far = event.shiftKey ? 10 : 1;
    // Several presses may come before Python has answered: each starts from where the last one led.
    const from = this.pending?.name === name ? this.pending : this.open && this.last?.name === name ? this.last : handle;
    const event_ = { kind: "moved", name, x: from.x + steps[0] * dx * far, y: from.y + steps[1] * dy * far };
    if (handle.axis === "x") event_.y = handle.y;
    if (handle.axis === "y") event_.x = handle.x;
    this.last = event_;
    this.tell(event_);
  }

  letGo() {
    this.dragged = null;
    this.released = false;
    this.draw();
  }

  handleOf(name) {
    for (const column of this.scene.columns) for (const panel of column.panels) {
      const found = panel.handles?.find((handle) => handle.name === name);
      if (found) return found;
    }
    return this.handles.get(name).handle;
  }

  // --- recorded time ------------------------------------------------------------------------------------------------

  showPlayer() {
    const { play } = this.scene;
    if (JSON.stringify(play ?? null) === this.played) return;
    this.played = JSON.stringify(play ?? null);
    cancelAnimationFrame(this.frame);
    this.playing = null;
    this.pose = null;
    this.cursor = null;
    this.player.replaceChildren();
    if (!play) return;
    const button = make("button", "", this.player, "▶ Play");
    button.dataset.name = "play";
    const range = make("input", "", this.player);
    Object.assign(range, { type: "range", min: 0, max: play.duration, step: "any", value: 0 });
    range.setAttribute("aria-label", "Time in the recording, s");
    const clock = make("output", "", this.player);
    const recorded = Object.entries(play.signals).map(([name, place]) => [name, this.slice(place).slice()]);
    const show = (t) => {
      const share = Math.min(1, Math.max(0, t / play.duration));
      this.pose = Object.fromEntries(recorded.map(([name, values]) => [name, values[Math.round(share * (values.length - 1))]]));
      this.cursor = t;
      range.value = t;
      clock.textContent = `${t.toFixed(2)} s`;
      this.draw();
    };
    const tick = (now) => {
      const t = this.playing.from + (now - this.playing.since) / 1000;
      show(Math.min(t, play.duration));
      if (t < play.duration) this.frame = requestAnimationFrame(tick);
      else stop();
    };
    const stop = () => { cancelAnimationFrame(this.frame); this.playing = null; button.textContent = "▶ Play"; };
    button.addEventListener("click", () => {
      if (this.playing) return stop();
      const at = Number(range.value);
      this.playing = { from: at >= play.duration ? 0 : at, since: performance.now() };
      button.textContent = "❚❚ Pause";
      this.frame = requestAnimationFrame(tick);
    });
    range.addEventListener("input", () => { stop(); show(Number(range.value)); });
  }
}
