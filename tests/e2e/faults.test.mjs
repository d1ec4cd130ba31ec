// What goes wrong around the page, and what it makes of that: workers that die, graphics that are lost, storage that is
// blocked, programs that come broken, slow and small devices, and faults of its own. docs/TESTING.md has the list.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { DIST, launch, open, serve } from "./browser.mjs";
import { PATIENCE, SHOTS, click, digest, downloaded, figure, press, says, status, trained, until, widget } from "./visitor.mjs";

let browser, site;
before(async () => {
  site = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  site?.close();
});

/** A run of twelve seconds: there is time to do something in the middle of it. */
const SLOW = "#v=1&speed=60";
const WIDE = { width: 1280, height: 800 };
const PHONE = { width: 390, height: 844 };

const alert = (page, text) => page.getByRole("alert").filter({ hasText: text });
const message = (page) => page.locator("#message");
const button = (page, name) => message(page).getByRole("button", { name, exact: true });

/** The update that is shown, of a run under way or at rest. */
async function shownUpdate(page) {
  const text = await status(page).textContent();
  return Number(text.match(/update (\d+) of/)?.[1] ?? -1);
}
const midRun = (page, update = 150) => until(() => shownUpdate(page), (now) => now >= update);

/** A line of the menu of exports, as a file. */
async function exported(page, line) {
  await click(page, "button", "Export and open");
  await widget(page, "button", line).waitFor(PATIENCE);
  return (await downloaded(page, () => click(page, "button", line))).text;
}

/** Digest and curve of the run that the page opens with. */
let undisturbed;
async function expected() {
  if (!undisturbed) {
    const { page, close } = await open(browser, site.address + SLOW.replace("60", "max"));
    await trained(page);
    undisturbed = { digest: await digest(page), curve: await exported(page, "Curve as CSV") };
    await close();
  }
  return undisturbed;
}

/** Takes a picture of the message in every size and theme. */
async function pictures(page, name) {
  for (const [size, theme] of [[WIDE, "light"], [WIDE, "dark"], [PHONE, "light"], [PHONE, "dark"]]) {
    await page.setViewportSize(size);
    await page.emulateMedia({ colorScheme: theme });
    await page.screenshot({ path: `${SHOTS}${name}-${size.width}x${size.height}-${theme}.png` });
  }
  await page.setViewportSize(WIDE);
}

/** Everything in the message lies on the page, its buttons can be pressed by a finger, and it is read out. */
async function checkMessage(page) {
  assert.equal(await message(page).getAttribute("role"), "alert");
  for (const size of [WIDE, PHONE, { width: 320, height: 480 }]) {
    await page.setViewportSize(size);
    const parts = await message(page).locator("h1, p, button, pre, summary").evaluateAll((all) =>
      all.map((part) => ({ name: part.textContent, box: part.getBoundingClientRect().toJSON() })),
    );
    for (const { name, box } of parts) assert.ok(box.left >= 0 && box.right <= size.width, `${size.width}: ${name}`);
    for (const one of await message(page).getByRole("button").all()) {
      const { width, height } = await one.boundingBox();
      assert.ok(width >= 44 && height >= 44, await one.textContent());
    }
  }
  await page.setViewportSize(WIDE);
}

/** The workers' messages, counted on the page, and the workers themselves. */
const watched = (page) =>
  page.addInitScript(() => {
    window.watch = { workers: [], sent: 0, heard: 0 };
    window.Worker = class extends Worker {
      constructor(...parts) {
        super(...parts);
        window.watch.workers.push(this);
        this.addEventListener("message", () => (window.watch.heard += 1));
      }
      postMessage(...parts) {
        window.watch.sent += 1;
        super.postMessage(...parts);
      }
    };
  });

/** Has the program of the training worker panic: an error of the browser's that nobody hears leaves its state in use. */
async function panic(page) {
  await page.workers().at(-1).evaluate(() => {
    self.addEventListener("error", (event) => event.preventDefault());
    // Whatever it is told next; the page may have nothing to tell.
    const next = () => self.dispatchEvent(new MessageEvent("message", { data: "nothing" }));
    self.addEventListener("error", next, { once: true });
    performance.now = () => {
      delete performance.now;
      throw new Error("no clock");
    };
  });
}

for (const [fault, sentence, cause] of [
  ["throws", /out of luck/, (page) => page.workers()[0].evaluate(() => setTimeout(() => { throw new Error("out of luck"); }))],
  ["is ended without a word", /the browser has ended it/, (page) => page.workers()[0].evaluate(() => self.close())],
  ["panics", /borrowed.*, .*\.rs:\d+:\d+/, panic],
]) {
  test(`a worker that ${fault} in the middle of a run is replaced, and the run goes on to the same end`, async () => {
    const { digest: end, curve } = await expected();
    const { page, close } = await open(browser, site.address + SLOW, { before: watched });
    const before = await midRun(page);
    await cause(page);
    await alert(page, "it was started again and goes on from update").waitFor(PATIENCE);
    const said = await alert(page, sentence).textContent();
    assert.ok(Number(said.match(/from update (\d+)\./)[1]) >= before, said);
    await page.screenshot({ path: SHOTS + `worker-${fault.split(" ")[0]}-1280x800-light.png` });
    // Nothing that was seen is seen again. (While it is made again the status says how far that is.)
    assert.ok((await until(() => shownUpdate(page), (update) => update >= 0)) >= before);
    await click(page, "button", "Dismiss");
    await trained(page);
    assert.equal(await digest(page), end);
    assert.equal(await exported(page, "Curve as CSV"), curve);
    assert.equal(await page.evaluate(() => window.watch.workers.length), 2);
    await close();
  });
}

