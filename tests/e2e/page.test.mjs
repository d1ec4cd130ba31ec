// The built page in headless Chromium, as a visitor meets it. Widgets are found in the mirror of the page.
import assert from "node:assert/strict";
import { mkdir } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { after, before, test } from "node:test";
import { launch, open, serve } from "./browser.mjs";

const SHOTS = fileURLToPath(new URL("./screenshots/", import.meta.url));
const PATIENCE = { timeout: 60_000 };

let browser, site;
before(async () => {
  await mkdir(SHOTS, { recursive: true });
  site = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  site?.close();
});

const status = (page) => page.getByRole("status").first();
const trained = (page) => page.getByRole("status").filter({ hasText: /^trained/ }).waitFor(PATIENCE);

/** The number in the figure whose spoken text starts so. */
async function figure(page, start) {
  const text = await page.locator("#mirror").getByText(new RegExp("^" + start + "[^:]*: ")).textContent();
  return Number(text.split(": ")[1].replace("−", "-").replace(/ steps|×/, ""));
}

/** Clicks where a mirrored widget lies: the canvas below gets the pointer. */
async function click(page, role, name) {
  const box = await page.getByRole(role, { name, exact: true }).boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
}

/** Polls until a promise of a number satisfies a condition. */
async function until(number, condition) {
  for (let tries = 0; tries < 300; tries++) {
    const value = await number();
    if (condition(value)) return value;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  assert.fail("waited for 30 seconds");
}

test("the page trains by itself, and β moved with the keyboard changes what it shows", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  console.log(await status(page).textContent());
  assert.match(await status(page).textContent(), /update 732 of 732/);
  const ensemble = await figure(page, "Ensemble");
  const clone = await figure(page, "Clone \\(uniform\\)");
  assert.ok(ensemble >= -20 && clone <= -90, `${ensemble} ${clone}`);
  assert.equal(await figure(page, "Optimal"), -9);
  assert.equal(await page.getByRole("img").count(), 5);
  await page.screenshot({ path: SHOTS + "trained-1280x800-light.png" });

  // Tab until β has the focus.
  const slider = page.getByRole("slider", { name: "β", exact: true });
  await page.locator("#canvas").focus();
  for (let tabs = 0; tabs < 60 && (await slider.getAttribute("data-focus")) === null; tabs++) {
    await page.keyboard.press("Tab");
    await page.waitForTimeout(60);
  }
  assert.equal(await slider.getAttribute("data-focus"), "true");
  assert.equal(await slider.getAttribute("aria-valuenow"), "0.6");
  for (let presses = 0; presses < 60; presses++) await page.keyboard.press("ArrowLeft", { delay: 20 });
  await until(async () => Number(await slider.getAttribute("aria-valuenow")), (beta) => beta === 0);
  const agreeing = await until(() => figure(page, "Clone \\(uniform\\)"), (value) => value > -12);
  await trained(page);
  assert.ok(Math.abs(agreeing - (await figure(page, "Ensemble"))) < 1);
  await page.screenshot({ path: SHOTS + "beta-0-1280x800-light.png" });

  // And back: the same seed and β give the same figures.
  for (let presses = 0; presses < 60; presses++) await page.keyboard.press("ArrowRight", { delay: 20 });
  await until(() => figure(page, "Clone \\(uniform\\)"), (value) => value === clone);
  assert.equal(await until(() => figure(page, "Ensemble"), (value) => value === ensemble), ensemble);
  assert.deepEqual(problems, []);
  await close();
});

test("the trap shows a given ensemble, and each return says something else of it", async () => {
  const { page, problems, close } = await open(browser, site.address, { colorScheme: "dark" });
  await trained(page);
  await click(page, "combobox", "Preset");
  await page.getByRole("button", { name: "Trap", exact: true }).waitFor(PATIENCE);
  await click(page, "button", "Trap");
  await page.getByText("given ensemble, nothing to train").waitFor(PATIENCE);
  await until(() => figure(page, "Clone \\(occupancy\\) capped"), (value) => value < -90);
  assert.equal(await figure(page, "Clone \\(occupancy\\) capped"), -90.5);
  await click(page, "radio", "Return: within T");
  assert.equal(await until(() => figure(page, "Clone \\(occupancy\\) within T"), Number.isFinite), -10.8);
  await page.screenshot({ path: SHOTS + "trap-1280x800-dark.png" });
  assert.deepEqual(problems, []);
  await close();
});

test("a cell pointed at shows its numbers", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  const box = await page.getByRole("img", { name: /^Optimal/ }).boundingBox();
  await page.mouse.move(box.x + box.width * 0.55, box.y + box.height * 0.35);
  await page.getByText("Cell in row 3, column 5").waitFor(PATIENCE);
  await page.getByText("p(2|s)").waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "cell-1280x800-light.png" });
  assert.deepEqual(problems, []);
  await close();
});

test("on a phone everything fits the width", async () => {
  const phone = { viewport: { width: 390, height: 844 }, colorScheme: "dark", hasTouch: true };
  const { page, problems, close } = await open(browser, site.address, phone);
  await trained(page);
  const beyond = await page.evaluate(() =>
    [...document.querySelectorAll("#mirror > *")].filter((e) => e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML),
  );
  assert.deepEqual(beyond, []);
  await page.screenshot({ path: SHOTS + "trained-390x844-dark.png" });
  assert.deepEqual(problems, []);
  await close();
});

test("a worker that cannot be loaded is said, and can be started again", async () => {
  const before = (page) => page.route("**/worker_bg.wasm", (route) => route.abort());
  const { page, close } = await open(browser, site.address, { before });
  await page.getByRole("alert").filter({ hasText: "could not be loaded" }).waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "no-worker-1280x800-light.png" });
  await page.unroute("**/worker_bg.wasm");
  await click(page, "button", "Restart the worker");
  await trained(page);
  assert.equal(await page.getByRole("alert").count(), 0);
  await close();
});

test("a worker that dies leaves the page as it was", async () => {
  const { page, close } = await open(browser, site.address);
  await trained(page);
  const ensemble = await figure(page, "Ensemble");
  await page.workers()[0].evaluate(() => setTimeout(() => { throw new Error("out of luck"); }));
  await page.getByRole("alert").filter({ hasText: "out of luck" }).waitFor(PATIENCE);
  assert.equal(await figure(page, "Ensemble"), ensemble);
  await click(page, "button", "Restart the worker");
  await until(() => page.getByRole("alert").count(), (count) => count === 0);
  await trained(page);
  assert.equal(await until(() => figure(page, "Ensemble"), (value) => value === ensemble), ensemble);
  await close();
});

test("a program that cannot be loaded is said", async () => {
  for (const files of ["**/app-*.js", "**/app-*.wasm"]) {
    const { page, close } = await open(browser, site.address, { before: (page) => page.route(files, (route) => route.abort()) });
    await page.getByText("could not be loaded").waitFor(PATIENCE);
    await close();
  }
});

test("without WebGL 2, WebAssembly or workers the page says what is missing", async () => {
  for (const [name, script] of [
    ["WebGL 2", () => { HTMLCanvasElement.prototype.getContext = () => null; }],
    ["web workers", () => { delete window.Worker; }],
    ["WebAssembly", () => { delete window.WebAssembly; }],
  ]) {
    const { page, close } = await open(browser, site.address, { before: (page) => page.addInitScript(script) });
    await page.getByText("does not offer " + name).waitFor(PATIENCE);
    await page.waitForTimeout(500);
    assert.ok(await page.locator("#message").isVisible());
    await close();
  }
});
