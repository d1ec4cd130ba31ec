// What the page says when the program cannot: it could not start, it has crashed, or the browser has taken its graphics
// away. Plain elements over the canvas, with a report to copy. After a crash the program is not called again.
(() => {
  /** The last messages between the page and its workers, each with its time and how often it came in a row. */
  const messages = [];
  const MOST = 40;
  let hasFailed = false;
  let context;

  window.noteMessage = (text) => {
    const last = messages.at(-1);
    if (last?.text === text) {
      last.count += 1;
      last.time = Date.now();
      return;
    }
    messages.push({ text, time: Date.now(), count: 1 });
    if (messages.length > MOST) messages.shift();
  };

  window.faultReport = (fault, stack) => {
    const now = Date.now();
    const lines = messages.map(({ text, time, count }) => {
      const times = count > 1 ? " × " + count : "";
      return "  " + ((time - now) / 1000).toFixed(3) + " s  " + text + times;
    });
    const system = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
    const theme = document.documentElement.dataset.theme ?? system;
    return [
      "ape-lab " + (window.pageVersion ?? "(not started)"),
      "What: " + fault,
      "When: " + new Date(now).toISOString(),
      "Page: " + location.href,
      "Browser: " + navigator.userAgent,
      "Window: " + innerWidth + " × " + innerHeight + " at " + devicePixelRatio + ", " + theme,
      "Last messages:",
      ...(lines.length > 0 ? lines : ["  none"]),
      ...(stack ? ["Stack:", String(stack)] : []),
    ].join("\n");
  };

  window.whenGone = (name, callback) => {
    navigator.locks?.request(name, () => callback()).catch(() => {});
  };

  /** Whether the program may paint: neither after a crash nor while its graphics are lost. */
  window.pageCanPaint = () => !hasFailed && !context?.isContextLost();

  window.watchGraphics = (canvas) => {
    // That of the canvas before takes room on the graphics card, and browsers have few of them to give.
    if (context) {
      context.canvas.width = context.canvas.height = 1;
      context.getExtension("WEBGL_lose_context")?.loseContext();
    }
    context = canvas.getContext("webgl2");
  };

  // In place of the plain one of the page's own script.
  window.failPage = (sentence) => fail("ape-lab cannot start", sentence, sentence);

  window.programHasCrashed = (fault, stack = new Error().stack) =>
    fail(
      window.pageHasStarted ? "ape-lab has stopped" : "ape-lab cannot start",
      "Something went wrong in the program, and it cannot go on. Reload to open the page again with the same settings. " +
        "If you tell somebody of this fault, send the report along: it says what happened.",
      fault,
      stack
    );

  function fail(title, sentence, fault, stack) {
    // The first fault is the cause of the others.
    if (hasFailed) return;
    hasFailed = true;
    show(title, sentence, window.faultReport(fault, stack));
  }

  window.graphicsAreLost = () => {
    if (hasFailed) return;
    const sentence =
      "The browser has taken the page's graphics away, as it may when the graphics card is reset or short of memory. " +
      "The picture comes back by itself as soon as the browser allows it, and nothing is lost. Reload begins again with " +
      "the same settings.";
    show("The picture is gone for a moment", sentence);
  };

  window.graphicsAreBack = () => {
    if (!hasFailed) hide();
  };

  /** What the message covers cannot be used meanwhile. */
  const covered = () => document.querySelectorAll("main > :not(#message)");

  function show(title, sentence, report) {
    const message = document.getElementById("message");
    message.setAttribute("role", "alert");
    message.hidden = false;
    const sheet = element("div");
    const head = element("h1", title);
    head.tabIndex = -1;
    sheet.append(head, element("p", sentence), ...(report ? reportOf(report) : [buttons([reload()])]));
    message.replaceChildren(sheet);
    covered().forEach((part) => (part.inert = true));
    head.focus();
  }

  function hide() {
    const message = document.getElementById("message");
    message.hidden = true;
    message.removeAttribute("role");
    message.replaceChildren();
    covered().forEach((part) => (part.inert = false));
    document.getElementById("canvas").focus();
  }

  function reportOf(report) {
    const details = element("details");
    const text = element("pre", report);
    // Scrolled by keyboard, too.
    text.tabIndex = 0;
    details.append(element("summary", "What the report says"), text);
    const status = element("p");
    status.setAttribute("role", "status");
    const copy = button("Copy the report", async () => {
      try {
        await navigator.clipboard.writeText(report);
        status.textContent = "The report is copied.";
      } catch {
        details.open = true;
        getSelection().selectAllChildren(text);
        status.textContent = "The report is marked: copy it with the keys of your system.";
      }
    });
    return [buttons([reload(), copy]), status, details];
  }

  const reload = () => button("Reload", () => location.reload());

  function buttons(all) {
    const row = element("div");
    row.className = "buttons";
    row.append(...all);
    return row;
  }

  function button(label, act) {
    const made = element("button", label);
    made.type = "button";
    made.addEventListener("click", act);
    return made;
  }

  function element(name, text = "") {
    const made = document.createElement(name);
    made.textContent = text;
    return made;
  }

  // Errors of the program, once it runs, that it could not tell itself: its code was stopped in the middle, and what it
  // knows cannot be trusted. Errors of browser extensions, or such as the browser means as a hint, are not ours.
  function hear(error) {
    const isOurs = error instanceof Error && !(error instanceof DOMException) && `${error.stack}`.includes(location.origin);
    if (window.pageHasStarted && isOurs) window.programHasCrashed(String(error), error.stack);
  }
  window.addEventListener("error", (event) => hear(event.error));
  window.addEventListener("unhandledrejection", (event) => hear(event.reason));
})();
