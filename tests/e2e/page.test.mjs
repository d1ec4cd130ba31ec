// The built page in headless Chromium, as a visitor meets it. Widgets are found in the mirror of the page.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, open, serve } from "./browser.mjs";
import { PATIENCE, SHOTS, click, downloaded, drawn, figure, press, status, trained, until } from "./visitor.mjs";

let browser, site;
before(async () => {
  site = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  site?.close();
});

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
    await press(page, "Tab");
  }
  assert.equal(await slider.getAttribute("data-focus"), "true");
  assert.equal(await slider.getAttribute("aria-valuenow"), "0.6");
  for (let presses = 0; presses < 60; presses++) await page.keyboard.press("ArrowLeft", { delay: 20 });
  await until(async () => Number(await slider.getAttribute("aria-valuenow")), (beta) => beta === 0);
  await until(() => figure(page, "Clone \\(uniform\\)"), (value) => value > -12);
  // The last β's own run: what stood there before it may be of another β.
  const apart = async () => Math.abs((await figure(page, "Clone \\(uniform\\)")) - (await figure(page, "Ensemble")));
  await until(apart, (steps) => steps < 1);
  await trained(page);
  assert.ok((await apart()) < 1);
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

/** Leaves only these cloners checked. */
async function only(page, cloners) {
  const names = await page.getByRole("checkbox", { name: /^(uniform|occupancy|replay|bc|filtered|history|gru)/ }).evaluateAll((all) => all.map((e) => e.getAttribute("aria-label")));
  assert.ok(names.length >= 10, String(names));
  for (const name of names) {
    if (!cloners.includes(name)) {
      await click(page, "checkbox", name);
      await drawn(page);
    }
  }
}

/** What a click makes the page download. */
const download = (page, button) => downloaded(page, () => click(page, "button", button));

test("every cloner attacks the ensemble shown, in workers of its own", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await click(page, "radio", "Tab: Attack bench");
  await click(page, "button", "Attack the ensemble shown");
  await page.getByRole("progressbar", { name: "Progress" }).waitFor(PATIENCE);
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor({ timeout: 120_000 });
  await page.screenshot({ path: SHOTS + "bench-1280x800-light.png" });
  const csv = await download(page, "CSV");
  assert.equal(csv.name, "ape-attack.csv");
  // Ten cloners, and behaviour cloning of two kinds with four smaller numbers of pairs.
  assert.equal(csv.text.trim().split("\n").length, 1 + 10 + 8);
  const bench = JSON.parse((await download(page, "JSON")).text);
  const of = (name) => bench.attackers.find((line) => line.attacker === name);
  assert.ok(of("uniform").drop > 75 && Math.abs(of("bc(1000000)").drop) < 0.2, JSON.stringify(bench));
  assert.ok(Math.abs(of("gru(4)").imitation_gap) < 1 && Math.abs(of("history").imitation_gap) < 1e-9);

  // The ensemble as a file, read again: the same figures, and the same attack.
  const saved = await download(page, "Save the ensemble");
  assert.equal(saved.name, "ape-ensemble.json");
  const choosing = page.waitForEvent("filechooser", PATIENCE);
  await click(page, "button", "Open an ensemble …");
  await (await choosing).setFiles({ name: "mine.json", mimeType: "application/json", buffer: Buffer.from(saved.text) });
  await page.getByText("given ensemble, nothing to train").waitFor(PATIENCE);
  await only(page, ["uniform", "occupancy"]);
  await click(page, "checkbox", "learning curve: behaviour cloning from 100 to 1,000,000 pairs");
  await click(page, "button", "Attack the ensemble shown");
  await page.getByText(/^Mine.json returns/).waitFor(PATIENCE);
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor(PATIENCE);
  const again = JSON.parse((await download(page, "JSON")).text);
  assert.deepEqual(again.attackers.map((line) => line.returns), ["uniform", "occupancy"].map((name) => of(name).returns));
  assert.deepEqual(problems, []);
  await close();
});

