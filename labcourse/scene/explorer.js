// The page's side of every explorer: draws a scene that Python sends, and sends back what the reader does with it.
//
// A scene is plain data (see scene.py): plots with handles that can be dragged, controls, readouts. There is one message
// at a time under way: while Python works on one, only the latest of those that follow is kept.

const MARKS = { met: "✓", missed: "✗", unknown: "?" };
const NARROW = 620; // px; below, columns stand below each other if two of them are in view at once
const PATIENCE = 4000; // ms without an answer, after which the reader is told
const SILENCE = 2000; // ms without a new picture of a running bench, after which the reader is told
const ALIVE = 400; // ms between two signs of life while a bench runs
const LEAST = 240; // px, of the plots' height where there is too little room
const MARGIN = 14; // px, of what JupyterLab puts around an output
const PANELS = { plot, moving };
const BUSY =
  "Python has not answered yet: another cell is running, or the computer is busy. Wait. If nothing else is running, " +
  "run this cell again.";
const GONE = ".jupyter-widgets-disconnected"; // ipywidgets' mark of a widget that Python does not know any more
const LOST = "Python was restarted or ended, so what you do here is lost: run this cell again.";

export function render({ model, el }) {
  const view = new View(model, el);
  return () => view.close();
}

export default { render };

class View {
  constructor(model, el) {
    this.model = model;
    this.busy = model.get("busy") ?? BUSY; // what a page says that is no notebook
    this.id = crypto.randomUUID?.() ?? String(Math.random());
    this.sent = 0;
    this.open = false; // an event is under way
    this.pending = null; // the latest that waits for its answer
    this.queue = []; // presses that wait
    this.host = make("div", "labcourse-explorer", el);
    this.host.tabIndex = -1; // a click beside the controls is for the explorer, too
    guard(this.host);
    this.host.addEventListener("keydown", (event) => event.stopPropagation());
    this.notice = make("div", "notice", this.host);
    this.notice.setAttribute("role", "status");
    this.above = make("div", "controls", this.host);
    this.body = make("div", "body", this.host);
    this.plots = make("div", "plots", this.body);
    this.stage = make("div", "stage", this.plots);
    this.canvas = make("canvas", "", this.stage);
    this.canvas.setAttribute("role", "img");
    this.player = new Player(this, this.plots);
    this.readouts = make("div", "readouts", this.body);
    this.controls = new Map();
    this.handles = new Handles(this);
    this.grabs = new Grabs(this);
    this.colors = {};
    this.onScene = () => this.update();
    this.onEscape = (key) => { // anywhere on the page, while a bench runs
      if (key.key === "Escape") this.urgent({ kind: "press", name: "stop" });
    };
    model.on("change:scene", this.onScene);
    this.resized = new ResizeObserver(() => this.draw());
    for (const element of [this.stage, this.readouts]) this.resized.observe(element);
    this.themed = new MutationObserver(() => { this.colors = {}; this.drawSoon(); });
    this.themed.observe(document.body, { attributes: true, attributeFilter: ["data-jp-theme-light", "class"] });
    this.update();
  }

  close() {
    this.model.off("change:scene", this.onScene);
    this.resized.disconnect();
    this.themed.disconnect();
    clearTimeout(this.waiting);
    this.grabs.letGo();
    this.endLife();
    this.player.close();
    cancelAnimationFrame(this.drawing);
  }

  // --- messages -----------------------------------------------------------------------------------------------------

  tell(given) {
    const event = { at: Date.now(), ...given }; // when it happened, however long it waits here
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
    this.expect();
    this.post(event);
  }

  expect() { // an answer
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.say({ kind: "error", text: this.busy }), PATIENCE);
  }

  urgent(event) { // goes out at once, whatever is under way; and what waited before it is not to come after it
    this.forget();
    this.post(event);
  }

  forget() {
    this.queue = [];
    this.pending = this.handles.last = null;
  }

  post(event) {
    try {
      if (this.host.closest(GONE)) throw new Error(LOST);
      this.model.send({ at: Date.now(), ...event, view: this.id, n: this.sent });
    } catch {
      this.lose();
    }
  }

  lose() { // what waits: nobody will answer it
    clearTimeout(this.waiting);
    this.endLife();
    this.lost = true;
    this.open = false;
    this.host.setAttribute("aria-busy", "false");
    this.forget();
    this.handles.letGo();
    this.say({ kind: "error", text: LOST });
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
      this.handles.last = null;
      if (this.handles.released) this.handles.letGo();
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
    if (!this.open) clearTimeout(this.waiting);
    this.showControls();
    this.showReadouts();
    this.player.show(this.scene.play);
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
      this.say({ kind: "error", text: this.scene.live });
    }
  }

  endLife() {
    clearInterval(this.alive);
    this.alive = null;
    document.removeEventListener("keydown", this.onEscape, true);
  }

  rest() { // nothing is held any more
    if (!this.lost) this.say(this.scene.notice);
    this.draw();
  }

  say(notice) {
    const text = notice?.text ?? "";
    const stays = this.handles.dragged && !text; // in size: what is below would move away from under the hand
    this.notice.style.visibility = stays ? "hidden" : "";
    if (stays) return;
    if (this.said !== text) write(this.notice, (this.said = text));
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
      const outer = this.readoutAt(i, readout);
      const text = JSON.stringify(readout);
      if (outer.dataset.text === text) return;
      outer.dataset.text = text;
      const box = outer.querySelector("table");
      box.replaceChildren();
      if (!readout.folded) make("caption", "", box, readout.title);
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

  readoutAt(i, { folded, title }) { // its element: made, or made anew where it is now folded and was not
    const kind = folded ? "DETAILS" : "DIV";
    const before = this.readouts.children[i];
    if (before?.tagName === kind) return before;
    const outer = document.createElement(kind);
    if (folded) guard(make("summary", "", outer, title));
    make("table", "readout", outer);
    if (before) before.replaceWith(outer);
    else this.readouts.append(outer);
    return outer;
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
    const [stacked, each] = this.fitting(width);
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
    this.handles.keep(seen);
    this.grabs.keep(seen);
    this.host.dataset.version = String(this.scene.version);
    this.host.dispatchEvent(new CustomEvent("painted", { detail: this.scene.version }));
  }

  fitting(width) { // whether columns stand below each other, and their height
    // The whole explorer is in view at once; on a narrow page, what is dragged is so with the plots that answer.
    const { height, columns } = this.scene;
    if (this.handles.dragged && this.fitted) return this.fitted;
    const narrow = width < NARROW;
    const style = getComputedStyle(this.host);
    const beside = getComputedStyle(this.body).display === "flex";
    const around = parseFloat(style.paddingTop) + parseFloat(style.paddingBottom) + MARGIN;
    const others = [this.above, this.player.box, ...(narrow || beside ? [] : [this.readouts])];
    const taken = others.reduce((sum, element) => sum + element.offsetHeight, around);
    const room = this.page().clientHeight - taken;
    const least = Math.min(height, LEAST);
    const stacked = narrow && columns.length > 1 && room >= 2 * least;
    this.fitted = [stacked, Math.max(least, Math.min(height, stacked ? room / 2 : room))];
    return this.fitted;
  }

  page() { // what scrolls around the explorer
    if (!this.around) {
      this.around = this.host.closest(".jp-WindowedPanel-outer") ?? document.documentElement;
      this.resized.observe(this.around);
    }
    return this.around;
  }

  slice([offset, count]) {
    return this.numbers.subarray(offset, offset + count);
  }
}
