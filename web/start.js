// Starts the program: what trunk would otherwise write into the page, whose policy allows no script there.
// That policy also asks of every address that becomes a script whether it is trusted. These two are:
const SCRIPTS = ["./worker_loader.js", "./service_worker.js"];
window.trustedTypes?.createPolicy("default", {
  createScriptURL: (address) => (SCRIPTS.includes(address) ? address : null),
});

const { program, wasm } = document.querySelector("script[data-program]").dataset;
try {
  const { default: init } = await import(program);
  await init({ module_or_path: wasm });
} catch (error) {
  window.failLoading(error);
}
