// The page as something to explore: the lesson, the timeline, worlds, links, files, commands.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, open, serve } from "./browser.mjs";
import { PATIENCE, SHOTS, click, digest, downloaded, drawn, figure, focus, press, says, status, trained, until, widget } from "./visitor.mjs";

let browser, site;
before(async () => {
  site = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  site?.close();
});

/** A line of the menu of exports. */
async function choose(page, line) {
  await click(page, "button", "Export and open");
  await widget(page, "button", line).waitFor(PATIENCE);
  await click(page, "button", line);
}

/** The link that the page copies. */
async function copyLink(page) {
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.evaluate(() => navigator.clipboard.writeText(""));
  await click(page, "button", "Copy link");
  return until(() => page.evaluate(() => navigator.clipboard.readText()), (text) => text !== "");
}

const live = (page) => page.locator("#mirror").getByText("On this page now").first().waitFor(PATIENCE);

test("the whole lesson: every step sets its stage and says what is on the page", async () => {
  const { page, problems, close } = await open(browser, site.address, { isNew: true });
  await trained(page);
  // Who comes for the first time is shown the way.
  await page.screenshot({ path: SHOTS + "new-1280x800-light.png" });
  await click(page, "button", "Start the lesson");
  await page.getByRole("heading", { name: "One expert has no secrets" }).waitFor(PATIENCE);
  await says(page, /^The expert returns −10\.\d, the clone \(uniform\) −10\.\d \(capped\)/);
  const next = async (title) => {
    await click(page, "button", "Next");
    await page.getByRole("heading", { name: title, exact: true }).waitFor(PATIENCE);
    await until(async () => /^(trained|given)/.test(await status(page).textContent()), (is) => is);
  };
  await next("Two experts who agree");
  await live(page);
  await until(() => figure(page, "Clone ÷ ensemble"), (ratio) => ratio < 1.1);
  // Equations have words.
  await says(page, /Equation 1 of the paper/);
  await next("β rises, and they part");
  await until(() => figure(page, "Clone ÷ ensemble"), (ratio) => ratio > 4);
  // One may play at any point: β to 0.05 less, and back to the step.
  await press(page, "ArrowDown");
  await widget(page, "button", "Show this step again").waitFor(PATIENCE);
  await trained(page);
  await click(page, "button", "Show this step again");
  await until(() => widget(page, "slider", "β").getAttribute("aria-valuenow"), (beta) => beta === "0.6");
  await next("Why the clone wanders");
  await says(page, /^Row 1, column 2\. Expert 1: .* Clone \(uniform\) with p\(1\|s\) = 0\.50, p\(2\|s\) = 0\.50/);
  await says(page, "Cell in row 1, column 2");
  await page.screenshot({ path: SHOTS + "learn-1280x800-light.png" });
  await next("A little for the experts, a lot for the clone");
  await says(page, /^Within T the ensemble needs \d\.\d steps more than the best, the clone 7\d\.\d/);
  await next("But who is the observer?");
  await until(() => figure(page, "Clone \\(occupancy\\)"), (value) => value > -16);
  assert.ok(Math.abs((await figure(page, "Clone \\(occupancy\\)")) - (await figure(page, "Ensemble"))) <= 0.5);
  await next("It must be so");
  const text = await until(
    async () => (await page.locator("#mirror").getByText(/^Left: the honest clone takes/).allTextContents())[0] ?? "",
    (text) => /together/.test(text) && /takes 18/.test(text),
  );
  const [left, , , right] = text.match(/\d+\.\d+/g).map(Number);
  assert.ok(Math.abs(left - right) < 0.02, text);
  await next("The trap, and what a cap hides");
  await says(page, /^The clone \(occupancy\) returns −90\.5 capped, −10\.8 within T/);
  await next("A clone that remembers");
  await says(page, /the clone \(uniform\) −\d+\.\d, the clone \(history\) −18\.\d \(within T\)/);
  await next("Where this leaves protection");
  assert.equal(await widget(page, "button", "Next").getAttribute("aria-disabled"), "true");
  await click(page, "button", "Draw a world");
  await page.getByRole("heading", { name: "World", exact: true }).waitFor(PATIENCE);
  assert.deepEqual(problems, []);
  await close();
});

