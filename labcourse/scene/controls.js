// Sliders, choices, buttons: each makes its elements, and returns a function that brings them up to date.

const CONTROLS = {
  slider(control, row, view) {
    const label = make("label", "slider", row);
    make("span", "", label, control.label);
    const range = make("input", "", label);
    const number = make("input", "", label);
    make("span", "unit", label, control.unit);
    const span = { min: control.low, max: control.high, step: control.step };
    Object.assign(range, { type: "range", ...span });
    Object.assign(number, { type: "number", ...span });
    const name = control.unit ? `${control.label}, ${control.unit}` : control.label;
    for (const [input, what] of [[range, ""], [number, ", number"]]) {
      input.setAttribute("aria-label", name + what);
      input.dataset.name = control.name + (what ? "-number" : "");
    }
    const send = (value) => { if (Number.isFinite(value)) view.tell({ kind: "set", name: control.name, value }); };
    range.addEventListener("input", () => { number.value = range.value; send(range.valueAsNumber); });
    number.addEventListener("change", () => send(number.valueAsNumber));
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

const FOCUSED = new Set(["button", "input", "select"]);

function make(tag, name, parent, text) {
  const element = document.createElement(tag);
  if (FOCUSED.has(tag)) guard(element);
  if (name) element.className = name;
  if (text !== undefined) write(element, text);
  parent.append(element);
  return element;
}

function write(element, text) { // symbols as M_a with their subscripts
  const parts = text.split(/\b([A-Z])_([a-z]+)\b/); // text, symbol, subscript, text, ...
  element.replaceChildren(parts[0]);
  for (let i = 1; i < parts.length; i += 3) {
    element.append(parts[i]);
    const below = document.createElement("sub");
    below.textContent = parts[i + 1];
    element.append(below, parts[i + 2]);
  }
}

// Keys are for the explorer, and not for the notebook around it: there, D D deletes the cell. JupyterLab looks at the
// element that has the focus before it looks at those around it, so that each must say so itself.
function guard(element) {
  element.dataset.lmSuppressShortcuts = "true";
}

function tidy(value, step) {
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Number(value).toFixed(digits);
}
