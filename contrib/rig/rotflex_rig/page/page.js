// The laboratory's page: who waits, what ran, pause and presence. The token stays in this tab.
const COLOURS = { theta_ref: "#666666", theta: "#0072B2", alpha: "#D55E00" };
const find = (selector) => document.querySelector(selector);
const drawn = new Map();

async function ask(path, body) {
  const headers = { authorization: `Bearer ${sessionStorage.getItem("token")}` };
  const answer = await fetch(path, { headers, cache: "no-store", method: body ? "POST" : "GET", body: body && JSON.stringify(body) });
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

function element(name, text = "", attributes = {}) {
  const kind = ["svg", "polyline"].includes(name) ? "2000/svg" : "1999/xhtml";
  const made = document.createElementNS(`http://www.w3.org/${kind}`, name);
  made.textContent = text;
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  return made;
}

function table(rows, headings) {
  return [headings.map((text) => element("th", text)), ...rows].map((cells) => {
    const line = element("tr");
    line.append(...cells.map((cell) => (cell instanceof Element ? cell : element("td", cell))));
    return line;
  });
}

async function curves(run) {
  if (!drawn.has(run.id)) {
    const { t, curves: lines } = await ask(`curves/${run.id}`);
    const most = Math.max(1, ...Object.values(lines).flat().map(Math.abs));
    const text = `Angles of run ${run.id} from ${-most} to ${most} deg, ${t.at(-1)} s: ${Object.keys(lines).join(", ")}`;
    const svg = element("svg", "", { viewBox: "0 0 320 80", role: "img", "aria-label": text });
    for (const [name, values] of Object.entries(lines)) {
      const points = values.map((value, n) => `${(320 * t[n]) / t.at(-1)},${40 - (38 * value) / most}`).join(" ");
      svg.append(element("polyline", "", { points, stroke: COLOURS[name] }));
    }
    const cell = element("td");
    cell.append(svg, element("div", `±${most.toFixed(0)} deg, ${t.at(-1).toFixed(0)} s: servo blue, arm orange, command grey`));
    drawn.set(run.id, cell);
  }
  return drawn.get(run.id);
}

async function show(said) {
  const minutes = Math.round(said.present / 60);
  find("#state").textContent = said.held ? `No run is begun: ${said.held}.` : `Runs are begun. Presence counts for ${minutes} minutes.`;
  find("#pause").textContent = said.paused ? "Go on" : "Pause";
  find("#pause").onclick = () => act({ pause: !said.paused });
  const queue = said.queue.map((run) => [`${run.id}`, run.student, run.name, `${run.seconds.toFixed(0)} s`, run.state]);
  find("#queue").replaceChildren(...table(queue, ["Run", "Student", "Experiment", "Length", "State"]));
  const last = said.last.map(async (run) => [
    `${run.id}`, run.student, run.name, run.state === "done" ? await curves(run) : `${run.state}: ${run.reason ?? ""}`,
  ]);
  find("#last").replaceChildren(...table(await Promise.all(last), ["Run", "Student", "Experiment", "What became of it"]));
  find("main").hidden = false;
  find("#enter").hidden = true;
}

async function act(body) {
  try {
    await show(await ask(body ? "control" : "queue", body));
  } catch (error) {
    find("#state").textContent = error.message;
    find("#enter").hidden = !find("main").hidden;
  }
}
find("#enter").onsubmit = (event) => {
  event.preventDefault();
  sessionStorage.setItem("token", find("input").value);
  act();
};
for (const name of ["present", "leave"]) find(`#${name}`).onclick = () => act({ present: name === "present" });
setInterval(() => find("main").hidden || act(), 3000);
if (sessionStorage.getItem("token")) act();
