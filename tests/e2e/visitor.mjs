// What a visitor does and sees, for all end-to-end tests. Widgets are found in the mirror of the page.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { fileURLToPath } from "node:url";

export const SHOTS = fileURLToPath(new URL("./screenshots/", import.meta.url));
mkdirSync(SHOTS, { recursive: true });

export const PATIENCE = { timeout: Number(process.env.PATIENCE ?? 60_000) };

export const status = (page) => page.getByRole("status").first();

/** Waits until a run has ended, and shows its end. */
export const trained = (page) => page.getByRole("status").filter({ hasText: /^trained/ }).waitFor(PATIENCE);

export const widget = (page, role, name) => page.getByRole(role, { name, exact: typeof name === "string" });

/** The number in the figure whose spoken text starts so. */
export async function figure(page, start) {
  const text = await page.locator("#mirror").getByText(new RegExp("^" + start + "[^:]*: ")).textContent();
  return Number(text.split(": ")[1].replace("−", "-").replace(/ steps|×/, ""));
}

/** Clicks where a mirrored widget lies: the canvas below gets the pointer. `at`: a place in it, 0 to 1. */
export async function click(page, role, name, at = [0.5, 0.5]) {
  const box = await widget(page, role, name).boundingBox();
  await page.mouse.click(box.x + box.width * at[0], box.y + box.height * at[1]);
}

/** Waits until the page has drawn what it was told: egui takes up to three frames for an event. Asks for none itself. */
export async function drawn(page) {
  const frames = () => performance.getEntriesByName("ape-lab: frame").length;
  const before = await page.evaluate(frames);
  await until(() => page.evaluate(frames), (now) => now >= before + 4);
}

/** The id that the canvas says has the focus, or that of the element which has it. */
export const focused = (page) =>
  page.evaluate(() => {
    const active = document.activeElement;
    const canvas = document.getElementById("canvas");
    // Or the field beside it, into which one types.
    return [canvas, canvas.nextElementSibling].includes(active) ? canvas.getAttribute("aria-activedescendant") : active.id;
  });

/** Gives the focus to a widget by its element in the mirror; what is pressed before egui has heard of it would go elsewhere. */
export async function focus(page, element) {
  const id = await element.getAttribute("id");
  await element.evaluate((one) => one.focus());
  await until(() => focused(page), (now) => now === id);
}

/** Presses a key, and lets the page draw. */
export async function press(page, key) {
  await page.keyboard.press(key);
  await drawn(page);
}

/** Polls until what a promise gives satisfies a condition. */
export async function until(promise, condition) {
  let value;
  for (let tries = 0; tries < 300; tries++) {
    value = await promise();
    if (await condition(value)) return value;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  assert.fail(`waited for 30 seconds: ${JSON.stringify(value)}`);
}

/** What an act makes the page download. */
export async function downloaded(page, act) {
  const coming = page.waitForEvent("download", PATIENCE);
  await act();
  const file = await coming;
  const chunks = [];
  for await (const chunk of await file.createReadStream()) chunks.push(chunk);
  const bytes = Buffer.concat(chunks);
  return { name: file.suggestedFilename(), text: bytes.toString(), bytes };
}

/** The digest that the page shows. */
export async function digest(page) {
  const text = await until(() => status(page).textContent(), (text) => /digest [0-9a-f]{16}/.test(text));
  return text.match(/digest ([0-9a-f]{16})/)[1];
}

/** Waits for a text anywhere on the page. */
export const says = (page, text) => page.locator("#mirror").getByText(text).first().waitFor(PATIENCE);
