// A Python of its own for one command: it has a copy of the student's files, and what it changes is sent back.

self.onmessage = async ({ data }) => {
  const { pyodide: options, files, folder, program } = data;
  try {
    importScripts(`${options.indexURL}pyodide.js`);
    const python = await loadPyodide(options);
    const say = { batched: (line) => postMessage({ line: `${line}\n` }) };
    python.setStdout(say);
    python.setStderr(say);
    for (const [path, content] of Object.entries(files)) {
      python.FS.mkdirTree(path.slice(0, path.lastIndexOf("/")));
      python.FS.writeFile(path, content);
    }
    python.FS.chdir(folder);
    self.sent = (path, content) => postMessage({ path, content });
    await python.runPythonAsync(program);
  } catch (error) {
    postMessage({ line: `${error}\n` });
  }
  postMessage({ ended: true });
};
