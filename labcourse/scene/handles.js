// Handles: what can be dragged on a plot, or moved by the arrow keys.

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

class Handles {
  constructor(view) {
    this.view = view;
    this.knobs = new Map();
    this.dragged = null; // the name of the one that is held
    this.released = false; // it was let go, and Python has not said yet where it is
    this.last = null; // the latest step by a key
  }

  place(handle, scales, inner) {
    let knob = this.knobs.get(handle.name);
    if (!knob) {
      knob = make("div", "handle", this.view.stage);
      knob.tabIndex = 0;
      knob.setAttribute("role", "slider");
      knob.dataset.name = handle.name;
      guard(knob);
      knob.addEventListener("pointerdown", (event) => this.grab(event, handle.name));
      knob.addEventListener("keydown", (event) => this.press(event, handle.name));
      this.knobs.set(handle.name, knob);
    }
    Object.assign(knob, { handle, scales, inner });
    knob.dataset.shape = handle.shape;
    knob.style.setProperty("--own", `var(${ROLES[handle.role].color})`);
    knob.setAttribute("aria-label", handle.label);
    knob.setAttribute("aria-valuetext", handle.text);
    knob.setAttribute("aria-valuenow", String(handle.x));
    knob.setAttribute("aria-orientation", "horizontal");
    knob.title = `${handle.label}: ${handle.text}. Drag it, or use the arrow keys (with Shift: ten times as far).`;
    if (this.dragged !== handle.name) this.show(knob, handle.x, handle.y);
  }

  keep(names) { // those that are not on the plots any more go
    for (const [name, knob] of this.knobs) {
      if (names.has(name)) continue;
      knob.remove();
      this.knobs.delete(name);
    }
  }

  show(knob, x, y) {
    const [px, py] = within(knob.inner, knob.scales.X(x), knob.scales.Y(y));
    knob.style.transform = `translate(${px}px, ${py}px)`;
    knob.dataset.x = x;
    knob.dataset.y = y;
  }

  grab(event, name) {
    if (event.button !== 0) return;
    const knob = this.knobs.get(name);
    event.preventDefault();
    knob.focus();
    knob.setPointerCapture(event.pointerId);
    this.dragged = name;
    this.released = false;
    const { stage } = this.view;
    const move = (moved) => {
      const frame = stage.getBoundingClientRect();
      const ratio = stage.clientWidth / frame.width; // JupyterLab may be zoomed
      const [px, py] = within(knob.inner, (moved.clientX - frame.left) * ratio, (moved.clientY - frame.top) * ratio);
      const at = [knob.scales.x(px), knob.scales.y(py)];
      const { axis } = knob.handle;
      if (axis === "x") at[1] = knob.handle.y;
      if (axis === "y") at[0] = knob.handle.x;
      this.show(knob, ...at);
      this.view.tell({ kind: "moved", name, x: at[0], y: at[1] });
    };
    const end = () => {
      knob.removeEventListener("pointermove", move);
      this.released = true; // it stays where it was let go until Python has said where that is
      if (!this.view.open) this.letGo();
    };
    knob.addEventListener("pointermove", move);
    knob.addEventListener("pointerup", end, { once: true });
    knob.addEventListener("pointercancel", end, { once: true });
  }

  press(event, name) {
    const steps = ARROWS[event.key];
    if (!steps || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const { handle } = this.knobs.get(name);
    const [dx, dy] = handle.step;
    const far = event.shiftKey ? 10 : 1;
    // Several presses may come before Python has answered: each starts from where the last one led.
    const { pending, open } = this.view;
    const from = pending?.name === name ? pending : open && this.last?.name === name ? this.last : handle;
    const moved = { kind: "moved", name, x: from.x + steps[0] * dx * far, y: from.y + steps[1] * dy * far };
    if (handle.axis === "x") moved.y = handle.y;
    if (handle.axis === "y") moved.x = handle.x;
    this.last = moved;
    this.view.tell(moved);
  }

  letGo() {
    this.dragged = null;
    this.released = false;
    this.view.rest();
  }
}

function within(inner, px, py) { // the nearest place in a plot
  return [
    Math.min(Math.max(px, inner.left), inner.left + inner.width),
    Math.min(Math.max(py, inner.top), inner.top + inner.height),
  ];
}
