// Keeps the page usable without a network (service_worker.js), and decides when a new version of it takes over: before
// the program starts, or when somebody asks for it; never under their hands. The page works without all this, so what
// fails here fails quietly.
(() => {
  const workers = location.protocol.startsWith("http") ? navigator.serviceWorker : undefined;
  const RELOADED = "ape-lab reloaded itself";

  /** Settles when the program may start; a version that waits takes over before, with a reload. */
  async function begin() {
    try {
      // Once in a row: whatever a server does, the page does not reload for ever.
      const isSecond = sessionStorage.getItem(RELOADED) !== null;
      sessionStorage.removeItem(RELOADED);
      const registration = await workers?.getRegistration("./");
      // Not the worker of another page further up on the same server.
      const isOurs = registration?.scope === new URL("./", location).href;
      if (!isSecond && isOurs && registration.waiting) {
        await Promise.race([takeOver(registration.waiting), new Promise((resolve) => setTimeout(resolve, 3000))]);
      }
    } catch {
      // Then the version that is here is the newest there is.
    }
  }
  const begun = begin();
  window.newestVersion = () => begun;

  /** Asks a waiting version to take over, which ends in a reload; settles if it may not, as others use the old one. */
  function takeOver(waiting) {
    workers.addEventListener("controllerchange", reload);
    // A busy Chromium may put it off for ever, until the old version has served one more worker.
    const nudge = setTimeout(() => {
      try {
        new Worker("./worker_loader.js", { type: "module" }).terminate();
      } catch {
        // start.js, which allows this address, has not come yet.
      }
    }, 500);
    return new Promise((resolve) => {
      const { port1, port2 } = new MessageChannel();
      port1.onmessage = () => {
        clearTimeout(nudge);
        workers.removeEventListener("controllerchange", reload);
        resolve();
      };
      waiting.postMessage("take over", [port2]);
    });
  }

  function reload() {
    try {
      sessionStorage.setItem(RELOADED, "");
    } catch {
      // Then the next start does not ask for a newer version to take over either.
    }
    location.reload();
  }

  window.addEventListener("load", async () => {
    await begun;
    try {
      const registration = await workers?.register("./service_worker.js", { updateViaCache: "none" });
      if (registration) follow(registration);
    } catch {
      // Without a service worker the page needs the network, as any other does.
    }
  });

  /** Tells of every new version, found by the browser at each visit or when the page is looked at again. */
  function follow(registration) {
    const tell = () => {
      // Without an active version this is the first visit, and nothing is new.
      if (registration.active && registration.waiting) showBar(registration);
    };
    const watch = () => registration.installing?.addEventListener("statechange", tell);
    registration.addEventListener("updatefound", watch);
    watch();
    tell();
    document.addEventListener("visibilitychange", () => {
      if (document.visibilityState === "visible") registration.update().catch(() => {});
    });
  }

  function showBar(registration) {
    if (document.getElementById("news")) return;
    const bar = document.createElement("aside");
    bar.id = "news";
    const sentence = document.createElement("p");
    sentence.setAttribute("role", "status");
    const button = (label, act) => {
      const element = document.createElement("button");
      element.type = "button";
      element.textContent = label;
      element.addEventListener("click", act);
      return element;
    };
    const load = button("Reload", async () => {
      if (!registration.waiting) return reload();
      await takeOver(registration.waiting);
      sentence.textContent = "ape-lab is open elsewhere, too: close it there, then reload.";
    });
    const later = button("Later", () => {
      bar.remove();
      document.getElementById("canvas").focus();
    });
    bar.append(sentence, load, later);
    // First in the page, so that Tab comes to it from the browser's own controls: the canvas keeps Tab to itself.
    document.body.prepend(bar);
    // A text is read out if it changes while it is there.
    setTimeout(() => (sentence.textContent = "A new version of ape-lab is ready."), 100);
  }
})();
