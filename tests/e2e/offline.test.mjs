// The page without a network, and how a new version takes the place of an old one. Every test has a copy of the built
// page to itself, in a folder of its server, with a service worker written by the command that writes the real one.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { after, before, test } from "node:test";
import { promisify } from "node:util";
import { DIST, launch, open, serve } from "./browser.mjs";

const ROOT = fileURLToPath(new URL("../../", import.meta.url));
const SHOTS = fileURLToPath(new URL("./screenshots/", import.meta.url));
const PATIENCE = { timeout: 60_000 };
const READY = "A new version of ape-lab is ready.";

let browser;
before(async () => {
  await mkdir(SHOTS, { recursive: true });
  browser = await launch();
});
after(() => browser?.close());

const trained = (page) => page.getByRole("status").filter({ hasText: /^trained/ }).waitFor(PATIENCE);

/** A copy of the page that can be changed, served from a folder as a project's page often is. */
async function published(t) {
  const folder = await mkdtemp(join(tmpdir(), "ape-lab-"));
  const dist = join(folder, "lab");
  await cp(DIST, dist, { recursive: true });
  const server = await serve(folder);
  t.after(async () => {
    server.close();
    await rm(folder, { recursive: true });
  });
  const change = async (file, edit) => writeFile(join(dist, file), edit(await readFile(join(dist, file), "utf8")));
  const seal = () => promisify(execFile)("cargo", ["xtask", "offline", dist], { cwd: ROOT });
  /** A version with another title, and another worker. */
  const publish = async (title) => {
    await change("index.html", (text) => text.replace(/<title>.*<\/title>/, `<title>${title}</title>`));
    await change("worker_loader.js", (text) => `${text}// ${title}\n`);
    await seal();
  };
  await publish("first");
  return { address: server.address + "lab/", stop: server.close, change, seal, publish };
}

/** Opens the page and waits until it needs the network no more. */
async function visit(t, site, options = {}) {
  const visit = await open(browser, site.address, { offline: true, ...options });
  t.after(visit.close);
  await trained(visit.page);
  await visit.page.waitForFunction(() => navigator.serviceWorker.controller?.state === "activated", null, PATIENCE);
  return visit;
}

/** As if somebody came back to the page from elsewhere. */
const lookAgain = (page) => page.evaluate(() => void document.dispatchEvent(new Event("visibilitychange")));
const bar = (page) => page.getByRole("button", { name: "Reload", exact: true });
const caches = (page) => page.evaluate(async () => (await window.caches.keys()).length);
/** The version of the page, and that of the worker it would start now. */
const versions = async (page) => [
  await page.title(),
  (await page.evaluate(async () => (await fetch("./worker_loader.js")).text())).trim().split("// ").pop(),
];
const isInstalling = (page) =>
  page.evaluate(async () => Boolean((await navigator.serviceWorker.getRegistration()).installing));
/** Counts how often a page is loaded from here on. */
function loads(page) {
  const count = { of: 0 };
  page.on("domcontentloaded", () => count.of++);
  return count;
}

test("after one visit the page needs no network", async (t) => {
  const site = await published(t);
  const { context, page, problems } = await visit(t, site);
  assert.equal(await caches(page), 1);
  await context.setOffline(true);
  site.stop();
  await page.reload();
  await trained(page);
  await page.screenshot({ path: SHOTS + "offline-1280x800-light.png" });
  await lookAgain(page);
  // Whichever way it is addressed, and in another tab.
  for (const address of ["index.html", "?from=home", "#somewhere"]) {
    const other = await context.newPage();
    await other.goto(site.address + address);
    await trained(other);
    assert.deepEqual(await versions(other), ["first", "first"]);
    await other.close();
  }
  // The program itself asks for nothing that is not there: icons and the manifest are, too.
  for (const file of ["manifest.webmanifest", "icons/icon-192.png"]) {
    assert.equal(await page.evaluate(async (file) => (await fetch(file)).status, file), 200);
  }
  assert.equal(await bar(page).count(), 0);
  assert.deepEqual(problems, []);
});

test("a new version is offered, and comes whole when it is asked for and nobody else uses the old one", async (t) => {
  const site = await published(t);
  const { context, page, problems } = await visit(t, site);
  const count = loads(page);
  await site.publish("second");
  await lookAgain(page);
  await page.getByRole("status").filter({ hasText: READY }).waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "new-version-1280x800-light.png" });
  assert.deepEqual(await versions(page), ["first", "first"]);

  // Another tab is of the old version as well, and keeps it from going.
  const other = await context.newPage();
  await other.goto(site.address);
  await trained(other);
  await bar(other).waitFor(PATIENCE);
  assert.deepEqual(await versions(other), ["first", "first"]);
  await bar(page).click();
  await page.getByText("ape-lab is open elsewhere, too: close it there, then reload.").waitFor(PATIENCE);
  assert.deepEqual(await versions(page), ["first", "first"]);
  assert.equal(count.of, 0);
  await other.close();

  await bar(page).focus();
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.title === "second", null, PATIENCE);
  await trained(page);
  assert.deepEqual(await versions(page), ["second", "second"]);
  assert.equal(await caches(page), 1);
  assert.equal(await bar(page).count(), 0);
  assert.equal(count.of, 1);
  assert.deepEqual(problems, []);
});

