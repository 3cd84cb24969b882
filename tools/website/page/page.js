// The page "Try it": a recorded swing until Python is there, then explorers that a worker's Python drives.

const SILENCE = 20_000; // ms without a byte, after which the reader is told
const AGAIN = "Look at your connection, and try again.";
const BUSY = "Python has not answered yet: this device is busy. Wait.";
const part = (name) => document.getElementById(name);
const { dataset } = document.body;
const address = new URL(dataset.pyodide, location.href).href;
const models = new Map();
let worker = null;
let silence = 0;

class Model { // what explorer.js takes for a widget's
  constructor(name) {
    this.name = name;
    this.values = { busy: BUSY };
    this.heard = new Set();
  }

  get(key) {
    return this.values[key];
  }

  on(_, call) {
    this.heard.add(call);
  }

  off(_, call) {
    this.heard.delete(call);
  }

  send(event) {
    worker.postMessage({ kind: "event", name: this.name, event });
  }

  show(values) {
    Object.assign(this.values, values);
    for (const call of this.heard) call();
  }
}

function stage(name, text) {
  clearTimeout(silence);
  dataset.stage = name;
  part("news").textContent = text;
  part("again").hidden = name !== "failed" && name !== "silent";
  part("loading").hidden = name === "ready";
  part("recorded").hidden = name === "ready";
  for (const one of ["own", "bench", "placing"]) part(one).hidden = name !== "ready";
}

const HEARD = {
  came({ bytes }) {
    const megabytes = bytes / 1e6;
    document.querySelector("progress").value = megabytes;
    part("came").textContent = `${megabytes.toFixed(1)} of about ${dataset.megabytes} MB`;
    if (dataset.stage === "silent") stage("loading", "This swing was recorded. Your own bench is on its way again.");
    if (dataset.stage === "loading") listen();
  },
  starts() {
    stage("starting", "This swing was recorded. All has come, and Python starts: some seconds more.");
    worker.postMessage({ kind: "open", student: "demo" });
  },
  opened({ student, refused, pulls }) {
    if (refused) {
      part("news").textContent = refused;
      return;
    }
    const how = pulls
      ? "Press Start, or pull the arm aside and let go."
      : "Press Start. This browser cannot let Python wait: a run is computed as a whole, and then played.";
    stage("ready", `This is the bench of the ID “${student}”, computed here and now. ${how}`);
  },
  scene({ name, scene, data }) {
    const model = models.get(name) ?? new Model(name);
    model.show({ scene, data });
    if (models.has(name)) return;
    models.set(name, model);
    model.close = self.explorers.render({ model, el: part(name) });
  },
  failed({ text }) {
    worker.terminate();
    stage("failed", `What you see is a recording: your own bench did not come (${text}). ${AGAIN}`);
  },
};

function listen() { // for bytes
  clearTimeout(silence);
  silence = setTimeout(() => {
    stage("silent", `What you see is a recording: for ${SILENCE / 1000} s nothing has come from ${address}. ${AGAIN}`);
  }, SILENCE);
}

function load() {
  worker?.terminate();
  for (const model of models.values()) model.close();
  for (const name of models.keys()) part(name).replaceChildren();
  models.clear();
  stage("loading", "This swing was recorded. Your own bench is on its way.");
  if (location.protocol === "file:") {
    const served = "Say “python -m http.server” in its folder, and open http://localhost:8000.";
    stage("failed", `What you see is a recording: a browser loads Python only into the page of a server. ${served}`);
    return;
  }
  worker = new Worker("worker.js");
  worker.addEventListener("message", ({ data }) => HEARD[data.kind](data));
  worker.addEventListener("error", ({ message }) => HEARD.failed({ text: message ?? "worker.js did not come" }));
  worker.postMessage({ kind: "load", address });
  listen();
}

function light() { // explorers look at JupyterLab's mark
  dataset.jpThemeLight = String(!dark.matches);
}

const dark = matchMedia("(prefers-color-scheme: dark)");
dark.addEventListener("change", light);
light();
part("address").textContent = address;
part("again").addEventListener("click", load);
part("own").addEventListener("submit", (event) => {
  event.preventDefault();
  worker.postMessage({ kind: "open", student: new FormData(event.target).get("student") });
});
load();