test("a maze is drawn by mouse and keyboard, what spoils it is left out, and it is trained in", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  const before = await digest(page);
  await click(page, "radio", "Tab: World");
  const board = page.getByRole("button", { name: /^World: / });
  await board.waitFor(PATIENCE);
  const box = await board.boundingBox();
  const at = (row, col) => [box.x + (box.width * (col + 0.5)) / 10, box.y + (box.height * (row + 0.5)) / 10];
  const stroke = async (...cells) => {
    await page.mouse.move(...at(...cells[0]));
    await page.mouse.down();
    for (const cell of cells) {
      await page.mouse.move(...at(...cell), { steps: 4 });
      await drawn(page);
    }
    await page.mouse.up();
    await drawn(page);
  };
  await stroke([2, 0], [2, 8]);
  await stroke([5, 1], [5, 9]);
  await until(() => digest(page), (now) => now !== before);
  await trained(page);
  // From column 9 down to row 5 on the right and round on the left: (9, 9) is 9 + 3 + 9 + 3 + 9 + 3 away at most.
  assert.ok((await figure(page, "Optimal")) < -12);
  assert.match(page.url(), /walls=2:0-8;5:1-9/);
  // The last gap cannot be closed: a sentence says so, and nothing changes.
  const open2 = await digest(page);
  await stroke([2, 9]);
  await page.getByRole("alert").filter({ hasText: /No wall in row 2, column 9: cell \(row \d, column \d\) cannot reach the goal/ }).waitFor(PATIENCE);
  assert.equal(await digest(page), open2);
  // The flag is dragged to the other corner.
  await stroke([0, 0], [0, 5], [0, 9]);
  await until(async () => page.url(), (url) => /goal=0,9/.test(url));
  await page.screenshot({ path: SHOTS + "world-1280x800-light.png" });
  // By keyboard: the cursor stands where the last stroke began.
  await page.mouse.move(5, 5);
  await focus(page, board);
  await press(page, "ArrowDown");
  await until(() => board.getAttribute("aria-label"), (name) => name.startsWith("World: row 1, column 0, free"));
  await press(page, "Enter");
  await until(() => board.getAttribute("aria-label"), (name) => name.startsWith("World: row 1, column 0, a wall"));
  await until(async () => page.url(), (url) => /walls=1:0;2:0-8/.test(url));
  await click(page, "button", "Undo");
  await until(async () => page.url(), (url) => /walls=2:0-8;5:1-9/.test(url));
  // A world from the menu, smaller by a column.
  await click(page, "combobox", "World");
  await widget(page, "button", "Four rooms").waitFor(PATIENCE);
  await click(page, "button", "Four rooms");
  await until(async () => page.url(), (url) => /size=11x11&goal=10,10/.test(url));
  await trained(page);
  assert.deepEqual(problems, []);
  await close();
});

test("by touch a wall is drawn on a phone", async () => {
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: false };
  const { page, problems, close } = await open(browser, `${site.address}#v=1&tab=world`, phone);
  await trained(page);
  const board = page.getByRole("button", { name: /^World: / });
  const box = await board.boundingBox();
  assert.ok(box.width > 330, String(box.width));
  await page.touchscreen.tap(box.x + box.width * 0.55, box.y + box.height * 0.15);
  await until(async () => page.url(), (url) => /walls=1:5/.test(url));
  await page.screenshot({ path: SHOTS + "world-390x844-light.png" });
  assert.deepEqual(problems, []);
  await close();
});

