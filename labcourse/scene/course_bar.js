// The page's side of the course bar. JupyterLab opens its links, as those of any output, and knows what is saved.

const KEY = "labcourse_bar"; // in the notebook's metadata while it is saved: the bar as it is now

const AGAIN = 700; // ms

const KEPT = "Your work is kept in this browser, on this computer, and nowhere else.";
const MAY_GO = " The browser may delete it when the disk is full.";
const LOOSE = " There is work that you have not downloaded.";
const REPLACE = "There is work here that you have not downloaded. The zip's files replace it. Go on?";

export default { render };

function render({ model, el }) {
  const manager = model.widget_manager;
  const notebook = manager?.context; // JupyterLab's; other editors have none
  const host = make("section", "labcourse-bar", el);
  host.setAttribute("aria-label", "Course bar");
  host.dataset.lmSuppressShortcuts = "true";
  host.addEventListener("keydown", (event) => {
    event.stopPropagation();
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "s" || !notebook?.save) return;
    event.preventDefault(); // a button has the focus, and the bar says: press Ctrl+S
    notebook.save();
  });
  const buttons = make("div", "buttons", host);
  const page = make("div", "page", host);
  page.addEventListener("click", (event) => {
    const link = event.target.closest("a");
    if (!link?.hash) return;
    history.replaceState(history.state, "", location.pathname + location.search); // the same jump once more is a jump
    // Cells that are drawn meanwhile move the one that was jumped to.
    if (event.isTrusted) setTimeout(() => link.click(), AGAIN);
  });
  const pane = make("div", "pane", host);
  const head = make("div", "head", pane);
  const title = make("b", "", head);
  const hide = make("button", "hide", head);
  hide.textContent = "Hide";
  hide.addEventListener("click", () => { pane.hidden = true; });
  const notice = make("p", "notice", pane);
  notice.setAttribute("role", "status");
  const text = make("pre", "text", pane);
  text.tabIndex = 0;
  pane.hidden = true;
  let asked = false;
  const kept = keep(model, notebook, host, pane);

  const draw = () => show(page, model.get("html"), manager?.rendermime);
  const tell = (event) => { try { model.send(event); } catch { /* the kernel is gone */ } };
  const look = () => {
    if (!asked) tell({ kind: "look" });
    asked = true; // one question at a time, however busy the kernel is
  };
  const write = () => {
    const output = model.get("output");
    if (!output.title) return;
    pane.hidden = false;
    pane.setAttribute("aria-busy", String(output.busy));
    title.textContent = output.busy ? `${output.title} runs…` : output.title;
    notice.textContent = output.notice;
    text.textContent = output.text;
    text.hidden = !output.text;
  };
  const fill = () => {
    buttons.replaceChildren();
    for (const [name, label] of Object.entries(model.get("commands"))) {
      const button = make("button", "", buttons);
      button.textContent = label;
      button.dataset.name = name;
      button.addEventListener("click", () => {
        tell({ kind: "press", name, saved: notebook?.model ? !notebook.model.dirty || sources(notebook) : null });
      });
    }
  };
  const answered = () => { asked = false; };
  const saving = (_, state) => {
    if (state === "started") notebook.model.setMetadata?.(KEY, model.get("html"));
    if (state.startsWith("completed")) look(); // words are read from the saved notebook
  };
  const events = { "change:html": draw, "change:output": write, "change:commands": fill, "change:looks": answered,
    "change:kept": kept.draw, "msg:custom": kept.take };
  for (const [name, act] of Object.entries(events)) model.on(name, act);
  notebook?.saveState?.connect(saving);
  const seen = new IntersectionObserver((entries) => { if (entries.some((entry) => entry.isIntersecting)) look(); });
  seen.observe(host);
  for (const act of [draw, fill, write, kept.draw]) act();
  return () => {
    seen.disconnect();
    kept.end();
    notebook?.saveState?.disconnect(saving);
    for (const [name, act] of Object.entries(events)) model.off(name, act);
  };
}

// Where all is kept in this browser: say so, offer it for download, and warn when the page closes with something else.
function keep(model, notebook, host, pane) {
  const row = make("p", "kept", host);
  host.insertBefore(row, pane);
  row.hidden = true;
  const about = make("span", "", row);
  const button = (text, act) => {
    const made = make("button", "", row);
    made.textContent = text;
    made.addEventListener("click", act);
  };
  const file = make("input", "", row);
  file.type = "file";
  file.accept = ".zip";
  file.hidden = true;
  file.addEventListener("change", () => {
    const reader = new FileReader();
    reader.addEventListener("load", () => { // as text: JupyterLite's kernel is given nothing else
      model.send({ kind: "unpack", zip: reader.result.split(",")[1] });
      file.value = "";
    });
    if (file.files.length) reader.readAsDataURL(file.files[0]);
  });
  button("Download", async () => {
    await notebook?.save(); // what is packed is the saved file
    model.send({ kind: "download" });
  });
  button("Go on with a zip…", () => {
    if (model.get("kept") !== "loose" || confirm(REPLACE)) file.click();
  });
  const draw = async () => {
    row.hidden = !model.get("kept");
    if (row.hidden) return;
    row.dataset.kept = model.get("kept");
    const lasts = await navigator.storage?.persisted?.();
    about.textContent = `${KEPT}${lasts ? "" : MAY_GO}${model.get("kept") === "loose" ? LOOSE : ""} `;
  };
  const take = ({ name }, [content]) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([content]));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), AGAIN);
  };
  const warn = (event) => { if (model.get("kept") === "loose") event.preventDefault(); };
  window.addEventListener("beforeunload", warn);
  return { draw, take, end: () => window.removeEventListener("beforeunload", warn) };
}

// A notebook that was only run is not saved either, but what counts of it is.
function sources({ model }) {
  return Array.from(model.cells, (cell) => [cell.id, cell.type, cell.sharedModel.getSource()]);
}

async function show(node, html, rendermime) {
  if (!rendermime) {
    node.innerHTML = html;
    return;
  }
  const renderer = rendermime.createRenderer("text/html");
  await renderer.renderModel(rendermime.createModel({ data: { "text/html": html }, trusted: true }));
  node.replaceChildren(renderer.node);
}

function make(tag, name, parent) {
  const element = document.createElement(tag);
  if (name) element.className = name;
  parent.append(element);
  return element;
}
