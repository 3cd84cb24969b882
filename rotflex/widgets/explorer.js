// The page's side of every explorer: draws a scene that Python sends, and sends back what the reader does with it.
//
// A scene is plain data (see scene.py): plots with handles that can be dragged, controls, readouts. There is one message
// at a time under way: while Python works on one, only the latest of those that follow is kept.

const ROLES = {
  measured: { color: "--measured", width: 1.8 },
  model: { color: "--model", width: 2, dash: [9, 3, 2, 3] },
  voltage: { color: "--voltage", width: 1.6 },
  reference: { color: "--reference", width: 1.2, dash: [6, 3] },
  highlight: { color: "--highlight", width: 2, dash: [2, 3] },
  ghost: { color: "--ghost", width: 1.4, dash: [3, 4] },
  grid: { color: "--grid", width: 1 },
  axis: { color: "--reference", width: 1 },
};
const MARKS = { met: "✓", missed: "✗", unknown: "?" };
const NARROW = 620; // px; below, columns stand below each other
const PATIENCE = 4000; // ms without an answer, after which the reader is told
const SILENCE = 2000; // ms without a new picture of a running bench, after which the reader is told
const ALIVE = 400; // ms between two signs of life while a bench runs
const FONT = "12px ui-sans-serif, system-ui, sans-serif";

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
    this.themed = new MutationObserver(() => { this.colors = {}; this.draw(); });
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
      this.model.send({ ...event, view: this.id, n: this.sent });
    } catch { // the kernel is gone
      this.unanswered();
    }
  }

  unanswered() {
    this.say({ kind: "error", text: "Python does not answer. Either another cell is running, or the kernel was restarted: wait, or run this cell again." });
    this.open = false;
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
    cancelAnimationFrame(this.drawing);
    this.drawing = requestAnimationFrame(() => this.draw());
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
    this.notice.hidden = !text;
  }

  showControls() {
    const rows = this.scene.controls ?? [];
    const shape = JSON.stringify(rows.map((row) => row.map(({ value, disabled, look, ...fixed }) => fixed)));
    if (shape !== this.shape) {
      const focused = document.activeElement?.dataset?.name;
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
        for (const value of row.values) make("td", "", line, value);
        if (row.mark) make("td", "mark", line, `${MARKS[row.mark]} ${row.words}`);
      }
    });
  }

  // --- drawing ------------------------------------------------------------------------------------------------------

  color(name) {
    return (this.colors[name] ??= getComputedStyle(this.host).getPropertyValue(name).trim() || "#888");
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
        (panel.kind === "mechanism" ? this.mechanism : this.plot).call(this, pen, panel, box, seen);
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

  plot(pen, panel, box, seen) {
    const inner = { left: box.left + 52, top: box.top + 26, width: box.width - 66, height: box.height - 26 - (panel.xlabel ? 40 : 12) };
    if (inner.width < 20 || inner.height < 20) return;
    let [x0, x1] = panel.x;
    let [y0, y1] = panel.y;
    if (panel.equal) { // a unit is as long in both directions: show more of one of them
      const unit = Math.max((x1 - x0) / inner.width, (y1 - y0) / inner.height);
      const more = unit * inner.width - (x1 - x0);
      x0 -= more;
      const middle = (y0 + y1) / 2;
      [y0, y1] = [middle - (unit * inner.height) / 2, middle + (unit * inner.height) / 2];
    }
    const X = (x) => inner.left + ((x - x0) / (x1 - x0)) * inner.width;
    const Y = (y) => inner.top + inner.height - ((y - y0) / (y1 - y0)) * inner.height;
    const scales = { X, Y, x: (px) => x0 + ((px - inner.left) / inner.width) * (x1 - x0), y: (px) => y0 + ((inner.top + inner.height - px) / inner.height) * (y1 - y0) };
    pen.font = FONT;
    pen.lineWidth = 1;
    pen.strokeStyle = this.color("--grid");
    pen.fillStyle = this.color("--text");
    for (const [low, high, place, down, count] of [[x0, x1, X, false, inner.width / 75], [y0, y1, Y, true, Math.max(3, inner.height / 30)]]) {
      for (const tick of ticks(low, high, Math.max(2, count))) {
        const at = place(tick.value);
        pen.beginPath();
        if (down) { pen.moveTo(inner.left, at); pen.lineTo(inner.left + inner.width, at); }
        else { pen.moveTo(at, inner.top); pen.lineTo(at, inner.top + inner.height); }
        if (!panel.bare) pen.stroke();
        pen.textAlign = down ? "right" : "center";
        pen.textBaseline = down ? "middle" : "top";
        if (down && at > inner.top + 4) pen.fillText(tick.text, inner.left - 6, at);
        else if (!down && panel.xlabel) pen.fillText(tick.text, at, inner.top + inner.height + 5);
      }
    }
    pen.save();
    pen.beginPath();
    pen.rect(inner.left, inner.top, inner.width, inner.height);
    pen.clip();
    for (const item of panel.items) ITEMS[item.kind](this, pen, item, scales, inner);
    pen.restore();
    pen.strokeStyle = this.color("--text");
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(inner.left, inner.top);
    pen.lineTo(inner.left, inner.top + inner.height);
    pen.lineTo(inner.left + inner.width, inner.top + inner.height);
    pen.stroke();
    pen.fillStyle = this.color("--text");
    pen.textBaseline = "bottom";
    pen.textAlign = "center";
    if (panel.xlabel) pen.fillText(panel.xlabel, inner.left + inner.width / 2, inner.top + inner.height + 38);
    pen.textAlign = "left";
    pen.fillText(panel.ylabel, box.left + 6, inner.top - 6);
    this.legend(pen, panel, inner, box.left + 6 + pen.measureText(panel.ylabel).width + 14);
    for (const handle of panel.handles ?? []) { seen.add(handle.name); this.placeHandle(handle, scales, inner); }
  }

  legend(pen, panel, inner, from) {
    let right = inner.left + inner.width;
    for (const item of [...panel.items].reverse()) {
      if (!item.label) continue;
      const wide = pen.measureText(item.label).width;
      right -= wide;
      if (right - 28 < from) return;
      pen.textAlign = "left";
      pen.textBaseline = "bottom";
      pen.fillStyle = this.color("--text");
      pen.fillText(item.label, right, inner.top - 6);
      const y = inner.top - 12;
      if (item.kind === "mark") ITEMS.glyph(this, pen, item, right - 14, y);
      else if (item.kind === "line" || item.kind === "level") { this.ink(pen, item); segment(pen, right - 28, y, right - 5, y); }
      else { pen.globalAlpha = item.alpha ?? 0.3; pen.fillStyle = this.color(ROLES[item.role].color); pen.fillRect(right - 26, y - 5, 21, 10); pen.globalAlpha = 1; }
      pen.setLineDash([]);
      right -= 42;
    }
  }

  ink(pen, item) {
    const role = ROLES[item.role];
    pen.strokeStyle = this.color(role.color);
    pen.lineWidth = item.width ?? role.width;
    pen.setLineDash(item.dash ?? role.dash ?? []);
    pen.lineJoin = "round";
  }

  slice([offset, count]) {
    return this.numbers.subarray(offset, offset + count);
  }

  mechanism(pen, panel, box) {
    const pose = this.pose ?? panel;
    const size = Math.min(box.width, box.height - 24);
    const [cx, cy, reach] = [box.left + box.width / 2, box.top + 24 + size * 0.5, size * 0.42];
    pen.font = FONT;
    pen.fillStyle = this.color("--text");
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    const degrees = (angle) => `${(angle * 180 / Math.PI).toFixed(1)}°`;
    pen.fillText(`θ ${degrees(pose.theta)}   α ${degrees(pose.alpha)}`, box.left + 6, box.top + 20);
    const along = (angle, length) => [cx + length * Math.sin(-angle), cy - length * Math.cos(angle)];
    // Counted anticlockwise from straight up, as seen from above.
    this.ink(pen, { role: "grid" });
    pen.beginPath(); pen.arc(cx, cy, reach, 0, 2 * Math.PI); pen.stroke();
    this.ink(pen, { role: "reference" });
    segment(pen, cx, cy, ...along(pose.theta, reach));
    pen.setLineDash([]);
    pen.save();
    pen.translate(cx, cy);
    pen.rotate(-pose.theta);
    pen.fillStyle = this.color("--body");
    pen.strokeStyle = this.color("--text");
    pen.beginPath(); pen.rect(-reach * 0.24, -reach * 0.3, reach * 0.48, reach * 0.6); pen.fill(); pen.stroke();
    pen.restore();
    const tip = along(pose.theta + pose.alpha, reach * 0.94);
    this.ink(pen, { role: "measured", width: 7 });
    pen.lineCap = "round";
    segment(pen, cx, cy, ...tip);
    pen.lineCap = "butt";
    const mount = reach * 0.26;
    for (const side of [-1, 1]) { // the two springs, from the body's corners to the arm
      const corner = [mount * 0.8 * side, -reach * 0.24];
      const [cos, sin] = [Math.cos(pose.theta), Math.sin(pose.theta)];
      const at = [cx + corner[0] * cos + corner[1] * sin, cy - corner[0] * sin + corner[1] * cos];
      const [ex, ey] = along(pose.theta + pose.alpha, reach * 0.62);
      this.ink(pen, { role: "voltage", width: 1.5 });
      zigzag(pen, at[0], at[1], ex, ey, 9, 4);
    }
    pen.fillStyle = this.color("--text");
    pen.beginPath(); pen.arc(cx, cy, 4, 0, 2 * Math.PI); pen.fill();
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
    const [theta, alpha] = [this.slice(play.theta).slice(), this.slice(play.alpha).slice()];
    const show = (t) => {
      const i = Math.min(theta.length - 1, Math.max(0, Math.round((t / play.duration) * (theta.length - 1))));
      this.pose = { theta: theta[i], alpha: alpha[i] };
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

// --- what is drawn in a plot ----------------------------------------------------------------------------------------

const ITEMS = {
  line(view, pen, item, { X, Y }) {
    const [xs, ys] = [view.slice(item.x), view.slice(item.y)];
    view.ink(pen, item);
    pen.beginPath();
    for (let i = 0; i < xs.length; i++) pen.lineTo(X(xs[i]), Y(ys[i]));
    pen.stroke();
    pen.setLineDash([]);
  },
  area(view, pen, item, { X, Y }) {
    const [xs, ys] = [view.slice(item.x), view.slice(item.y)];
    pen.globalAlpha = item.alpha ?? 0.3;
    pen.fillStyle = view.color(ROLES[item.role].color);
    pen.beginPath();
    for (let i = 0; i < xs.length; i++) pen.lineTo(X(xs[i]), Y(ys[i]));
    pen.fill();
    pen.globalAlpha = 1;
  },
  band(view, pen, item, { X, Y }, inner) {
    pen.globalAlpha = item.alpha ?? 0.3;
    pen.fillStyle = view.color(ROLES[item.role].color);
    const [from, to] = item.span;
    if (item.axis === "y") pen.fillRect(inner.left, Y(to), inner.width, Y(from) - Y(to));
    else pen.fillRect(X(from), inner.top, X(to) - X(from), inner.height);
    pen.globalAlpha = 1;
  },
  level(view, pen, item, { X, Y }, inner) {
    const at = item.clock && view.cursor != null ? view.cursor : item.at;
    view.ink(pen, item);
    if (item.axis === "y") segment(pen, inner.left, Y(at), inner.left + inner.width, Y(at));
    else segment(pen, X(at), inner.top, X(at), inner.top + inner.height);
    pen.setLineDash([]);
  },
  text(view, pen, item, { X, Y }) {
    pen.fillStyle = view.color("--faint");
    pen.textAlign = item.anchor ?? "center";
    pen.textBaseline = "middle";
    pen.fillText(item.text, X(item.at[0]), Y(item.at[1]));
  },
  mark(view, pen, item, { X, Y }) {
    ITEMS.glyph(view, pen, item, X(item.at[0]), Y(item.at[1]));
  },
  glyph(view, pen, item, x, y) {
    view.ink(pen, { ...item, width: 2, dash: [] });
    const r = item.size ?? 5;
    if (item.shape === "cross") { segment(pen, x - r, y - r, x + r, y + r); segment(pen, x - r, y + r, x + r, y - r); return; }
    pen.beginPath();
    if (item.shape === "square") pen.rect(x - r, y - r, 2 * r, 2 * r);
    else pen.arc(x, y, r, 0, 2 * Math.PI);
    pen.stroke();
  },
};

// --- controls: each makes its elements, and returns a function that brings them up to date -----------------------------

const CONTROLS = {
  slider(control, row, view) {
    const label = make("label", "slider", row);
    make("span", "", label, control.label);
    const range = make("input", "", label);
    const number = make("input", "", label);
    make("span", "unit", label, control.unit);
    Object.assign(range, { type: "range", min: control.min, max: control.max, step: control.step });
    Object.assign(number, { type: "number", min: control.min, max: control.max, step: control.step });
    const name = control.unit ? `${control.label}, ${control.unit}` : control.label;
    for (const [input, what] of [[range, ""], [number, ", number"]]) {
      input.setAttribute("aria-label", name + what);
      input.dataset.name = control.name + (what ? "-number" : "");
    }
    const send = (value) => { if (Number.isFinite(value)) view.tell({ kind: "set", name: control.name, value }); };
    range.addEventListener("input", () => { number.value = range.value; send(range.valueAsNumber); });
    number.addEventListener("change", () => send(number.valueAsNumber));
    for (const input of [range, number]) input.addEventListener("keydown", (event) => event.stopPropagation());
    return ({ value, disabled }) => {
      range.disabled = number.disabled = Boolean(disabled);
      const busy = view.open || view.pending;
      if (!(busy && document.activeElement === range)) range.value = value;
      if (document.activeElement !== number || !busy) number.value = tidy(value, control.step);
    };
  },
  choice(control, row, view) {
    const label = make("label", "choice", row);
    make("span", "", label, control.label);
    const select = make("select", "", label);
    select.dataset.name = control.name;
    for (const [value, text] of control.options) { const option = make("option", "", select, text); option.value = value; }
    select.addEventListener("change", () => view.tell({ kind: "set", name: control.name, value: select.value }));
    select.addEventListener("keydown", (event) => event.stopPropagation());
    return ({ value, disabled }) => { select.value = value; select.disabled = Boolean(disabled); };
  },
  button(control, row, view) {
    const button = make("button", "", row, control.label);
    button.dataset.name = control.name;
    button.title = control.title ?? "";
    const event = { kind: "press", name: control.name };
    button.addEventListener("click", () => {
      if (button.getAttribute("aria-disabled") === "true") return; // it keeps the focus, as a disabled one would not
      if (control.look === "stop") view.urgent(event);
      else view.tell(event);
    });
    return ({ disabled, look }) => {
      button.setAttribute("aria-disabled", String(Boolean(disabled)));
      button.className = look ?? "";
    };
  },
};

// --- small things ---------------------------------------------------------------------------------------------------

function make(tag, name, parent, text) {
  const element = document.createElement(tag);
  if (name) element.className = name;
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

function segment(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

function zigzag(pen, x0, y0, x1, y1, turns, wide) {
  const [dx, dy] = [(x1 - x0) / (turns + 1), (y1 - y0) / (turns + 1)];
  const long = Math.hypot(dx, dy) || 1;
  pen.beginPath();
  pen.moveTo(x0, y0);
  for (let i = 1; i <= turns; i++) {
    const side = i % 2 ? wide : -wide;
    pen.lineTo(x0 + i * dx - (side * dy) / long, y0 + i * dy + (side * dx) / long);
  }
  pen.lineTo(x1, y1);
  pen.stroke();
}

function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) {
    found.push({ value: i * step, text: (i * step).toFixed(digits).replace("-", "−") });
  }
  return found;
}

function tidy(value, step) {
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Number(value).toFixed(digits);
}