test("back in time, on with another β, and the run that was left is kept", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  const [end, ensemble] = [await digest(page), await figure(page, "Ensemble")];
  await press(page, "Home");
  await until(() => status(page).textContent(), (text) => /^paused at update 0 of 732/.test(text));
  await until(() => figure(page, "Ensemble"), (value) => value < -90);
  for (let update = 50; update <= 400; update += 50) {
    await press(page, "Shift+ArrowRight");
    await until(() => status(page).textContent(), (text) => text.startsWith(`paused at update ${update} of 732`));
  }
  await press(page, "ArrowLeft");
  await until(() => status(page).textContent(), (text) => /^paused at update 399 of 732/.test(text));
  const then = await digest(page);
  await press(page, "End");
  await until(() => digest(page), (now) => now === end);
  assert.equal(await figure(page, "Ensemble"), ensemble);
  // By the slider: the middle of the timeline.
  await click(page, "slider", "Timeline");
  const middle = await until(() => status(page).textContent(), (text) => /^paused at update 3[3-9]\d of 732/.test(text));
  assert.notEqual(await digest(page), then);
  const update = Number(middle.match(/update (\d+)/)[1]);
  // Playing on from there is the same run again.
  await click(page, "button", "Play");
  await until(() => digest(page), (now) => now === end);
  // Another β from the middle is a branch.
  await click(page, "slider", "Timeline");
  await until(() => status(page).textContent(), (text) => text.startsWith(`paused at update ${update} of`));
  // A number field is written into once it has turned into one for text.
  const beta = widget(page, "spinbutton", "β of the branch");
  const box = await beta.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await until(() => page.evaluate(() => document.activeElement.tagName), (tag) => tag === "INPUT");
  await press(page, "Control+a");
  await page.keyboard.type("0.1", { delay: 60 });
  await press(page, "Enter");
  await until(() => beta.getAttribute("aria-valuenow"), (now) => now === "0.1");
  await click(page, "button", "Continue from here");
  await trained(page);
  await until(() => digest(page), (now) => now !== end);
  const branch = await digest(page);
  await says(page, /^— β 0\.6 · uniform · n 2 · seed 1/);
  await page.screenshot({ path: SHOTS + "branch-1280x800-light.png" });
  await until(async () => page.url(), (url) => url.includes(`turns=${update}:0.1`));
  assert.match(page.url(), new RegExp(`digest=${branch}`));
  // The branch made again from its address, in another profile.
  const other = await open(browser, page.url());
  await other.page.getByRole("status").filter({ hasText: `digest ${branch}, the same as in the link` }).waitFor(PATIENCE);
  await other.close();
  // And the run that was left, from what was kept.
  await click(page, "button", /^Show again: β 0\.6/);
  await until(() => digest(page), (now) => now === end);
  assert.deepEqual(problems, []);
  await close();
});

test("a link brings the same digest to a fresh profile, and a reload the same page", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await click(page, "button", "Next seed");
  await click(page, "radio", "Return: within T");
  await until(async () => page.url(), (url) => /seed=2/.test(url) && /return=horizon_return/.test(url));
  await trained(page);
  await press(page, "Shift+ArrowLeft");
  await until(() => status(page).textContent(), (text) => /^paused at update 682/.test(text));
  const [here, ensemble] = [await digest(page), await figure(page, "Ensemble")];
  const link = await copyLink(page);
  assert.match(link, /#v=1&seed=2&return=horizon_return&at=682&digest=[0-9a-f]{16}$/);
  const fresh = await open(browser, link);
  const same = fresh.page.getByRole("status").filter({ hasText: `digest ${here}, the same as in the link` });
  await same.waitFor(PATIENCE);
  assert.equal(await figure(fresh.page, "Ensemble within T"), ensemble);
  await fresh.page.reload();
  await same.waitFor(PATIENCE);
  assert.deepEqual(fresh.problems, []);
  await fresh.close();
  // A digest that is not that of the run is said.
  const wrong = await open(browser, link.replace(here, "0123456789abcdef"));
  await wrong.page.getByRole("status").filter({ hasText: "but the link was made with 0123456789abcdef" }).waitFor(PATIENCE);
  await wrong.close();
  assert.deepEqual(problems, []);
  await close();
});

test("a broken or old link gets a sentence and the default", async () => {
  for (const [fragment, sentence] of [
    ["v=1&beta=7", "beta=7: expected a number from 0 to 2"],
    ["v=9&beta=0.1", "v=9: expected 1"],
    ["beta=0.1", "it does not begin with v=1"],
    ["v=1&walls=0:1;1:0", "cannot reach the goal"],
    ["v=1&tab=nowhere", "tab=nowhere: expected one of learn, train"],
    ["v=1&at=5000", "at=5000: expected an update of the run, 0 to 732"],
    ["v=1&step=99", "step=99: expected a number from 1 to 10"],
    ["v=1&experts=%E2%82", "experts"],
    ["v=1&" + "x".repeat(60_000) + "=1", "it is 60006 bytes long, expected at most 50000"],
    ["v=1&file=mine.json", "This link shows the ensemble of mine.json, which is not in the link"],
  ]) {
    const { page, problems, close } = await open(browser, `${site.address}#${fragment}`);
    await page.getByRole("alert").filter({ hasText: sentence }).waitFor(PATIENCE);
    await trained(page);
    assert.equal(await digest(page), "1375181a0fdd52eb", fragment.slice(0, 50));
    assert.deepEqual(problems, []);
    await close();
  }
  // The same in a page that is open: the address is typed into its bar.
  const { page, close } = await open(browser, site.address);
  await trained(page);
  await page.evaluate(() => (location.hash = "v=1&beta=0.2&seed=5"));
  await until(() => widget(page, "slider", "β").getAttribute("aria-valuenow"), (beta) => beta === "0.2");
  await page.evaluate(() => (location.hash = "v=1&seed=none"));
  await page.getByRole("alert").filter({ hasText: "seed=none: expected a whole number" }).waitFor(PATIENCE);
  // And the address is put right.
  await until(async () => page.url(), (url) => url.endsWith("#v=1&digest=1375181a0fdd52eb"));
  await close();
});