test("what is no message, or too long for one, is refused with a sentence, and the run goes on", async () => {
  const { digest: end } = await expected();
  const { page, problems, close } = await open(browser, site.address + SLOW, { before: watched });
  await midRun(page, 50);
  for (const [bytes, sentence] of [[2 ** 31, /could not be read \(expected bytes\)/], [null, /20000000 bytes: expected at most 16000000/]]) {
    await page.evaluate((message) => window.watch.workers[0].postMessage(message ?? new ArrayBuffer(2e7)), bytes);
    await alert(page, sentence).waitFor(PATIENCE);
    await click(page, "button", "Dismiss");
  }
  assert.equal(await page.evaluate(() => window.watch.workers.length), 1);
  // From the worker: it is not trusted any more, and what it says is shown in a length that can be read.
  const forge = (data) => page.evaluate((data) => window.watch.workers.at(-1).dispatchEvent(new MessageEvent("message", { data: data ?? new ArrayBuffer(2e7) })), data);
  for (const [data, sentence] of [[null, /20000000 bytes: expected at most 16000000.*started again/], ["x".repeat(1e6), /^x{600}….*started again/]]) {
    await forge(data);
    await alert(page, sentence).waitFor(PATIENCE);
    await click(page, "button", "Dismiss");
    // One that is lost before it was there would not be replaced.
    const now = await shownUpdate(page);
    await until(() => shownUpdate(page), (update) => update > now);
  }
  await trained(page);
  assert.equal(await digest(page), end);
  assert.deepEqual(problems, []);
  await close();
});

test("a worker that dies again and again is not started for ever", async () => {
  const { page, context, close } = await open(browser, site.address + SLOW, { before: watched });
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await midRun(page, 50);
  for (let times = 0; times < 4; times++) {
    // Each time once the run goes on.
    const now = await shownUpdate(page);
    await until(() => shownUpdate(page), (update) => update > now);
    await panic(page);
    if (times < 3) await page.waitForFunction((count) => window.watch.workers.length === count, times + 2, PATIENCE);
  }
  await alert(page, "training needs a new worker").waitFor(PATIENCE);
  assert.equal(await page.evaluate(() => window.watch.workers.length), 4);
  await click(page, "button", "Copy the report");
  const report = await until(() => page.evaluate(() => navigator.clipboard.readText()), (text) => text !== "");
  for (const line of [/^ape-lab \d+\.\d+\.\d+$/m, /borrowed.*, .*\.rs:\d+/, /to session: Resume/, /from session: Snapshot/, /speed=60/]) {
    assert.match(report, line);
  }
  await pictures(page, "worker-failed");
  const now = await shownUpdate(page);
  // Once the page has its old width again, the button has come to its place.
  const restart = widget(page, "button", "Restart the worker");
  await until(async () => (await restart.boundingBox())?.x ?? 0, (x) => x > PHONE.width);
  await click(page, "button", "Restart the worker");
  await until(() => shownUpdate(page), (update) => update > now);
  await close();
});

test("a worker of an experiment that dies fails its task with a sentence, and is replaced", async () => {
  const { page, close } = await open(browser, site.address, { before: watched });
  await trained(page);
  await click(page, "radio", "Tab: β sweep");
  await click(page, "button", "Sweep");
  await page.waitForFunction(() => window.watch.workers.length >= 2, null, PATIENCE);
  await page.getByRole("status").filter({ hasText: /^[1-9]\d* %/ }).waitFor(PATIENCE);
  // One of them that has just been given a task: between two tasks it would only be replaced.
  await page.evaluate(
    () =>
      new Promise((resolve) => {
        const worker = window.watch.workers.at(-1);
        const post = worker.postMessage;
        worker.postMessage = function (...parts) {
          post.apply(this, parts);
          setTimeout(() => resolve(worker.terminate()));
        };
      }),
  );
  await says(page, /The worker has stopped/);
  await page.getByRole("status").filter({ hasText: /^stopped after .* of .* done/ }).waitFor({ timeout: 120_000 });
  await page.screenshot({ path: SHOTS + "task-failed-1280x800-light.png" });
  // All others were done, and the next sweep has all its workers.
  const [, done, all] = (await page.getByRole("status").filter({ hasText: /^stopped after/ }).textContent()).match(/with (\d+) of (\d+) done/);
  assert.equal(Number(done), Number(all) - 1);
  await click(page, "button", "Sweep");
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor({ timeout: 120_000 });
  await close();
});

