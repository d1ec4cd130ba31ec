// Serves dist/ and opens it in headless Chromium; what the end-to-end tests and the screenshots share.
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

export const DIST = process.env.DIST ?? fileURLToPath(new URL("../../dist/", import.meta.url));
const TYPES = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".wasm": "application/wasm",
  ".css": "text/css",
  ".svg": "image/svg+xml",
  ".png": "image/png",
  ".webmanifest": "application/manifest+json",
};

/** The headers that the page's own file asks hosts to send with everything; pages of old have none. */
async function headers() {
  const text = await readFile(join(DIST, "_headers"), "utf8").catch(() => "");
  const lines = text.split("\n").filter((line) => line.startsWith(" "));
  return Object.fromEntries(lines.map((line) => line.trim().split(/: (.*)/, 2)));
}

/**
 * A static server for the built page, or another folder, on a free port of this machine. With `bare` it is a host that
 * sends no headers of the page's own.
 */
export async function serve(folder = DIST, { bare } = {}) {
  const own = bare ? {} : await headers();
  const server = createServer(async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, "http://localhost").pathname));
    const file = join(folder, path.endsWith("/") ? join(path, "index.html") : path);
    try {
      const bytes = await readFile(file);
      response.writeHead(200, { "Content-Type": TYPES[extname(file)] ?? "application/octet-stream", ...own }).end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const close = () => {
    server.close();
    server.closeAllConnections();
  };
  return { address: `http://127.0.0.1:${server.address().port}/`, close };
}

/** Chromium as it runs on machines without a display, also as root. */
export function launch(...more) {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: [
      "--no-sandbox",
      "--disable-dev-shm-usage",
      "--disable-background-networking",
      "--disable-component-update",
      "--no-first-run",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
      ...more,
    ],
  });
}

/**
 * Opens the page; `problems` collects all that the console and the page complain about. With `offline`, its service
 * worker is let in; otherwise the browser has none to offer, as `page.route` does not see what a service worker fetches.
 * With `isNew` the visitor comes for the first time.
 */
export async function open(browser, address, { before, offline, isNew, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  if (!offline) await context.addInitScript(() => delete Navigator.prototype.serviceWorker);
  if (!isNew) await context.addInitScript(() => localStorage.setItem("ape-lab.visited", "yes"));
  // Its frames are counted (web/rest.js).
  await context.addInitScript(() => (window.apeLabMeasures = true));
  const page = await context.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(String(error)));
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) problems.push(message.text());
  });
  if (before) await before(page);
  await page.goto(address);
  return { context, page, problems, close: () => context.close() };
}
