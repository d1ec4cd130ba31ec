// The race in headless Chromium: a click chooses the start, the racers run, a thousand agree with what is exact.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, open, serve } from "./browser.mjs";
import { PATIENCE, SHOTS, click, drawn, press, trained } from "./visitor.mjs";

let browser, site;
before(async () => {
  site = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  site?.close();
});

test("a race runs from the cell that was clicked, and a thousand agree with the exact figures", async () => {
  const { page, problems, close } = await open(browser, site.address);
  await trained(page);
  await click(page, "radio", "Tab: Race");
  await page.getByText("Nobody has raced yet").waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "race-empty-1280x800-light.png" });
  // The middle of the cell in row 8, column 6 of ten.
  await click(page, "button", /^Race board/, [0.65, 0.85]);
  await page.getByText(/^Start: row 8, column 6/).waitFor(PATIENCE);
  await click(page, "button", "Race");
  await page.getByText("Optimal: 14 steps, arrived").waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "race-under-way-1280x800-light.png" });
  await page.getByText(/^Clone \(uniform\): lost: not there after 100 steps/).waitFor(PATIENCE);
  await click(page, "button", "Race 1,000");
  await page.getByText(/^Bars: 1,000 episodes/).waitFor(PATIENCE);
  await page.getByText("100 % arrive (exact 100 %), 0 % are lost; 14.0 steps (exact 14.0)").waitFor(PATIENCE);
  await page.mouse.move(5, 5);
  await drawn(page);
  await page.screenshot({ path: SHOTS + "race-1280x800-light.png" });
  // Another start by keyboard.
  await click(page, "button", /^Race board/, [0.65, 0.85]);
  await page.keyboard.press("ArrowDown", { delay: 50 });
  await page.getByText(/^Start: row 9, column 6/).waitFor(PATIENCE);
  assert.deepEqual(problems, []);
  await close();
});

for (const [colorScheme, viewport] of [
  ["dark", { width: 1280, height: 800 }],
  ["light", { width: 390, height: 844 }],
  ["dark", { width: 390, height: 844 }],
]) {
  test(`the race fits ${viewport.width} × ${viewport.height}, ${colorScheme}`, async () => {
    const isPhone = viewport.width < 720;
    const { page, problems, close } = await open(browser, site.address, { viewport, colorScheme, hasTouch: isPhone });
    await trained(page);
    await click(page, "radio", "Tab: Race");
    await page.getByText("Nobody has raced yet").waitFor(PATIENCE);
    await page.mouse.move(viewport.width / 2, viewport.height / 2);
    await click(page, "button", "Race 1,000");
    await page.getByText(/^Bars: 1,000 episodes/).waitFor(PATIENCE);
    await drawn(page);
    const shot = `race-${viewport.width}x${viewport.height}-${colorScheme}`;
    await page.screenshot({ path: SHOTS + shot + ".png" });
    const beyond = await page.evaluate(() =>
      [...document.querySelectorAll("#mirror > *")].filter((e) => e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML),
    );
    assert.deepEqual(beyond, []);
    if (isPhone) {
      await page.mouse.wheel(0, 700);
      await drawn(page);
      await page.screenshot({ path: SHOTS + shot + "-below.png" });
    }
    assert.deepEqual(problems, []);
    await close();
  });
}