/** The share of pixels that are plainly of another colour in two screenshots. */
const difference = (page, ...pictures) =>
  page.evaluate(async (pictures) => {
    const [one, other] = await Promise.all(
      pictures.map(async (bytes) => {
        const image = await createImageBitmap(new Blob([Uint8Array.from(bytes)]));
        const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d");
        canvas.drawImage(image, 0, 0);
        return canvas.getImageData(0, 0, image.width, image.height).data;
      }),
    );
    const differs = one.filter((value, index) => Math.abs(value - other[index]) > 32).length;
    return one.length === other.length ? differs / one.length : 1;
  }, pictures.map((picture) => [...picture]));

test("graphics that are lost come back, with everything that was there", async () => {
  const { page, problems, close } = await open(browser, site.address, { before: watched });
  await trained(page);
  const end = await digest(page);
  // Something that is in no address: a run kept to compare with.
  await press(page, "p");
  await click(page, "button", "Advanced");
  await until(() => widget(page, "button", "Advanced").getAttribute("aria-expanded"), (is) => is === "true");
  await page.locator("#canvas").focus();
  const still = async () => {
    let last;
    return until(
      async () => [last, (last = await page.screenshot())],
      ([before, now]) => before?.equals(now),
    ).then(([now]) => now);
  };
  const picture = await still();
  await page.evaluate(() => {
    window.loser = document.getElementById("canvas").getContext("webgl2").getExtension("WEBGL_lose_context");
    window.loser.loseContext();
  });
  await alert(page, "taken the page's graphics away").waitFor(PATIENCE);
  assert.ok(await button(page, "Reload").isVisible());
  await checkMessage(page);
  await pictures(page, "graphics-lost");
  await page.emulateMedia({ colorScheme: null });
  await page.evaluate(() => window.loser.restoreContext());
  await message(page).waitFor({ state: "hidden", ...PATIENCE });
  assert.equal(await digest(page), end);
  assert.equal(await widget(page, "button", "Advanced").getAttribute("aria-expanded"), "true");
  await page.locator("#canvas").focus();
  const differing = await difference(page, picture, await still());
  assert.ok(differing < 0.001, `${(100 * differing).toFixed(2)} % of the picture is not as it was`);
  // It listens as before, and once: by mouse, by keyboard, in the mirror.
  await click(page, "button", "Advanced");
  await until(() => widget(page, "button", "Advanced").getAttribute("aria-expanded"), (is) => is === "false");
  await widget(page, "button", "Advanced").evaluate((element) => element.click());
  await until(() => widget(page, "button", "Advanced").getAttribute("aria-expanded"), (is) => is === "true");
  await press(page, "ArrowDown");
  await until(() => widget(page, "slider", "β").getAttribute("aria-valuenow"), (beta) => beta === "0.55");
  await trained(page);
  assert.notEqual(await digest(page), end);
  assert.equal(await page.evaluate(() => window.watch.workers.length), 1);
  // The browser says itself that the context was lost, nothing more.
  assert.deepEqual(problems.filter((problem) => !/CONTEXT_LOST_WEBGL/.test(problem)), []);
  await close();
});

test("graphics that are lost in the middle of a run, again and again, do not end it", async () => {
  const { digest: end } = await expected();
  const { page, close } = await open(browser, site.address + SLOW);
  for (const update of [50, 200, 350]) {
    await midRun(page, update);
    await page.evaluate(() => {
      window.loser = document.getElementById("canvas").getContext("webgl2").getExtension("WEBGL_lose_context");
      window.loser.loseContext();
    });
    await page.evaluate(() => ((window.left ??= []).push(document.getElementById("canvas"))));
    await alert(page, "taken the page's graphics away").waitFor(PATIENCE);
    await page.evaluate(() => window.loser.restoreContext());
    await message(page).waitFor({ state: "hidden", ...PATIENCE });
  }
  await trained(page);
  // The canvases before hold nothing on the graphics card.
  const held = () => window.left.map((canvas) => [canvas.getContext("webgl2").isContextLost(), canvas.width, canvas.height]);
  assert.deepEqual(await page.evaluate(held), Array(3).fill([true, 1, 1]));
  assert.equal(await digest(page), end);
  await close();
});

/** Gives the page `look(away)`, which hides it, and shows it again a minute later. */
const hide = (page) =>
  page.addInitScript(() => {
    // A hidden page has no frames; its clock goes on.
    let isHidden = false;
    let skipped = 0;
    const held = [];
    const request = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (callback) => (isHidden ? held.push(callback) : request(callback));
    const now = performance.now.bind(performance);
    performance.now = () => now() + skipped;
    Object.defineProperty(document, "hidden", { get: () => isHidden });
    Object.defineProperty(document, "visibilityState", { get: () => (isHidden ? "hidden" : "visible") });
    window.look = (away) => {
      isHidden = away;
      if (!away) {
        skipped += 60_000;
        held.splice(0).forEach((callback) => request(callback));
      }
      document.dispatchEvent(new Event("visibilitychange"));
    };
  });

