// The course in a browser: asks once for the student's ID, and asks the browser to keep what it stores.
//
// A prebuilt extension, written by hand: JupyterLite loads this file, and asks for the module in package.json.

const FOLDER = "notebooks";
const COURSE = `${FOLDER}/course.json`;
const LAST = `labcourse:${location.pathname}`; // in the browser's storage: the notebook that was opened last
const ASK = "Your student ID, by which your instructor knows you:";
const GOOD = /^[\p{L}\p{N}](?:[\p{L}\p{N} ._@+-]{0,62}[\p{L}\p{N}])?$/u; // the course's Python looks once more

// JupyterLite's kernel waits for ever for a file that cannot be written: what the error says → what happened.
const STUCK = [
  [/quota|disk|storage/i, "This browser's storage is full, so your last change is not kept. Delete files you do not need."],
  [/JSON/, "A program emptied a notebook or a JSON file to write it anew, which does not work here: use another name."],
];
const RESTART = "Then choose Kernel → Restart Kernel, and run the cells again.";

let shared;

const plugin = {
  id: "labcourse_browser:browser",
  autoStart: true,
  activate: async (app) => {
    navigator.storage?.persist?.();
    const { InputDialog, showErrorMessage } = (await Object.values(shared["@jupyterlab/apputils"])[0].get())();
    const createNew = (panel, { path, sessionContext }) => {
      localStorage.setItem(LAST, path);
      prepare(sessionContext);
    };
    window.addEventListener("unhandledrejection", ({ reason }) => {
      const [, text] = STUCK.find(([words]) => words.test(reason?.message)) ?? [];
      if (text) showErrorMessage("A file was not written", `${text} ${RESTART}`);
    });
    app.docRegistry.addWidgetExtension("Notebook", { createNew });
    app.restored.then(async () => {
      await open(app);
      await name(app.serviceManager.contents, InputDialog);
    });
  },
};

// A page that is loaded again has nothing open.
async function open({ commands, shell, serviceManager }) {
  await commands.execute("filebrowser:go-to-path", { path: `/${FOLDER}` });
  if ([...shell.widgets("main")].some((widget) => widget.context)) return;
  const { content } = await serviceManager.contents.get(FOLDER, { content: true });
  const names = content.map(({ path }) => path).filter((path) => path.endsWith(".ipynb")).sort();
  const last = localStorage.getItem(LAST);
  await commands.execute("docmanager:open", { path: names.includes(last) ? last : names[0] });
}

// A kernel here does not know which notebook it runs; a course's says so in its bar.
function prepare(session) {
  let restarts = false;
  const begin = (kernel) => {
    const path = JSON.stringify(session.path);
    const code = `from labcourse.run import in_browser\nin_browser.begin(${path})`;
    kernel?.requestExecute({ code, silent: true, store_history: false });
  };
  session.kernelChanged.connect((_, { newValue }) => begin(newValue));
  session.statusChanged.connect((_, status) => {
    if (restarts && status === "idle") begin(session.session?.kernel);
    restarts = status === "restarting" || (restarts && status !== "idle");
  });
  begin(session.session?.kernel);
}

async function name(contents, InputDialog) {
  const { content, format } = await contents.get(COURSE, { content: true, format: "text", type: "file" });
  const text = format === "base64" ? atob(content) : content; // as Python wrote it, or this page
  const course = typeof text === "string" ? JSON.parse(text) : text; // or as it was put there
  if (course.student) return;
  let label = ASK;
  while (!course.student) {
    const { button, value } = await InputDialog.getText({ title: "Who works here?", label, okLabel: "Begin" });
    if (!button.accept) return; // asked again next time
    if (GOOD.test(value.trim())) course.student = value.trim();
    else label = `${ASK} letters and digits, with . _ - + @ between them.`;
  }
  const named = `${JSON.stringify(course, null, 2)}\n`;
  await contents.save(COURSE, { type: "file", format: "text", content: named });
}

(window._JUPYTERLAB ??= {}).labcourse_browser = {
  init: (scope) => { shared = scope; },
  get: async () => () => plugin,
};