test("a version put off takes over when the page is opened anew, before the program starts", async (t) => {
  const site = await published(t);
  const phone = { viewport: { width: 390, height: 844 }, colorScheme: "dark", hasTouch: true };
  const { context, page, problems } = await visit(t, site, phone);
  await site.publish("second");
  await lookAgain(page);
  await page.getByText(READY).waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "new-version-390x844-dark.png" });
  for (const name of ["Reload", "Later"]) {
    const box = await page.getByRole("button", { name, exact: true }).boundingBox();
    assert.ok(box.width >= 40 && box.height >= 40 && box.x >= 0 && box.x + box.width <= 390, JSON.stringify(box));
  }
  await page.getByRole("button", { name: "Later", exact: true }).tap();
  assert.equal(await bar(page).count(), 0);
  assert.equal(await page.evaluate(() => document.activeElement.id), "canvas");
  assert.deepEqual(await versions(page), ["first", "first"]);

  // The page of the old version is loaded, gives way, and its program never comes to start.
  const count = loads(page);
  await page.addInitScript(() => {
    window.addEventListener("pagehide", () => sessionStorage.setItem("left", `${document.title} ${window.pageHasStarted}`));
  });
  await page.reload().catch(() => {});
  await trained(page);
  assert.deepEqual(await versions(page), ["second", "second"]);
  assert.equal(count.of, 2);
  assert.equal(await page.evaluate(() => sessionStorage.getItem("left")), "first undefined");
  assert.equal(await caches(page), 1);

  // And once more, in another tab after the last one was closed. The page that is left stays as it is.
  await site.publish("third");
  await lookAgain(page);
  await bar(page).waitFor(PATIENCE);
  const other = await context.newPage();
  await page.close();
  await other.goto(site.address);
  await other.waitForFunction(() => document.title === "third", null, PATIENCE);
  await trained(other);
  assert.deepEqual(await versions(other), ["third", "third"]);
  assert.deepEqual(problems, []);
});

test("a version that is not whole on the server is not taken", async (t) => {
  const site = await published(t);
  const { context, page, problems } = await visit(t, site);
  // The list of the second version is there, but one of its files is not yet.
  await site.publish("second");
  await site.change("worker_loader.js", (text) => text.replace("// second\n", ""));
  const end = await page.evaluate(async () => {
    const registration = await navigator.serviceWorker.getRegistration();
    return new Promise((resolve) => {
      registration.addEventListener("updatefound", () => {
        registration.installing.addEventListener("statechange", (event) => resolve(event.target.state));
      });
      document.dispatchEvent(new Event("visibilitychange"));
    });
  });
  assert.equal(end, "redundant");
  await context.setOffline(true);
  site.stop();
  await page.reload();
  await trained(page);
  assert.deepEqual(await versions(page), ["first", "first"]);
  assert.equal(await bar(page).count(), 0);
  assert.deepEqual(problems, []);
});

test("what trunk serves while somebody writes it is never kept", async (t) => {
  const site = await published(t);
  await site.change("index.html", (text) => text.replace("</body>", "<!-- {{__TRUNK_ADDRESS__}} --></body>"));
  await site.seal();
  const { page, problems } = await visit(t, site);
  await site.publish("second");
  await page.reload();
  await trained(page);
  assert.deepEqual(await versions(page), ["second", "second"]);
  assert.equal(await isInstalling(page), false);
  assert.equal(await bar(page).count(), 0);
  assert.deepEqual(problems, []);
});

test("the page can be installed", async (t) => {
  const site = await published(t);
  const { context, page, problems } = await visit(t, site);
  const address = await page.locator('link[rel="manifest"]').evaluate((link) => link.href);
  const response = await fetch(address);
  assert.equal(response.headers.get("content-type"), "application/manifest+json");
  const manifest = await response.json();
  assert.deepEqual(
    [manifest.short_name, manifest.start_url, manifest.scope, manifest.display],
    ["ape-lab", "./", "./", "standalone"],
  );
  const touch = await page.locator('link[rel="apple-touch-icon"]').evaluate((link) => link.href);
  const icons = manifest.icons.map(({ src, sizes, type }) => ({ src: new URL(src, address).href, sizes, type }));
  assert.ok(manifest.icons.some(({ purpose }) => purpose === "maskable"));
  for (const { src, sizes, type } of [...icons, { src: touch, sizes: "180x180", type: "image/png" }]) {
    const icon = await fetch(src);
    assert.equal(icon.headers.get("content-type"), type);
    const bytes = Buffer.from(await icon.arrayBuffer());
    assert.equal(bytes.subarray(1, 4).toString(), "PNG");
    assert.equal(`${bytes.readUInt32BE(16)}x${bytes.readUInt32BE(20)}`, sizes, src);
  }
  // The colours around an installed page are those of its ground.
  for (const [scheme, ground] of [["light", "rgb(247, 247, 245)"], ["dark", "rgb(21, 23, 28)"]]) {
    await page.emulateMedia({ colorScheme: scheme });
    const colours = await page.evaluate(() => {
      const metas = [...document.querySelectorAll('meta[name="theme-color"]')];
      const probe = document.body.appendChild(document.createElement("i"));
      probe.style.color = metas.find((meta) => matchMedia(meta.media).matches).content;
      const colours = [getComputedStyle(probe).color, getComputedStyle(document.body).backgroundColor];
      probe.remove();
      return colours;
    });
    assert.deepEqual(colours, [ground, ground]);
  }
  // What the browser itself says keeps it from being installed: nothing.
  const session = await context.newCDPSession(page);
  const { errors } = await session.send("Page.getAppManifest");
  assert.deepEqual(errors, []);
  const { installabilityErrors } = await session.send("Page.getInstallabilityErrors");
  assert.deepEqual(installabilityErrors.filter(({ errorId }) => errorId !== "in-incognito"), []);
  assert.deepEqual(problems, []);
});
