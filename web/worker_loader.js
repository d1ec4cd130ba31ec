// Starts the worker's program. What goes wrong here is told to the page as a string; the program itself
// only ever sends bytes.

// Where a host sends the page's policy with this file, too, only this script may come in.
self.trustedTypes?.createPolicy("default", {
  createScriptURL: (address) => (address === "./worker.js" ? address : null),
});
const fail = (reason) => self.postMessage("The worker could not be loaded (" + reason + ").");
// As long as the worker lives it holds a lock of its name: the page hears by it when it is gone without a word.
const locked = new Promise((resolve) => {
  const hold = () => {
    resolve();
    return new Promise(() => {});
  };
  if (navigator.locks) navigator.locks.request(self.name, hold).catch(resolve);
  else resolve();
});
try {
  importScripts("./worker.js");
  locked.then(() => wasm_bindgen({ module_or_path: "./worker_bg.wasm" })).catch(fail);
} catch (error) {
  fail(error);
}
