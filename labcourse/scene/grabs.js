// Grabs: points of a drawing that can be held and pulled, by the pointer or the arrow keys. Where they are, Python says.

class Grabs {
  constructor(view) {
    this.view = view;
    this.knobs = new Map();
    this.held = null; // {name, at: where it is pulled to, in the drawing's units}
  }

  place(grab, [px, py], to, from) { // from px to the drawing's units, and back
    let knob = this.knobs.get(grab.name);
    if (!knob) {
      knob = make("div", "handle", this.view.stage);
      knob.tabIndex = 0;
      knob.dataset.name = grab.name;
      knob.dataset.shape = "grab";
      knob.setAttribute("role", "slider");
      guard(knob);
      knob.addEventListener("pointerdown", (event) => this.take(event, knob));
      knob.addEventListener("keydown", (event) => this.press(event, knob));
      knob.addEventListener("keyup", (event) => { if (ARROWS[event.key]) this.letGo(); });
      knob.addEventListener("blur", () => this.letGo());
      this.knobs.set(grab.name, knob);
    }
    Object.assign(knob, { grab, from, at: from([px, py]) });
    knob.setAttribute("aria-label", grab.label);
    knob.setAttribute("aria-valuetext", grab.text);
    knob.setAttribute("aria-valuenow", knob.at[0].toFixed(3));
    knob.title = `${grab.label}. Drag it, or hold an arrow key.`;
    knob.style.transform = `translate(${px}px, ${py}px)`;
    return this.held?.name === grab.name ? to(this.held.at) : null;
  }

  keep(names) { // those that are not on the drawings any more go
    for (const [name, knob] of this.knobs) {
      if (names.has(name)) continue;
      if (this.held?.name === name) this.letGo();
      knob.remove();
      this.knobs.delete(name);
    }
  }

  take(event, knob) {
    if (event.button !== 0 || this.held) return;
    event.preventDefault();
    knob.focus();
    knob.setPointerCapture(event.pointerId);
    const under = (moved) => {
      const { stage } = this.view;
      const frame = stage.getBoundingClientRect();
      const ratio = stage.clientWidth / frame.width; // JupyterLab may be zoomed
      return knob.from([(moved.clientX - frame.left) * ratio, (moved.clientY - frame.top) * ratio]);
    };
    const move = (moved) => this.pull(under(moved));
    knob.addEventListener("pointermove", move);
    knob.addEventListener("lostpointercapture", () => { // however it is let go
      knob.removeEventListener("pointermove", move);
      this.letGo();
    }, { once: true });
    this.hold(knob, under(event));
  }

  press(event, knob) { // each press, and each repetition of a key that is held, pulls further
    const steps = ARROWS[event.key];
    if (!steps || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const [x, y] = this.held?.at ?? knob.at;
    const at = [x + steps[0] * knob.grab.step, y + steps[1] * knob.grab.step];
    if (this.held) this.pull(at);
    else this.hold(knob, at);
  }

  hold(knob, at) {
    this.held = { name: knob.dataset.name, at };
    this.view.handles.dragged = this.held.name; // nothing on the page may move away from under the hand
    this.view.expect();
    this.say({ begins: true });
  }

  pull(at) {
    if (!this.held) return;
    this.held.at = at;
    this.say();
    this.view.drawSoon();
  }

  say(more = {}) {
    const { name, at: [x, y] } = this.held;
    this.view.post({ kind: "grab", name, x, y, ...more });
  }

  letGo() {
    if (!this.held) return;
    const { name } = this.held;
    this.held = null;
    this.view.handles.letGo();
    this.view.post({ kind: "grab", name });
  }
}
