// When a course's notebook opens, its first cells run by themselves, and what is run before Python is there waits.
//
// A prebuilt extension, written by hand: JupyterLab loads this file, and asks for the module in package.json. Which
// cells may run is decided in the kernel, by labcourse/jupyter/opening.py of the installed course.

const OPENING = '__import__("sys").modules["labcourse.jupyter.opening"]'; // imports nothing: other kernels lack it
const STARTING = "Python is starting. The cell runs as soon as Python is there.";
const ALL = /^notebook:(run-all-(cells|above)|restart-run-all|restart-and-run-to-selected)$/; // run the first cells, too
const NARROW = 1000; // px, of a window that has no room for a list of files beside the notebook
const LOOK = "padding: 0 12px; overflow: auto; line-height: 1.4; border-left: 5px solid;"
  + " color: var(--jp-ui-font-color1); background: var(--jp-layout-color2);";

const opened = new WeakSet(); // sessions; a notebook in two views has one
let shared;

const plugin = {
  id: "labcourse:opening",
  autoStart: true,
  activate: async (app) => {
    const { Widget } = (await Object.values(shared["@lumino/widgets"])[0].get())();
    const createNew = (panel, { sessionContext }) => {
      if (!opened.has(sessionContext)) watch(app, panel, sessionContext, notice(new Widget(), panel));
      opened.add(sessionContext);
    };
    app.docRegistry.addWidgetExtension("Notebook", { createNew });
    app.restored.then(() => { if (window.innerWidth < NARROW) app.shell.collapseLeft?.(); }); // the list of files
  },
};

(window._JUPYTERLAB ??= {}).labcourse = {
  init: (scope) => { shared = scope; },
  get: async () => () => plugin,
};

function notice(widget, panel) {
  widget.node.setAttribute("role", "status");
  widget.node.style.cssText = LOOK;
  widget.node.dataset.labcourse = "opening";
  panel.contentHeader.addWidget(widget);
  const say = (text) => {
    widget.node.textContent = text;
    widget.node.style.minHeight = "1.4em";
    widget.setHidden(!text);
    requestAnimationFrame(() => { // its width is known
      widget.node.style.minHeight = `${widget.node.scrollHeight}px`;
      panel.contentHeader.fit();
    });
  };
  say("");
  return say;
}

function watch(app, panel, session, say) {
  const usual = Object.getPrototypeOf(session);
  let free = null; // ends the wait of cells that were run before Python is there
  let ready;
  let asked = false;
  let opening = 0; // questions that the kernel has not answered
  let all = null;
  let toRun = 0; // cells until the notice has done its work

  const hold = () => { if (!free) ready = new Promise((done) => { free = done; }); };
  const end = () => { free?.(); free = null; };

  // Before JupyterLab runs a cell it asks this, and without a kernel starts one, and waits until that is there.
  Object.defineProperty(session, "hasNoKernel", {
    get: () => {
      asked = Boolean(free);
      queueMicrotask(() => { asked = false; });
      return asked || Reflect.get(usual, "hasNoKernel", session);
    },
  });
  session.startKernel = async () => {
    if (asked) {
      tell(STARTING, 1);
      await ready;
      if (!session.hasNoKernel) return false;
    }
    return usual.startKernel.call(session);
  };

  const tell = (text, cells) => {
    say(text);
    toRun = cells;
  };
  const open = async (kernel) => {
    hold();
    opening += 1;
    try {
      await panel.context.ready;
      const cells = panel.content.widgets.filter(({ model }) => model.type === "code");
      const sources = cells.map(({ model }) => [model.id, model.sharedModel.getSource()]);
      const given = JSON.stringify(JSON.stringify([session.path.split("/").pop(), sources]));
      const expressions = { opening: `${OPENING}.begin(${given})` };
      const question = { code: "", silent: true, store_history: false, user_expressions: expressions };
      const { content } = await kernel.requestExecute(question).done;
      const { run = [], say: text = "" } = content.user_expressions?.opening?.data?.["application/json"] ?? {};
      for (const cell of all ? [] : run.map((place) => cells[place])) {
        cell.constructor.execute(cell, session).catch(() => { /* the kernel was ended or restarted */ });
      }
      if (text) tell(text, 3);
    } catch { /* this kernel cannot say: it is gone, or of another language */ }
    opening -= 1;
    if (!opening) end();
  };

  const heard = (_, { id, result }) => {
    if (!ALL.test(id) || app.shell.currentWidget !== panel) return;
    all = result;
    const over = () => { if (all === result) all = null; };
    result.then(over, over);
  };
  app.commands.commandExecuted.connect(heard);
  panel.disposed.connect(() => app.commands.commandExecuted.disconnect(heard));
  session.kernelChanged.connect((_, { newValue }) => { if (newValue) open(newValue); });
  session.statusChanged.connect((_, status) => {
    if (status === "restarting") hold();
    if (status === "dead" || (status === "idle" && !opening)) end(); // another page may have restarted it
  });
  session.iopubMessage.connect((_, { header }) => {
    if (header.msg_type === "execute_input" && toRun && !--toRun) say("");
  });
  session.ready.then(() => { if (!session.session?.kernel) end(); });
  if (session.session?.kernel) open(session.session.kernel); else hold();
}