/** Waits until nothing is heard of the workers: twenty looks in a row find nothing new. Returns when they were last heard. */
async function silence(page) {
  let [last, looks, at] = [-1, 0, 0];
  await until(
    async () => {
      const now = await page.evaluate(() => window.watch.heard);
      looks = now === last ? looks + 1 : 0;
      if (looks === 0) [last, at] = [now, Date.now()];
      return looks;
    },
    (looks) => looks === 20,
  );
  return at;
}

test("an experiment goes on while the page is hidden, and says how long it took", async () => {
  const { page, problems, close } = await open(browser, site.address, {
    before: async (page) => {
      await watched(page);
      await hide(page);
    },
  });
  await trained(page);
  await click(page, "radio", "Tab: β sweep");
  await click(page, "button", "Sweep");
  await page.getByRole("status").filter({ hasText: /^\d+ %/ }).waitFor(PATIENCE);
  const begun = Date.now();
  await page.evaluate(() => window.look(true));
  const worked = ((await silence(page)) - begun) / 1000;
  await page.evaluate(() => window.look(false));
  const done = page.getByRole("status").filter({ hasText: /^done in/ });
  await done.waitFor(PATIENCE);
  const text = await done.textContent();
  // Not as long as the last picture was young, nor with the minute that nobody looked.
  const [seconds, times] = [/done in ([\d.]+) s/, /([\d.]+) of \d+ workers busy/].map((part) => Number(text.match(part)?.[1] ?? 1));
  assert.ok(seconds > worked - 0.5 && seconds < 60 && times <= (await page.evaluate(() => navigator.hardwareConcurrency)), text);
  assert.deepEqual(problems, []);
  await close();
});

test("while the page is hidden training waits, and on return there is no flood", async () => {
  const { digest: end } = await expected();
  const { page, problems, close } = await open(browser, site.address + SLOW, {
    before: async (page) => {
      await watched(page);
      await hide(page);
    },
  });
  await midRun(page, 100);
  await page.evaluate(() => window.look(true));
  await page.workers()[0].evaluate(() => {
    const now = performance.now.bind(performance);
    performance.now = () => now() + 60_000;
  });
  const heard = () => page.evaluate(() => window.watch.heard);
  await silence(page);
  const before = await heard();
  const update = await shownUpdate(page);
  await page.evaluate(() => window.look(false));
  await until(() => shownUpdate(page), (now) => now > update);
  // The updates that come with the first messages follow those that were seen: the run has waited.
  assert.ok((await shownUpdate(page)) < update + 120, `${update} ${await shownUpdate(page)}`);
  assert.ok((await heard()) - before < 120);
  await trained(page);
  assert.equal(await digest(page), end);
  assert.deepEqual(problems, []);
  await close();
});

test("a reload in the middle of a run brings back what was set, and the run comes to the same", async () => {
  const fragment = "#v=1&beta=0.3&seed=4&experts=3&tab=train&cell=2,3&return=success&speed=max";
  const { page: other, close: closeOther } = await open(browser, site.address + fragment);
  await trained(other);
  const end = await digest(other);
  await closeOther();

  const { page, problems, close } = await open(browser, site.address + fragment.replace("speed=max", "speed=60").replace("beta=0.3", "beta=0.35"));
  await midRun(page, 30);
  // Set in the middle of the run, and trained for at once: β, and by it another run.
  await press(page, "ArrowDown");
  await until(() => widget(page, "slider", "β").getAttribute("aria-valuenow"), (beta) => beta === "0.3");
  // Trained on, so that it is in the middle of a run again.
  await trained(page);
  await press(page, "r");
  await press(page, "Space");
  await midRun(page, 30);
  assert.match(await status(page).textContent(), /^training/);
  await until(async () => page.url(), (url) => /beta=0\.3(&|$)/.test(url) && !/digest/.test(url));
  await page.reload();
  await midRun(page, 10);
  assert.match(await status(page).textContent(), /^training/);
  assert.equal(await widget(page, "slider", "β").getAttribute("aria-valuenow"), "0.3");
  await says(page, "Cell in row 2, column 3");
  assert.equal(await page.getByRole("img", { name: /^Expert/ }).count(), 3);
  assert.equal(await widget(page, "radio", "Return: success").getAttribute("aria-checked"), "true");
  await trained(page);
  assert.equal(await digest(page), end);
  assert.deepEqual(problems, []);
  await close();
});

