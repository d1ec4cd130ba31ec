// The page served by `cargo xtask serve --dist`, from a folder deep below the root, as it may lie on any host.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { cp, mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { after, before, test } from "node:test";
import { DIST, launch, open } from "./browser.mjs";
import { PATIENCE, trained } from "./visitor.mjs";

const ROOT = fileURLToPath(new URL("../../", import.meta.url));
const PLACE = "some/deep path/lab/";

let browser, folder, server, root;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "ape-lab-"));
  await cp(DIST, join(folder, PLACE), { recursive: true });
  // Hosts read it at the root.
  await cp(join(DIST, "_headers"), join(folder, "_headers"));
  server = spawn("cargo", ["xtask", "serve", "--dist", folder], { cwd: ROOT, stdio: ["ignore", "pipe", "inherit"] });
  let said = "";
  for await (const text of server.stdout.iterator({ destroyOnReturn: false })) {
    said += text;
    root = said.match(/http:\/\/127\.0\.0\.1:\d+\//)?.[0];
    if (root) break;
  }
  assert.ok(root, said);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.kill();
  if (folder) await rm(folder, { recursive: true });
});

test("the page works from a folder deep below, with or without the slash, and then without a network", async () => {
  const address = root + encodeURI(PLACE);
  for (const way of [address, address.slice(0, -1), address + "index.html"]) {
    const { context, page, problems, close } = await open(browser, way, { offline: true });
    const outside = [];
    context.on("request", (request) => {
      if (!request.url().startsWith(address)) outside.push(request.url());
    });
    await trained(page);
    await page.waitForFunction(() => navigator.serviceWorker.controller?.state === "activated", null, PATIENCE);
    assert.equal(await page.evaluate(async () => (await navigator.serviceWorker.getRegistration()).scope), address);
    assert.ok(page.url().startsWith(address), page.url());
    await context.setOffline(true);
    await page.reload();
    await trained(page);
    assert.deepEqual(outside, []);
    assert.deepEqual(problems, []);
    await close();
  }
});

test("every file of the page comes with its type and the headers, and nothing else comes", async () => {
  const get = (path, options) => fetch(root + path, { redirect: "manual", ...options });
  for (const [file, type] of [
    ["", "text/html; charset=utf-8"],
    ["start.js", "text/javascript; charset=utf-8"],
    ["worker_bg.wasm", "application/wasm"],
    ["manifest.webmanifest", "application/manifest+json"],
    ["icons/icon-192.png", "image/png"],
  ]) {
    const answer = await get(encodeURI(PLACE) + file);
    assert.equal(answer.status, 200, file);
    assert.equal(answer.headers.get("content-type"), type);
    assert.match(answer.headers.get("content-security-policy"), /^default-src 'none';.*frame-ancestors 'none'$/);
    assert.equal(answer.headers.get("x-content-type-options"), "nosniff");
  }
  assert.equal((await get("some/nothing")).status, 404);
  assert.equal((await get("_headers")).status, 404);
  assert.equal((await get("%2e%2e/%2e%2e/etc/passwd")).status, 404);
  assert.equal((await get("", { method: "POST" })).status, 405);
});