test("a file that is no ensemble gets a sentence, and nothing is lost", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await click(page, "radio", "Tab: Attack bench");
  const ensemble = await figure(page, "Ensemble");
  const good = (await download(page, "Save the ensemble")).text;
  for (const [bytes, sentence] of [
    [good.slice(0, 5000), "cut.json: not an ensemble file: EOF"],
    [good.replace(/0\.\d+/, "NaN"), "not an ensemble file: expected value"],
    [good.replace(/\[0\.[\d.e-]+,/, "[0.99999,"), "the probabilities sum to"],
    [good.replace('"rows":10', '"rows":9'), "the policy has 100 rows: expected 90"],
    [good.replace('"version":1', '"version":7'), "version 7: this program reads version 1"],
    [Buffer.alloc(100_000_000, " "), "a file of 100 MB, expected at most 10 MB"],
  ]) {
    const choosing = page.waitForEvent("filechooser", PATIENCE);
    await click(page, "button", "Open an ensemble …");
    const chooser = await choosing;
    if (bytes.length > 50_000_000) {
      const { writeFile } = await import("node:fs/promises");
      await writeFile(SHOTS + "large.json", bytes);
      await chooser.setFiles(SHOTS + "large.json");
    } else {
      await chooser.setFiles({ name: "cut.json", mimeType: "application/json", buffer: Buffer.from(bytes) });
    }
    await page.getByRole("alert").filter({ hasText: sentence }).waitFor(PATIENCE);
    assert.equal(await figure(page, "Ensemble"), ensemble);
    await click(page, "button", "Dismiss");
    await until(() => page.getByRole("alert").count(), (count) => count === 0);
  }
  // Dropped on the page, a good one is shown.
  const data = await page.evaluateHandle((text) => {
    const data = new DataTransfer();
    data.items.add(new File([text], "dropped.json", { type: "application/json" }));
    return data;
  }, good);
  for (const event of ["dragenter", "dragover", "drop"]) await page.dispatchEvent("#canvas", event, { dataTransfer: data });
  await page.getByText("given ensemble, nothing to train").waitFor(PATIENCE);
  assert.deepEqual(problems, []);
  await close();
});

test("Table 1 and the sweep run in workers, can be cancelled, and come to the same again", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await click(page, "radio", "Tab: β sweep");
  await click(page, "button", "Sweep");
  await page.getByRole("status").filter({ hasText: /% about|%, about|left/ }).first().waitFor(PATIENCE);
  await click(page, "button", "Cancel");
  await page.getByRole("status").filter({ hasText: /^stopped after/ }).waitFor(PATIENCE);
  await click(page, "button", "Paper's table");
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "sweep-1280x800-light.png" });
  const first = (await download(page, "CSV")).text;
  await click(page, "button", "Sweep");
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor(PATIENCE);
  assert.equal((await download(page, "CSV")).text, first);
  await click(page, "radio", "Tab: Table 1");
  await only(page, ["uniform", "occupancy", "history"]);
  await click(page, "button", "Make Table 1");
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor({ timeout: 120_000 });
  await page.getByText("−44.27 ± 1.07").waitFor(PATIENCE);
  const table = JSON.parse((await download(page, "JSON")).text);
  assert.equal(table.runs.length, 5 * 6);
  await page.screenshot({ path: SHOTS + "table1-1280x800-light.png" });
  assert.deepEqual(problems, []);
  await close();
});

test("a learned clone stands in its panel once training rests", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await click(page, "combobox", "Who clones, panel 2");
  await page.getByRole("button", { name: /^gru\(4\)/ }).waitFor(PATIENCE);
  const box = await page.getByRole("button", { name: /^gru\(4\)/ }).boundingBox();
  await page.mouse.click(box.x + 30, box.y + box.height / 2);
  await page.getByRole("img", { name: /^Clone \(gru\(4\)\): arrows at the start of an episode/ }).waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "gru-1280x800-light.png" });
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

test("a program that cannot be loaded is said", async () => {
  for (const files of ["**/app-*.js", "**/app-*.wasm"]) {
    const { page, close } = await open(browser, site.address, { before: (page) => page.route(files, (route) => route.abort()) });
    await page.getByRole("alert").filter({ hasText: "could not be loaded" }).waitFor(PATIENCE);
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
    await page.getByRole("alert").filter({ hasText: "does not offer " + name }).waitFor(PATIENCE);
    await page.waitForLoadState("networkidle");
    assert.ok(await page.locator("#message").isVisible());
    await close();
  }
});