for (const [how, script] of [
  ["blocked", () => {
    for (const name of ["localStorage", "sessionStorage"]) {
      Object.defineProperty(window, name, { get() { throw new DOMException("The operation is insecure.", "SecurityError"); } });
    }
  }],
  ["full", () => {
    Storage.prototype.setItem = () => { throw new DOMException("The quota has been exceeded.", "QuotaExceededError"); };
  }],
]) {
  test(`where storage is ${how} the page works, and says so once`, async () => {
    const { page, problems, close } = await open(browser, site.address, { isNew: true, before: (page) => page.addInitScript(script) });
    await trained(page);
    assert.equal(await page.getByRole("alert").count(), 0);
    const prefer = async (radio) => {
      await click(page, "button", "Settings");
      await widget(page, "radio", radio).waitFor(PATIENCE);
      await click(page, "radio", radio);
      await until(() => widget(page, "radio", radio).getAttribute("aria-checked"), (is) => is === "true");
      await press(page, "Escape");
      await widget(page, "radio", radio).waitFor({ state: "detached", ...PATIENCE });
    };
    await prefer("Theme: dark");
    await alert(page, "holds for this visit").waitFor(PATIENCE);
    await page.screenshot({ path: SHOTS + `storage-${how}-1280x800-dark.png` });
    await click(page, "button", "Dismiss");
    await until(() => page.getByRole("alert").count(), (count) => count === 0);
    await prefer("Theme: light");
    assert.equal(await page.getByRole("alert").count(), 0);
    assert.deepEqual(problems, []);
    await close();
  });
}

test("what goes wrong in extensions while the page is loaded is not its fault", async () => {
  const before = (page) =>
    page.addInitScript(() => {
      const foreign = new Error("not ours");
      foreign.stack = "Error: not ours\n    at chrome-extension://abc/content.js:1:1";
      addEventListener("DOMContentLoaded", () => {
        const filename = "chrome-extension://abc/content.js";
        dispatchEvent(new ErrorEvent("error", { message: "not ours", filename, error: foreign }));
        dispatchEvent(new PromiseRejectionEvent("unhandledrejection", { promise: Promise.resolve(), reason: foreign }));
      });
    });
  const { page, problems, close } = await open(browser, site.address, { before });
  await trained(page);
  assert.equal(await page.getByRole("alert").count(), 0);
  assert.deepEqual(problems, []);
  await close();
});

/** A file of the page as it should not come. */
const BROKEN = {
  "cut short": (bytes) => ({ contentType: "application/wasm", body: bytes.subarray(0, bytes.length / 2) }),
  missing: () => ({ status: 404, contentType: "text/html", body: "<h1>Not found</h1>" }),
  "a page of HTML": () => ({ contentType: "text/html", body: "<!doctype html><title>Welcome</title>" }),
};
const program = async (route) => readFile(join(DIST, new URL(route.request().url()).pathname));

for (const [how, answer] of Object.entries(BROKEN)) {
  test(`a program that comes ${how} is said, and a reload tries again`, async () => {
    const before = (page) => page.route("**/app-*.wasm", async (route) => route.fulfill(answer(await program(route))));
    const { page, close } = await open(browser, site.address, { before });
    await alert(page, "The program could not be loaded").waitFor(PATIENCE);
    if (how === "missing") {
      await checkMessage(page);
      await pictures(page, "not-loaded");
    }
    await page.unroute("**/app-*.wasm");
    await button(page, "Reload").click();
    await trained(page);
    await close();
  });

  test(`a worker that comes ${how} is said, and can be started again`, async () => {
    const before = (page) => page.route("**/worker_bg.wasm", async (route) => route.fulfill(answer(await program(route))));
    const { page, close } = await open(browser, site.address, { before });
    await alert(page, "The worker could not be loaded").waitFor(PATIENCE);
    await page.unroute("**/worker_bg.wasm");
    await click(page, "button", "Restart the worker");
    await trained(page);
    assert.equal(await page.getByRole("alert").count(), 0);
    await close();
  });
}

for (const [how, answer] of [
  ["cannot be fetched", (route) => route.abort()],
  ["is missing", (route) => route.fulfill({ status: 404, contentType: "text/html", body: "<h1>Not found</h1>" })],
]) {
  test(`a worker whose script ${how} is said, and can be started again`, async () => {
    const { page, close } = await open(browser, site.address, { before: (page) => page.route("**/worker_loader.js", answer) });
    await alert(page, "its script could not be loaded").waitFor(PATIENCE);
    assert.ok(await page.evaluate(() => window.pageCanPaint()));
    await page.unroute("**/worker_loader.js");
    await click(page, "button", "Restart the worker");
    await trained(page);
    assert.equal(await page.getByRole("alert").count(), 0);
    // A worker of an experiment fails its task alone.
    await page.route("**/worker_loader.js", answer);
    await click(page, "radio", "Tab: β sweep");
    await widget(page, "button", "Sweep").waitFor(PATIENCE);
    await click(page, "button", "Sweep");
    await says(page, /its script could not be loaded/);
    assert.equal(await page.evaluate(() => window.pageCanPaint()), true);
    await close();
  });
}

