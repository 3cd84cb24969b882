// The page's side of the course bar. JupyterLab opens its links, as those of any output, and knows what is saved.

const KEY = "labcourse_bar"; // in the notebook's metadata while it is saved: the bar as it is now

const AGAIN = 700; // ms

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
  const events = { "change:html": draw, "change:output": write, "change:commands": fill, "change:looks": answered };
  for (const [name, act] of Object.entries(events)) model.on(name, act);
  notebook?.saveState?.connect(saving);
  const seen = new IntersectionObserver((entries) => { if (entries.some((entry) => entry.isIntersecting)) look(); });
  seen.observe(host);
  for (const act of [draw, fill, write]) act();
  return () => {
    seen.disconnect();
    notebook?.saveState?.disconnect(saving);
    for (const [name, act] of Object.entries(events)) model.off(name, act);
  };
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