test("what is exported comes back with the same figures, and survives a reload", async () => {
  const { page, problems, close } = await open(browser, site.address);
  // From now on: choosers are waited for only while somebody listens.
  page.on("filechooser", () => {});
  await trained(page);
  const figures = async () => [await figure(page, "Ensemble"), await figure(page, "Clone \\(uniform\\)")];
  const before = await figures();
  const ensemble = await downloaded(page, () => choose(page, "Ensemble as JSON"));
  assert.equal(ensemble.name, "ape-ensemble.json");
  const svg = await downloaded(page, () => choose(page, "Figure as SVG"));
  assert.match(svg.text, /^<svg [^]*Expert 1[^]*digest 1375181a0fdd52eb[^]*<\/svg>\s*$/);
  const png = await downloaded(page, () => choose(page, "Figure as PNG"));
  assert.equal(png.bytes.subarray(1, 4).toString(), "PNG");
  assert.ok(png.bytes.readUInt32BE(16) > 1000);
  const csv = await downloaded(page, () => choose(page, "Curve as CSV"));
  assert.match(csv.text, /^update,beta,ensemble_capped_return/);
  assert.match(csv.text.trim().split("\n").at(-1), /^732,0\.6,/);
  const model = JSON.parse((await downloaded(page, () => choose(page, "Transition model as JSON"))).text);
  assert.deepEqual(model.P["1"]["2"], [[1, 0, -1, true]]);
  // Cleared: another preset. Then the file.
  await page.evaluate(() => (location.hash = "v=1&beta=0"));
  await until(() => figure(page, "Clone ÷ ensemble"), (ratio) => ratio < 1.2);
  const choosing = page.waitForEvent("filechooser", PATIENCE);
  await press(page, "o");
  await (await choosing).setFiles({ name: "mine.json", mimeType: "application/json", buffer: ensemble.bytes });
  await says(page, "given ensemble, nothing to train");
  await until(figures, (now) => JSON.stringify(now) === JSON.stringify(before));
  await until(async () => page.url(), (url) => /file=mine\.json/.test(url));
  await page.reload();
  await says(page, "given ensemble, nothing to train");
  await until(figures, (now) => JSON.stringify(now) === JSON.stringify(before));
  // So it does where another tab has kept another file since.
  await page.evaluate(() => localStorage.setItem("ape-lab.ensemble", "other.json\n{}"));
  await page.reload();
  await says(page, "given ensemble, nothing to train");
  await until(figures, (now) => JSON.stringify(now) === JSON.stringify(before));
  // Dropped beside the picture, a file does not take the place of the page; a text may be dropped into a field.
  const isStopped = (kind, withFile) =>
    page.evaluate(
      ([kind, withFile]) => {
        const dataTransfer = new DataTransfer();
        dataTransfer.items.add(...(withFile ? [new File(["{}"], "a.json")] : ["a text", "text/plain"]));
        const event = new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true });
        document.getElementById("message").dispatchEvent(event);
        return event.defaultPrevented;
      },
      [kind, withFile],
    );
  for (const kind of ["dragover", "drop"]) {
    assert.deepEqual([await isStopped(kind, true), await isStopped(kind, false)], [true, false]);
  }
  // A file that is none changes nothing.
  const again = page.waitForEvent("filechooser", PATIENCE);
  await press(page, "o");
  await (await again).setFiles({ name: "cut.json", mimeType: "application/json", buffer: ensemble.bytes.subarray(0, 999) });
  await page.getByRole("alert").filter({ hasText: "cut.json: not an ensemble file" }).waitFor(PATIENCE);
  assert.deepEqual(await figures(), before);
  assert.deepEqual(problems, []);
  await close();
});

