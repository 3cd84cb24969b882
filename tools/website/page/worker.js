// Python in a worker: loads Pyodide, its libraries and the wheels that lie beside this file, and then passes the page's
// events on to the explorers, and their scenes to the page. A classic script, so that any static server will do.

"use strict";

const WHEELS = ["labcourse.whl", "rotflex.whl"];
const plainly = self.fetch;
let came = 0; // bytes

const post = (kind, more = {}, moved = []) => self.postMessage({ kind, ...more }, moved);

function fail(error) { // Pyodide waits for ever for a file that does not come, so the page hears of it from here
  const lines = String(error?.message ?? error).trim().split("\n");
  console.error(lines.join("\n"));
  post("failed", { text: lines.findLast((line) => /^[\w.]*Error\b/.test(line)) ?? lines.pop() }); // of Python's traceback
}

// Files are counted while they come. By their integrity, the browser would hand them over only when they are whole.
async function counted(address, options) {
  const response = await plainly(address, { ...options, integrity: "" });
  if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
  const reader = response.body.getReader();
  const body = new ReadableStream({
    async pull(stream) {
      try {
        const { done, value } = await reader.read();
        if (done) { stream.close(); return; }
        came += value.length;
        post("came", { bytes: came });
        stream.enqueue(value);
      } catch (error) {
        fail(`${address}: ${error.message}`);
        stream.error(error);
      }
    },
  });
  const headers = new Headers(response.headers);
  if (response.url.endsWith(".wasm")) headers.set("Content-Type", "application/wasm"); // whatever the server calls it
  return new Response(body, { headers });
}

self.fetch = async (address, options) => {
  try {
    return await counted(address, options);
  } catch (error) {
    fail(`${address}: ${error.message}`);
    throw error;
  }
};

async function load(address) {
  const wheels = Promise.all(WHEELS.map(async (name) => (await self.fetch(name)).arrayBuffer()));
  const bench = self.fetch("bench.py").then((file) => file.text());
  self.importScripts(`${address}pyodide.js`);
  const pyodide = await self.loadPyodide({ indexURL: address, packages: ["numpy", "scipy", "contourpy"] });
  for (const wheel of await wheels) pyodide.unpackArchive(wheel, "wheel");
  post("starts");
  await pyodide.runPythonAsync(await bench);
  const show = (name, scene, data) => {
    const numbers = data.toJs();
    data.destroy();
    post("scene", { name, scene: JSON.parse(scene), data: numbers }, [numbers.buffer]);
  };
  const python = pyodide.globals.get("Page")(show);
  return {
    async open({ student }) {
      const refused = await python.open(student); // as a task, which Python may put aside
      post("opened", { student, refused, pulls: python.pulls });
    },
    event: ({ name, event }) => python.receive(name, JSON.stringify(event)),
  };
}

let ready = null;

self.addEventListener("message", async ({ data }) => {
  try {
    if (data.kind === "load") ready = load(data.address);
    const python = await ready;
    if (data.kind !== "load") await python[data.kind](data);
  } catch (error) {
    fail(error);
  }
});
