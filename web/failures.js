// What the page cannot do without. The messages are plain HTML: nothing else may be there to show them.
function failPage(sentence) {
  const message = document.getElementById("message");
  // The first reason is the cause of the others.
  if (message.getAttribute("role") === "alert") return;
  message.setAttribute("role", "alert");
  message.hidden = false;
  const title = document.createElement("h1");
  title.textContent = "ape-lab cannot start";
  const text = document.createElement("p");
  text.textContent = sentence;
  message.replaceChildren(title, text);
}
window.failPage = failPage;
window.addEventListener("DOMContentLoaded", () => {
  const missing = [];
  if (typeof WebAssembly !== "object") missing.push("WebAssembly");
  if (typeof Worker !== "function") missing.push("web workers");
  if (!document.createElement("canvas").getContext("webgl2")) missing.push("WebGL 2");
  if (missing.length > 0) {
    failPage(
      "This browser does not offer " + missing.join(" and ") + ", which the page needs. " +
        "A current Firefox, Chrome, Edge or Safari does; WebGL may be switched off in its settings."
    );
  }
});
// A file is taken where the canvas is; elsewhere browsers would open it in place of the page.
for (const kind of ["dragover", "drop"]) {
  window.addEventListener(kind, (event) => event.dataTransfer?.types.includes("Files") && event.preventDefault());
}
window.failLoading = (reason) => {
  if (!window.pageHasStarted) window.failPage("The program could not be loaded (" + reason + "). Reload the page to try again.");
};
// Scripts that cannot be fetched say so on their own elements only: hence the capture. Those of browser extensions, and
// what goes wrong in them, are not ours; what goes wrong in the program while it is loaded is caught in start.js.
const isOurs = (address) => `${address}`.startsWith(location.origin + "/");
window.addEventListener(
  "error",
  (event) => {
    if (event.message) {
      if (isOurs(event.filename)) window.failLoading(event.message);
    } else if (event.target instanceof HTMLScriptElement && isOurs(event.target.src)) window.failLoading("a script is missing");
  },
  true
);