test("the palette finds commands, presets, worlds and tabs", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  const run = async (words) => {
    await press(page, "Control+k");
    await widget(page, "dialog", "Find a command").waitFor(PATIENCE);
    await until(() => page.evaluate(() => document.activeElement.tagName), (tag) => tag === "INPUT");
    await page.keyboard.type(words, { delay: 60 });
    await until(() => widget(page.locator("#mirror"), "textbox", "Find a command").textContent(), (text) => text === words);
    await press(page, "Enter");
    await until(() => page.getByRole("dialog").count(), (count) => count === 0);
  };
  await run("preset trap");
  await says(page, "given ensemble, nothing to train");
  await run("world maze");
  await trained(page);
  assert.ok((await figure(page, "Optimal")) < -20);
  await page.getByRole("heading", { name: "World", exact: true }).waitFor(PATIENCE);
  await run("go race");
  await page.getByRole("heading", { name: "Race", exact: true }).waitFor(PATIENCE);
  await press(page, "Control+k");
  await widget(page, "dialog", "Find a command").waitFor(PATIENCE);
  await until(() => page.evaluate(() => document.activeElement.tagName), (tag) => tag === "INPUT");
  await page.keyboard.type("xyzzy", { delay: 60 });
  await says(page, "Nothing is called “xyzzy”.");
  await press(page, "Escape");
  await until(() => page.getByRole("dialog").count(), (count) => count === 0);
  assert.deepEqual(problems, []);
  await close();
});

test("by keyboard alone: tabs, training, moments, pins, help", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  const tabs = ["Learn", "Train", "World", "Race", "β sweep", "Attack bench", "Table 1"];
  for (const [index, tab] of tabs.entries()) {
    await press(page, String(index + 1));
    await until(() => widget(page, "radio", `Tab: ${tab}`).getAttribute("aria-checked"), (is) => is === "true");
  }
  await press(page, "2");
  // The lesson has left its first step on the page.
  await press(page, "r");
  await until(() => status(page).textContent(), (text) => /^paused at update 0 of/.test(text));
  await press(page, "s");
  await until(() => status(page).textContent(), (text) => /^paused at update 1 of/.test(text));
  await press(page, "p");
  await says(page, /^— β 0 · uniform · n 1 · seed 1/);
  await press(page, "Space");
  await trained(page);
  await press(page, "ArrowUp");
  await until(() => widget(page, "slider", "β").getAttribute("aria-valuenow"), (beta) => beta === "0.05");
  await press(page, "?");
  await page.getByRole("dialog", { name: "What is this?" }).waitFor(PATIENCE);
  await press(page, "Escape");
  await until(() => page.getByRole("dialog").count(), (count) => count === 0);
  await press(page, "t");
  const table = page.getByRole("dialog", { name: "Policies as a table" });
  await table.getByRole("rowheader").nth(5).waitFor({ state: "attached", ...PATIENCE });
  await press(page, "Escape");
  await press(page, "c");
  await until(() => page.evaluate(() => localStorage.getItem("ape-lab.preferences")), (text) => /"color_map":1/.test(text));
  await page.reload();
  await trained(page);
  await click(page, "button", "Settings");
  await until(() => widget(page, "radio", "Colours: Cividis").getAttribute("aria-checked"), (is) => is === "true");
  assert.deepEqual(problems, []);
  await close();
});

test("text can be larger, and nothing is cut off", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await click(page, "button", "Settings");
  await click(page, "radio", "Text size: 160 %");
  await drawn(page);
  await press(page, "Escape");
  for (const tab of ["1", "2", "3", "4", "5", "6", "7"]) {
    await press(page, tab);
    await drawn(page);
    const beyond = await page.evaluate(() =>
      [...document.querySelectorAll("#mirror *")].filter((e) => e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML.slice(0, 200)),
    );
    assert.deepEqual(beyond, [], `tab ${tab}`);
  }
  await page.screenshot({ path: SHOTS + "large-1280x800-light.png" });
  assert.deepEqual(problems, []);
  await close();
});
