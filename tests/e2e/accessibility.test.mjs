// The page by keyboard and by screen reader: what assistive technology finds in the mirror of the page, and what it
// can do there. The mouse is not used.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { after, before, test } from "node:test";
import { launch, open, serve } from "./browser.mjs";
import { PATIENCE, focus, focused, press, trained, until, widget } from "./visitor.mjs";

const AXE = fileURLToPath(new URL("./node_modules/axe-core/axe.min.js", import.meta.url));

let browser, site;
before(async () => {
  site = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  site?.close();
});

/** What a screen reader does to activate an element. */
const activate = (locator) => locator.evaluate((element) => element.click());

test("axe finds nothing to object to", async () => {
  const { page, close } = await open(browser, site.address);
  await trained(page);
  // Not as an element: the page's policy allows no such script.
  await page.evaluate(await readFile(AXE, "utf8"));
  const check = async (place) => {
    const { violations } = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
    const found = violations.map(({ id, help, nodes }) => ({ id, help, nodes: nodes.slice(0, 3).map((node) => node.html) }));
    assert.deepEqual(found, [], place);
  };
  await check("start");
  await activate(widget(page, "combobox", "Preset"));
  await page.getByRole("dialog", { name: "Preset" }).getByRole("button", { name: "Trap", exact: true }).waitFor(PATIENCE);
  assert.equal(await widget(page, "combobox", "Preset").getAttribute("aria-expanded"), "true");
  await check("preset menu");
  await press(page, "Escape");
  await until(() => widget(page, "combobox", "Preset").getAttribute("aria-expanded"), (is) => is === "false");

  await activate(widget(page, "button", "What is this?"));
  await page.getByRole("dialog", { name: "What is this?" }).getByRole("heading", { name: "What to try" }).waitFor(PATIENCE);
  await check("help");
  await activate(widget(page, "button", "Close"));
  await until(() => page.getByRole("dialog").count(), (count) => count === 0);

  await activate(widget(page, "button", "Advanced"));
  await until(() => widget(page, "button", "Advanced").getAttribute("aria-expanded"), (is) => is === "true");
  await check("advanced settings");
  for (const [name, button, sign] of [
    ["find a command", "Find a command", widget(page, "dialog", "Find a command")],
    ["settings", "Settings", widget(page, "radio", "Text size: 130 %")],
    ["export", "Export and open", widget(page, "button", "Curve as CSV")],
  ]) {
    await activate(widget(page, "button", button));
    await sign.waitFor(PATIENCE);
    await check(name);
    await press(page, "Escape");
    await sign.waitFor({ state: "detached", ...PATIENCE });
  }
  await page.keyboard.press("t");
  await widget(page, "dialog", "Policies as a table").getByRole("rowheader").first().waitFor({ state: "attached", ...PATIENCE });
  await check("policies as a table");
  await press(page, "Escape");
  for (const [tab, title] of [
    ["Learn", "One expert has no secrets"],
    ["World", "World"],
    ["Race", "Race"],
    ["β sweep", /β/],
    ["Table 1", /Table 1/],
    ["Attack bench", /Attack bench/],
  ]) {
    await activate(widget(page, "radio", `Tab: ${tab}`));
    await page.getByRole("heading", { level: 2, name: title }).first().waitFor(PATIENCE);
    await check(tab);
  }
  // The bench again, with its table.
  await activate(widget(page, "button", "Attack the ensemble shown"));
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor({ timeout: 120_000 });
  await check("bench, done");
  await close();
});

test("Tab goes through every widget, leaves at both ends and comes back", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  const all = await page.locator('#mirror [tabindex="-1"]').evaluateAll((found) => found.map((element) => element.id));
  assert.ok(all.length > 30, String(all.length));
  const met = [];
  for (let tabs = 0; tabs < 120 && (await focused(page)) !== "end"; tabs++) {
    const before = await focused(page);
    await page.keyboard.press("Tab");
    met.push(await until(() => focused(page), (now) => now !== before && now !== null));
  }
  assert.equal(met.pop(), "end");
  assert.deepEqual(new Set(met), new Set(all));
  assert.equal(met.length, all.length);
  const last = met.at(-1);
  // From the end back to the last, and on past the end out of the page.
  await press(page, "Shift+Tab");
  assert.equal(await until(() => focused(page), (id) => id === last), last);
  await press(page, "Tab");
  await until(() => focused(page), (id) => id === "end");
  await press(page, "Tab");
  assert.ok(!["canvas", "end"].includes(await page.evaluate(() => document.activeElement.id)));
  // From the start in; backwards at the first out again.
  await page.locator("#start").focus();
  await press(page, "Tab");
  assert.equal(await until(() => focused(page), (id) => id === met[0]), met[0]);
  await press(page, "Tab");
  assert.equal(await until(() => focused(page), (id) => id === met[1]), met[1]);
  await press(page, "Shift+Tab");
  await until(() => focused(page), (id) => id === met[0]);
  await press(page, "Shift+Tab");
  await until(() => focused(page), (id) => id === "start");
  assert.deepEqual(problems, []);
  await close();
});