test("a worker that never comes can be replaced, and is not waited for in silence", async () => {
  // Its program is asked for and the first time not answered: nothing has failed.
  let asked = 0;
  const before = (page) => page.route("**/worker_bg.wasm", (route) => (asked++ === 0 ? null : route.continue()));
  const { page, problems, close } = await open(browser, site.address, { before });
  await alert(page, "The worker does not answer").waitFor(PATIENCE);
  await page.screenshot({ path: SHOTS + "worker-silent-1280x800-light.png" });
  await click(page, "button", "Restart the worker");
  await trained(page);
  assert.equal(await page.getByRole("alert").count(), 0);
  assert.equal(asked, 2);
  // One of an experiment's workers: the others work, and who cancels can begin again.
  asked = 0;
  await click(page, "radio", "Tab: β sweep");
  await widget(page, "button", "Sweep").waitFor(PATIENCE);
  await click(page, "button", "Sweep");
  await says(page, /^A worker does not answer/);
  await click(page, "button", "Cancel");
  await page.getByRole("status").filter({ hasText: /^stopped after/ }).waitFor(PATIENCE);
  await click(page, "button", "Sweep");
  await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor(PATIENCE);
  assert.deepEqual(problems, []);
  await close();
});

test("programs of the wrong type work all the same", async () => {
  const before = (page) =>
    page.route("**/*.wasm", async (route) => route.fulfill({ contentType: "application/octet-stream", body: await program(route) }));
  const { page, problems, close } = await open(browser, site.address, { before });
  await trained(page);
  assert.ok(problems.every((problem) => /MIME type/.test(problem)), String(problems));
  await close();
});

test("on a device twenty times as slow the page stays usable", async () => {
  const { page, problems, close } = await open(browser, site.address);
  // A reload while the program is on its way is an error in the page that is left.
  await trained(page);
  const debug = await page.context().newCDPSession(page);
  await debug.send("Emulation.setCPUThrottlingRate", { rate: 20 });
  await page.reload();
  await trained(page);
  await press(page, "ArrowDown");
  await until(() => widget(page, "slider", "β").getAttribute("aria-valuenow"), (beta) => beta === "0.55");
  await trained(page);
  await click(page, "radio", "Tab: Learn");
  await page.getByRole("heading", { name: "One expert has no secrets" }).waitFor(PATIENCE);
  await debug.send("Emulation.setCPUThrottlingRate", { rate: 1 });
  assert.deepEqual(problems, []);
  await close();
});

test("on a screen of 320 × 480 and with little memory nothing overlaps", async () => {
  // 48 MB for JavaScript's heap.
  const small = await launch("--js-flags=--max-old-space-size=48", "--enable-low-end-device-mode");
  const { page, problems, close } = await open(small, site.address, { viewport: { width: 320, height: 480 }, hasTouch: true });
  await trained(page);
  for (const tab of ["Train", "Learn", "World", "Race", "β sweep", "Attack bench", "Table 1"]) {
    await page.mouse.wheel(0, -100_000);
    await until(async () => (await widget(page, "radio", `Tab: ${tab}`).boundingBox()).y, (y) => y > 0 && y < 440);
    await click(page, "radio", `Tab: ${tab}`);
    await until(() => widget(page, "radio", `Tab: ${tab}`).getAttribute("aria-checked"), (is) => is === "true");
    const faults = await page.evaluate(() => {
      const all = [...document.querySelectorAll('#mirror [role="button"], #mirror [role="radio"], #mirror [role="checkbox"], #mirror [role="combobox"], #mirror [role="slider"]')];
      const boxes = all.map((part) => [part.getAttribute("aria-label") ?? part.textContent, part.getBoundingClientRect()]);
      const beyond = boxes.filter(([, box]) => box.left < -1 || box.right > innerWidth + 1).map(([name]) => `${name} is cut off`);
      const over = [];
      boxes.forEach(([a, one], index) => {
        for (const [b, other] of boxes.slice(index + 1)) {
          const width = Math.min(one.right, other.right) - Math.max(one.left, other.left);
          const height = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
          if (width > 1 && height > 1) over.push(`${a} overlaps ${b}`);
        }
      });
      return [...beyond, ...over];
    });
    assert.deepEqual(faults, [], tab);
    await page.screenshot({ path: `${SHOTS}small-${tab.replace(/\W+/g, "-")}-320x480-light.png` });
  }
  assert.deepEqual(problems, []);
  await close();
  await small.close();
});

/** Lets the memory be seen that the programs of page and worker have, as `testMemory`. */
async function weighed(page) {
  const look = `const { instantiateStreaming } = WebAssembly;
    WebAssembly.instantiateStreaming = async (...parts) => {
      const made = await instantiateStreaming.apply(WebAssembly, parts);
      self.testMemory = made.instance.exports.memory;
      return made;
    };`;
  await page.addInitScript(look);
  await page.route("**/worker_loader.js", async (route) => {
    const loader = await readFile(join(DIST, "worker_loader.js"), "utf8");
    await route.fulfill({ contentType: "text/javascript", body: look + loader });
  });
}

