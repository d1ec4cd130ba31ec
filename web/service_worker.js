// Serves the page without a network, and a whole version of it or none.
//
// `cargo xtask offline` writes two constants before this text whenever the page has been built: FILES, every file of the
// page with the hash of its bytes, and VERSION, a hash of all that. So a change of any file is a new service worker.
// One version has one cache. It counts as installed once every file has come, and the browser has compared each with
// its hash: a server halfway through an upload, or a stale copy on the way, cannot mix versions. Then it waits, and
// takes over only when a page that is open alone asks for it (offline.js).

const SCOPE = self.registration.scope;
// Caches belong to the whole server: the scope says which are ours.
const OURS = "ape-lab " + SCOPE + " ";
const CACHE = OURS + VERSION;

self.addEventListener("install", (event) => {
  const requests = Object.entries(FILES).map(
    // "no-cache" asks the server about each file, and downloads again only what has changed.
    ([name, integrity]) => new Request(new URL(name, SCOPE), { cache: "no-cache", integrity })
  );
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(requests)));
});

self.addEventListener("activate", (event) => {
  event.waitUntil(tidy().then(() => self.clients.claim()));
});

async function tidy() {
  // A version that comes after this one may be filling its cache: it will tidy up itself.
  if (self.registration.installing || self.registration.waiting) return;
  const names = await caches.keys();
  await Promise.all(names.filter((name) => name.startsWith(OURS) && name !== CACHE).map((name) => caches.delete(name)));
}

self.addEventListener("fetch", (event) => {
  const name = fileOf(event.request);
  if (name !== undefined) event.respondWith(answer(name, event.request));
});

/** The file a request asks for; nothing for all that is not ours, which goes its usual way. */
function fileOf(request) {
  const url = new URL(request.url);
  const address = url.origin + url.pathname;
  if (request.method !== "GET" || !address.startsWith(SCOPE)) return undefined;
  if (url.search && request.mode !== "navigate") return undefined;
  const path = address.slice(SCOPE.length);
  const name = path === "" || path === "index.html" ? "./" : path;
  return Object.hasOwn(FILES, name) ? name : undefined;
}

async function answer(name, request) {
  // Where the browser's cache is broken, the network answers.
  const kept = await caches.match(new URL(name, SCOPE), { cacheName: CACHE, ignoreVary: true }).catch(() => undefined);
  return kept ?? fetch(request);
}

self.addEventListener("message", (event) => {
  if (event.data === "take over") event.waitUntil(takeOver(event));
});

/** Takes over from the version before if nobody but the asking page uses it, and says so otherwise. */
async function takeOver(event) {
  for (let tries = 0; tries < 5; tries++) {
    const windows = await self.clients.matchAll({ type: "window", includeUncontrolled: true });
    if (!windows.some((page) => page.url.startsWith(SCOPE) && page.id !== event.source.id)) return self.skipWaiting();
    // A page that is reloaded may still be seen for a moment.
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  event.ports[0].postMessage("others are open");
}