test("β by keyboard; the canvas says which widget has the focus, and the result is announced once", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  const announcer = page.locator("#announcer");
  await until(() => announcer.textContent(), (words) => /reach the goal in/.test(words));
  await page.evaluate(() => {
    window.said = [];
    const hear = () => window.said.push(document.getElementById("announcer").textContent);
    new MutationObserver(hear).observe(document.getElementById("announcer"), { childList: true, characterData: true, subtree: true });
  });
  const slider = widget(page, "slider", "β");
  const id = await slider.getAttribute("id");
  for (let tabs = 0; tabs < 60 && (await focused(page)) !== id; tabs++) await press(page, "Tab");
  assert.equal(await focused(page), id);
  await press(page, "ArrowLeft");
  await until(() => slider.getAttribute("aria-valuenow"), (now) => now === "0.59");
  const said = () => page.evaluate(() => window.said);
  await until(said, (said) => said.length >= 1);
  await press(page, "ArrowLeft");
  await until(() => slider.getAttribute("aria-valuenow"), (now) => now === "0.58");
  await until(said, (said) => said.length >= 2);
  for (const words of await said()) assert.match(words, /reach the goal in/);
  assert.equal((await said()).length, 2, JSON.stringify(await said()));
  assert.deepEqual(problems, []);
  await close();
});

test("a screen reader activates, focuses and moves the elements of the mirror", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await activate(widget(page, "button", "Back to the start"));
  await page.getByRole("status").filter({ hasText: /^paused at update 0 / }).waitFor(PATIENCE);

  // The focus goes on to the canvas, and its keys to the widget.
  const speed = widget(page, "slider", "Speed");
  await focus(page, speed);
  assert.equal(await page.evaluate(() => document.activeElement.id), "canvas");
  await press(page, "ArrowRight");
  await until(() => speed.getAttribute("aria-valuenow"), (now) => now === "6");
  // What a swipe up on a touch screen comes to.
  await speed.evaluate((element) => element.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowUp", bubbles: true })));
  await until(() => speed.getAttribute("aria-valuenow"), (now) => now === "7");
  await speed.evaluate((element) => element.dispatchEvent(new KeyboardEvent("keydown", { key: "Home", bubbles: true })));
  await until(() => speed.getAttribute("aria-valuenow"), (now) => now === "0");

  // Typing: eframe's field has the focus and the seed's name.
  const seed = widget(page, "spinbutton", "Seed");
  await seed.focus();
  await until(() => page.evaluate(() => document.activeElement.tagName), (name) => name === "INPUT");
  await page.keyboard.press("Control+A");
  await page.keyboard.type("42");
  await press(page, "Enter");
  await until(() => seed.getAttribute("aria-valuenow"), (now) => now === "42");
  assert.equal(await page.evaluate(() => document.querySelector("#canvas + input").getAttribute("aria-label")), "Seed");
  assert.deepEqual(problems, []);
  await close();
});

test("a cell's numbers are a table; everything lies where it is seen, two pixels to a CSS pixel too", async () => {
  // Playwright's own scale factor is not that of the canvas.
  const browser = await launch("--force-device-scale-factor=2", "--window-size=1280,900");
  const { page } = await open(browser, site.address, { viewport: null });
  assert.equal(await page.evaluate(() => devicePixelRatio), 2);
  await trained(page);
  const box = await page.getByRole("img", { name: /^Optimal/ }).boundingBox();
  await page.mouse.move(box.x + box.width * 0.55, box.y + box.height * 0.35);
  await page.getByRole("heading", { name: "Cell in row 3, column 5" }).waitFor(PATIENCE);
  const table = page.getByRole("table", { name: "The cell in every panel" });
  assert.equal(await table.getByRole("row").count(), 9);
  // The same by keyboard: arrows move from cell to cell while a picture has the focus.
  await page.mouse.move(5, 5);
  await focus(page, page.getByRole("img", { name: /^Expert 1/ }));
  await press(page, "ArrowDown");
  await press(page, "ArrowLeft");
  await page.getByRole("heading", { name: "Cell in row 4, column 4" }).waitFor(PATIENCE);
  const row = table.getByRole("row").filter({ has: page.getByRole("rowheader", { name: "p(2|s)" }) });
  assert.equal(await row.getByRole("cell").count(), 5);
  assert.deepEqual(await table.getByRole("columnheader").allTextContents(), ["E1", "E2", "uniform", "occupancy", "optimal"]);
  await browser.close();
});