test("who plays on and on takes no more memory", async () => {
  const { page, problems, close } = await open(browser, site.address + "#v=1&speed=max", { before: weighed });
  await trained(page);
  await page.locator("#canvas").focus();
  const debug = await page.context().newCDPSession(page);
  const memory = async () => {
    await debug.send("HeapProfiler.collectGarbage");
    const { usedSize } = await debug.send("Runtime.getHeapUsage");
    const bytes = () => self.testMemory.buffer.byteLength;
    return { page: await page.evaluate(bytes), scripts: usedSize, worker: await page.workers()[0].evaluate(bytes) };
  };
  // β, playing and going back, the timeline, the tabs.
  const keys = ["ArrowUp", "ArrowUp", "ArrowDown", "r", "Space", "Shift+ArrowLeft", "ArrowLeft", "End", "1", "2", "3", "4", "5", "6", "7", "2", "ArrowDown"];
  const play = async (rounds) => {
    for (let round = 0; round < rounds; round++) for (const key of keys) await press(page, key);
  };
  await play(10);
  const before = await memory();
  await play(20);
  const after = await memory();
  console.log(`after 10 rounds ${JSON.stringify(before)}, after 30 ${JSON.stringify(after)}`);
  // A single picture of the run kept in each round would be more.
  for (const part of ["page", "scripts", "worker"]) {
    assert.ok(after[part] <= before[part] + 400_000, `${part}: ${before[part]} ${after[part]}`);
  }
  assert.deepEqual(problems, []);
  await close();
});

test("of a thousand quick moves of β the last one counts, and nothing piles up", async () => {
  const before = async (page) => {
    await watched(page);
    await weighed(page);
  };
  const { page, problems, close } = await open(browser, site.address + "#v=1&speed=max", { before });
  await trained(page);
  const slider = widget(page, "slider", "β");
  const box = await slider.boundingBox();
  const memory = () => page.workers()[0].evaluate(() => self.testMemory.buffer.byteLength);
  const counts = () => page.evaluate(() => ({ sent: window.watch.sent, heard: window.watch.heard }));
  /** Drags β to and fro, five moves a frame as a fast mouse does, and lets go at a quarter. */
  const drag = (moves) =>
    page.evaluate(
      async ([moves, { x, y, width, height }]) => {
        const canvas = document.getElementById("canvas");
        const point = (part) => ({ clientX: x + 8 + part * (width - 16), clientY: y + height / 2, bubbles: true });
        const frame = () => new Promise((resolve) => setTimeout(resolve, 16));
        canvas.dispatchEvent(new MouseEvent("mousemove", point(0)));
        await frame();
        canvas.dispatchEvent(new PointerEvent("pointerdown", { ...point(0), button: 0, buttons: 1, pointerType: "mouse" }));
        for (let move = 1; move <= moves; move++) {
          const part = move === moves ? 0.25 : Math.abs(((move / 50) % 2) - 1);
          canvas.dispatchEvent(new MouseEvent("mousemove", { ...point(part), buttons: 1 }));
          if (move % 5 === 0) await frame();
        }
        canvas.dispatchEvent(new PointerEvent("pointerup", { ...point(0.25), button: 0, pointerType: "mouse" }));
      },
      [moves, box],
    );
  await drag(200);
  await trained(page);
  const [memoryBefore, countsBefore] = [await memory(), await counts()];
  await drag(1000);
  const begin = Date.now();
  const beta = Number(await until(() => slider.getAttribute("aria-valuenow"), (value) => value !== null));
  await until(() => status(page).textContent(), (text) => /^trained, .*digest/.test(text));
  const settled = Date.now() - begin;
  const { sent, heard } = await counts();
  console.log(`β ${beta}: ${sent - countsBefore.sent} messages sent, ${heard - countsBefore.heard} heard, at rest after ${settled} ms`);
  // Of the moves within a frame one is sent; pictures are answered, each once. It did move, too.
  assert.ok(sent - countsBefore.sent <= 202 + (heard - countsBefore.heard), `${sent - countsBefore.sent}`);
  assert.ok(heard - countsBefore.heard > 20);
  assert.ok(settled < 5000, `${settled} ms`);
  assert.ok((await memory()) <= memoryBefore + 4_000_000, `${memoryBefore} ${await memory()}`);
  const end = await digest(page);
  assert.equal(Number(await slider.getAttribute("aria-valuenow")), beta);
  const { page: other, close: closeOther } = await open(browser, `${site.address}#v=1&speed=max&beta=${beta}`);
  await trained(other);
  assert.equal(await digest(other), end);
  await closeOther();
  assert.deepEqual(problems, []);
  await close();
});

/** Breaks what the program asks of the browser, and nothing else. */
const breakClock = (page, how) =>
  page.evaluate((how) => {
    const clock = performance;
    const isAskedByProgram = () => {
      const [above, ...below] = new Error().stack.split(".wasm");
      // Not what the program asks of the page's own scripts, which ask the browser.
      return below.length > 0 && !/\/rest[-.]/.test(above);
    };
    if (how === "a panic") {
      Object.defineProperty(window, "performance", { get: () => (isAskedByProgram() ? undefined : clock), configurable: true });
    } else {
      const now = clock.now.bind(clock);
      clock.now = () => {
        if (isAskedByProgram()) throw new TypeError("the clock has stopped");
        return now();
      };
    }
  }, how);

for (const [how, sentence] of [
  ["a panic", /.+, .*\.rs:\d+:\d+/],
  ["an error of the browser's", /TypeError: the clock has stopped/],
]) {
  test(`${how} in the program ends in a message with a report, not in a frozen picture`, async () => {
    const { page, context, close } = await open(browser, site.address + "#v=1&beta=0.45&speed=60");
    await context.grantPermissions(["clipboard-read", "clipboard-write"]);
    await midRun(page, 20);
    await breakClock(page, how);
    await alert(page, "ape-lab has stopped").waitFor(PATIENCE);
    await checkMessage(page);
    assert.equal(await page.evaluate(() => document.activeElement.tagName), "H1");
    // By keyboard alone.
    const focused = () => page.evaluate(() => document.activeElement.textContent);
    await page.keyboard.press("Tab");
    assert.equal(await focused(), "Reload");
    await page.keyboard.press("Tab");
    assert.equal(await focused(), "Copy the report");
    await page.keyboard.press("Enter");
    await message(page).getByText("The report is copied.").waitFor(PATIENCE);
    const report = await page.evaluate(() => navigator.clipboard.readText());
    const version = (await readFile(new URL("../../Cargo.toml", import.meta.url), "utf8")).match(/^version = "(.*)"/m)[1];
    assert.equal(report.split("\n")[0], `ape-lab ${version}`);
    const agent = await page.evaluate(() => navigator.userAgent);
    for (const line of [sentence, "beta=0.45", agent, /from session: Snapshot/, /to session: Load/]) {
      assert.ok(line instanceof RegExp ? line.test(report) : report.includes(line), `${line}\n${report}`);
    }
    await page.keyboard.press("Tab");
    await page.keyboard.press("Enter");
    await message(page).locator("pre").waitFor({ state: "visible", ...PATIENCE });
    await pictures(page, how === "a panic" ? "panic" : "error");
    // The program is not called again.
    assert.equal(await page.evaluate(() => window.pageCanPaint()), false);
    await page.evaluate(() => document.querySelector("details").removeAttribute("open"));
    await button(page, "Reload").click();
    await midRun(page, 10);
    assert.equal(await widget(page, "slider", "β").getAttribute("aria-valuenow"), "0.45");
    await close();
  });
}

test("what is said of a crash has the theme that was chosen, not that of the system", async () => {
  const { page, close } = await open(browser, site.address, { colorScheme: "light" });
  await trained(page);
  const ground = () => message(page).evaluate((element) => getComputedStyle(element).backgroundColor);
  for (const [theme, color] of [["dark", "rgb(21, 23, 28)"], ["light", "rgb(247, 247, 245)"], ["system", "rgb(247, 247, 245)"]]) {
    await click(page, "button", "Settings");
    await widget(page, "radio", `Theme: ${theme}`).waitFor(PATIENCE);
    await click(page, "radio", `Theme: ${theme}`);
    await until(ground, (now) => now === color);
    await press(page, "Escape");
    await widget(page, "radio", `Theme: ${theme}`).waitFor({ state: "detached", ...PATIENCE });
  }
  await page.emulateMedia({ colorScheme: "dark" });
  await until(ground, (now) => now === "rgb(21, 23, 28)");
  await page.evaluate(() => {
    sessionStorage.clear();
    localStorage.setItem("ape-lab.preferences", JSON.stringify({ theme: "Light" }));
  });
  await page.reload();
  await trained(page);
  await breakClock(page, "a panic");
  await alert(page, "ape-lab has stopped").waitFor(PATIENCE);
  assert.equal(await ground(), "rgb(247, 247, 245)");
  assert.match(await message(page).locator("pre").textContent(), /^Window: .*, light$/m);
  await close();
});

test("errors of others, and hints of the browser's, leave the page alone", async () => {
  const { page, close } = await open(browser, site.address);
  await trained(page);
  await page.evaluate(() => {
    window.dispatchEvent(new ErrorEvent("error", { message: "ResizeObserver loop completed with undelivered notifications." }));
    const foreign = new Error("not ours");
    foreign.stack = "Error: not ours\n    at chrome-extension://abc/content.js:1:1";
    window.dispatchEvent(new ErrorEvent("error", { message: "not ours", error: foreign }));
    Promise.reject(new DOMException("Write permission denied.", "NotAllowedError"));
    Promise.reject(undefined);
  });
  await press(page, "ArrowDown");
  await until(() => widget(page, "slider", "β").getAttribute("aria-valuenow"), (beta) => beta === "0.55");
  await trained(page);
  assert.ok(await message(page).isHidden());
  await close();
});
