// How fast the built page is in headless Chromium, against its goals: `cargo xtask bench browser` runs it. Progress goes to
// stderr; the last line of stdout is one JSON document of rows. MINUTES: how long the page is played with for its memory.
// ONLY: a part by name (training, frames, weight, opening, table1, pool, memory, idle).
import { readFile, readdir } from "node:fs/promises";
import { cpus } from "node:os";
import { join } from "node:path";
import { brotliCompressSync, constants } from "node:zlib";
import { DIST, launch, open, serve } from "./browser.mjs";
import { click, press, status, trained, until, widget } from "./visitor.mjs";

const MINUTES = Number(process.env.MINUTES ?? 1);
/** A run of the default setting that does not end while it is looked at. */
const LONG_RUN = "#v=1&updates=10000000&speed=max";
const FLAT_OUT = "#v=1&speed=max";

const rows = [];
const figures = {
  median: (sorted) => (sorted[(sorted.length - 1) >> 1] + sorted[sorted.length >> 1]) / 2,
  p95: (sorted) => sorted[Math.ceil(0.95 * sorted.length) - 1],
  max: (sorted) => sorted.at(-1),
};
/** `goal`: the most that `figure` of the samples may be, or null. */
function row(name, unit, goal, figure, samples, note) {
  const value = Number(figures[figure]([...samples].sort((a, b) => a - b)).toFixed(2));
  const goal_text = goal === null ? "" : `≤ ${goal} ${unit}`;
  rows.push({ name, unit, goal, goal_text, samples: samples.map((x) => Number(x.toFixed(3))), figure, value, note });
  console.error(`${name}: ${figure} ${value} ${unit} of ${samples.length}${goal_text && ` (goal ${goal_text})`}`);
}

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Has the page measure itself (src/web/measures.rs), and notes when keys are pressed and how long messages are. */
const measured = (page) =>
  page.addInitScript(() => {
    window.apeLabMeasures = true;
    window.bench = { bytes: [], key: 0 };
    window.addEventListener("keydown", (event) => (window.bench.key = event.timeStamp), true);
    const { set } = Object.getOwnPropertyDescriptor(Worker.prototype, "onmessage");
    Object.defineProperty(Worker.prototype, "onmessage", {
      set(handler) {
        const listen = (event) => {
          if (event.data.byteLength > 1000) window.bench.bytes.push(event.data.byteLength);
          handler.call(this, event);
        };
        set.call(this, handler && listen);
      },
    });
    const { instantiateStreaming } = WebAssembly;
    WebAssembly.instantiateStreaming = async (...parts) => {
      const made = await instantiateStreaming.apply(WebAssembly, parts);
      window.bench.memory = made.instance.exports.memory;
      return made;
    };
  });

/** The frame that first showed an update of a run after `run`: its end, on the page's clock. */
const shown = (page, run, update) =>
  page
    .waitForFunction(
      ([run, update]) => {
        const marks = performance.getEntriesByType("mark").map((mark) => [mark, mark.name.match(/run (\d+) update (\d+)$/)]);
        const mark = marks.find(([, of]) => of && Number(of[1]) > run && Number(of[2]) === update)?.[0];
        const frames = performance.getEntriesByName("ape-lab: frame");
        const frame = mark && frames.find((frame) => frame.startTime + frame.duration >= mark.startTime);
        return frame && { run: Number(mark.name.match(/run (\d+)/)[1]), end: frame.startTime + frame.duration };
      },
      [run, update],
      { timeout: 60_000, polling: 50 }
    )
    .then((handle) => handle.jsonValue());

const forget = (page) => page.evaluate(() => (performance.clearMarks(), performance.clearMeasures()));

/** Has commands to retrain wait until the page has long drawn what was pressed: the worker then has the machine for itself. */
const whenAtRest = (page) =>
  page.addInitScript(() => {
    const post = Worker.prototype.postMessage;
    // Its place in src/lab/protocol.rs; β follows.
    const RETRAIN = 2;
    Worker.prototype.postMessage = function (message, transfer) {
      if (new Uint8Array(message)[0] !== RETRAIN) return post.call(this, message, transfer);
      // A buffer of its own, as the page's time to give it away is over.
      const copy = message.slice(0);
      setTimeout(() => {
        // That the run has begun is not painted either (web/rest.js).
        window.holdPage(300);
        post.call(this, copy, [copy]);
      }, 400);
    };
  });

/** Moves β with an arrow key, so many times; `moved` is given what the key's time stamp and the frame's end were. */
async function moveBeta(browser, site, moves, before, moved) {
  const { page, close } = await open(browser, site.address + FLAT_OUT, { before });
  await trained(page);
  let { run } = await shown(page, 0, 732);
  await page.locator("#canvas").focus();
  for (let move = 0; move < moves; move++) {
    await forget(page);
    await page.keyboard.press(move % 2 ? "ArrowDown" : "ArrowUp");
    // Asking takes the page's time: not before there is something to tell, or it is late.
    await wait(200);
    const next = await shown(page, run, 732);
    run = next.run;
    const words = await until(() => status(page).textContent(), (text) => /^trained.* ms of training/.test(text));
    moved(move, next.end - (await page.evaluate(() => window.bench.key)), Number(words.match(/(\d+) ms of training/)[1]));
    // A visitor's next move may come at any part of a frame.
    await wait(150 + 97 * Math.random());
  }
  await close();
}

async function training(browser, site) {
  const alone = [];
  await moveBeta(browser, site, 34, async (page) => (await whenAtRest(page), await measured(page)), (move, _, works) => {
    if (move % 2) alone.push(works);
  });
  const [times, beside] = [[], []];
  for (let visit = 0; visit < 3; visit++) {
    await moveBeta(browser, site, 44, measured, (move, time, works) => {
      if (move >= 4) times.push(time);
      if (move % 2) beside.push(works);
    });
  }
  const what = "The time of training that the page shows (updates alone, without the points of the curve) once the default run (732 updates, seed 1, β 0.6) has been trained";
  row("default training run in the browser's worker", "ms", 45, "median", alone.slice(2), what + ", the page at rest meanwhile.");
  row("the same while the page draws that β has moved", "ms", null, "median", beside, what + ": Chromium's drawing in software takes its part of the same cores.");
  row("β moved → every panel shows the retrained result", "ms", 100, "p95", times, "From the time stamp of a pressed arrow key to the end of the frame that drew the trained result, which the screen shows at its next turn; three visits, each with four moves to warm up.");
}

/** Frames of a trace: what the page's main thread did in each, handlers of messages and events and the layout before it included. */
function frames(events) {
  const frame = events.find((event) => event.name === "FireAnimationFrame");
  // Scripts, and what the browser makes of the elements that they have changed.
  const kinds = ["FireAnimationFrame", "FunctionCall", "EventDispatch", "UpdateLayoutTree", "Layout", "PrePaint", "Paint", "Layerize", "Commit"];
  const own = events.filter((e) => e.pid === frame.pid && e.tid === frame.tid && e.ph === "X" && kinds.includes(e.name));
  own.sort((a, b) => a.ts - b.ts || b.dur - a.dur);
  let [end, work, elapsed] = [0, 0, 0];
  const found = [];
  for (const event of own) {
    // What lies within another has been counted.
    if (event.ts < end) continue;
    end = event.ts + event.dur;
    work += (event.tdur ?? event.dur) / 1000;
    elapsed += event.dur / 1000;
    if (event.name === "FireAnimationFrame") {
      found.push({ work, elapsed });
      [work, elapsed] = [0, 0];
    }
  }
  return found;
}

async function flatOut(browser, site) {
  const { page, close } = await open(browser, site.address + LONG_RUN, { before: measured });
  await until(() => status(page).textContent(), (text) => /^training, update \d{4,}/.test(text));
  await wait(2000);
  await forget(page);
  await page.evaluate(() => (window.bench.bytes = []));
  await browser.startTracing(page, { categories: ["devtools.timeline"] });
  await wait(20_000);
  const { traceEvents } = JSON.parse((await browser.stopTracing()).toString());
  const found = frames(traceEvents).slice(1);
  const work = found.map((frame) => frame.work);
  const how = "Train tab, 1280 × 800, 20 s, from a trace: time that the main thread ran for an animation frame, with handlers of messages, style, layout and paint";
  row("main-thread work per frame while training flat out", "ms", 8, "p95", work, how + ".");
  row("the longest frame of these", "ms", 16, "max", work, how + ".");
  row("the same with the time that others had its core", "ms", null, "p95", found.map((frame) => frame.elapsed), "As above, by the clock on the wall: the training worker and Chromium's drawing in software share this machine's cores.");
  const measures = await page.evaluate(() => performance.getEntriesByName("ape-lab: frame").map((frame) => frame.duration));
  row("the same as the page measures it", "ms", null, "p95", measures, "The page's own entries (User Timing): its callback alone, by the clock on the wall.");
  const bytes = await page.evaluate(() => window.bench.bytes);
  row("a snapshot on its way to the page", "kB", null, "median", bytes.map((bytes) => bytes / 1000), "Bytes of a message of the worker, two experts and two clones on the grid of 10 × 10.");
  await close();
}

async function weight() {
  const files = (await readdir(DIST, { recursive: true, withFileTypes: true })).filter((entry) => entry.isFile());
  let [all, worker] = [0, 0];
  for (const file of files) {
    const bytes = await readFile(join(file.parentPath, file.name));
    const length = brotliCompressSync(bytes, { params: { [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length } }).length / 1000;
    all += length;
    if (/^worker(_bg|_loader)?\.(wasm|js)$/.test(file.name)) worker += length;
  }
  row("the page's weight, all files", "kB", 1600, "max", [all], "Every file of dist by itself, brotli at quality 11.");
  row("the worker's part of it", "kB", 250, "max", [worker], "worker_loader.js, worker.js and worker_bg.wasm, brotli at quality 11.");
}

async function opening(browser, site) {
  // With its service worker, as a visitor who comes back.
  for (const [address, goal, name, note] of [
    [FLAT_OUT, 1000, "address opened → the trained result", "Training as fast as it goes (an address with speed=max)."],
    ["", null, "the same at the speed that the page opens with", "732 updates are shown at 300 a second, which takes 2440 ms of it."],
  ]) {
    const { page, close } = await open(browser, site.address + address, { before: measured, offline: true });
    await trained(page);
    await page.evaluate(() => navigator.serviceWorker.ready);
    // Chromium keeps compiled programs a while after they have been loaded.
    await wait(5000);
    const times = [];
    for (let visit = 0; visit < 8; visit++) {
      await page.goto("about:blank");
      await wait(500);
      await page.goto(site.address + address);
      times.push((await shown(page, 0, 732)).end);
      await trained(page);
      await wait(500);
    }
    row(name + ", warm cache", "ms", goal, "median", times.slice(1), note + " From the start of the navigation to the end of the first frame that shows update 732, files from the service worker.");
    await close();
  }
}

const ANALYTIC = ["uniform", "occupancy", "replay(60)", "filtered", "history", "history_k(1)", "history_k(2)"];

async function table1(browser, site) {
  const { page, close } = await open(browser, site.address + FLAT_OUT);
  await trained(page);
  await click(page, "radio", "Tab: Table 1");
  const names = /^(uniform|occupancy|replay|bc|filtered|history|gru)/;
  const boxes = page.getByRole("checkbox", { name: names });
  await boxes.first().waitFor();
  for (const [cloners, goal, name] of [
    [ANALYTIC, 3, "Table 1, 5 seeds, analytic cloners"],
    [[...ANALYTIC, "bc(1000000)"], 15, "Table 1, 5 seeds, with bc"],
  ]) {
    for (const label of await boxes.evaluateAll((all) => all.map((element) => element.getAttribute("aria-label")))) {
      const box = widget(page, "checkbox", label);
      const isWanted = cloners.includes(label);
      if (((await box.getAttribute("aria-checked")) === "true") !== isWanted) {
        await click(page, "checkbox", label);
        await until(() => box.getAttribute("aria-checked"), (checked) => checked === String(isWanted));
      }
    }
    const times = [];
    for (let time = 0; time < 3; time++) {
      await click(page, "button", "Make Table 1");
      await page.getByRole("progressbar", { name: "Progress" }).waitFor();
      const done = page.getByRole("status").filter({ hasText: /^done in/ });
      await done.waitFor({ timeout: 600_000 });
      times.push(Number((await done.textContent()).match(/done in ([\d.]+) s/)[1]));
    }
    row(name, "s", goal, "median", times, `All methods and ${cloners.length} cloners on ${cpus().length} cores; the time that the page shows, three times.`);
  }
  await close();
}

/** How many times sooner all workers are done with a sweep than one. */
async function pool(browser, site) {
  const times = new Map([[1, []], [cpus().length, []]]);
  const swept = async (cores) => {
    const before = (page) => page.addInitScript((cores) => Object.defineProperty(navigator, "hardwareConcurrency", { value: cores }), cores);
    const { page, close } = await open(browser, site.address + FLAT_OUT, { before });
    await trained(page);
    await click(page, "radio", "Tab: β sweep");
    const seeds = widget(page, "spinbutton", "Seeds of the sweep");
    await seeds.waitFor();
    const done = page.getByRole("status").filter({ hasText: /^done in/ });
    // The first has its workers still to start.
    for (let time = 0; time < 2; time++) {
      await click(page, "button", "Sweep");
      await page.getByRole("progressbar", { name: "Progress" }).waitFor();
      await done.waitFor({ timeout: 600_000 });
    }
    times.get(cores).push(Number((await done.textContent()).match(/done in ([\d.]+) s/)[1]));
    await close();
  };
  for (let time = 0; time < 5; time++) for (const cores of times.keys()) await swept(cores);
  const [one, all] = [...times.values()];
  row("A sweep by all workers, compared with one", "×", null, "median", one.map((one, time) => one / all[time]), `11 values of β, 3 seeds, on ${cpus().length} cores; the times that the page shows (one worker: median ${figures.median([...one].sort((a, b) => a - b))} s), five times one after the other.`);
}

/** The line through points (x, y): how much y grows for each x. */
function slope(points) {
  const mean = (k) => points.reduce((sum, point) => sum + point[k], 0) / points.length;
  const [x, y] = [mean(0), mean(1)];
  const sum = (f) => points.reduce((total, point) => total + f(point), 0);
  return sum((p) => (p[0] - x) * (p[1] - y)) / sum((p) => (p[0] - x) ** 2);
}

async function memory(browser, site) {
  const before = async (page) => {
    await measured(page);
    // Only to see the memory that the worker's program gets.
    const look = `const { instantiateStreaming } = WebAssembly;
      WebAssembly.instantiateStreaming = async (...parts) => {
        const made = await instantiateStreaming.apply(WebAssembly, parts);
        self.benchMemory = made.instance.exports.memory;
        return made;
      };`;
    const loader = await readFile(join(DIST, "worker_loader.js"), "utf8");
    await page.route("**/worker_loader.js", (route) => route.fulfill({ contentType: "text/javascript", body: look + loader }));
  };
  const { page, close } = await open(browser, site.address + FLAT_OUT, { before });
  await trained(page);
  await page.locator("#canvas").focus();
  const debug = await page.context().newCDPSession(page);
  const [begin, pages, workers] = [Date.now(), [], []];
  let frames = 0;
  const look = async () => {
    const at = (Date.now() - begin) / 60_000;
    await debug.send("HeapProfiler.collectGarbage");
    const { usedSize } = await debug.send("Runtime.getHeapUsage");
    const program = await page.evaluate(() => window.bench.memory.buffer.byteLength);
    pages.push([at, (usedSize + program) / 1e6]);
    workers.push([at, (await page.workers()[0].evaluate(() => self.benchMemory.buffer.byteLength)) / 1e6]);
    frames += await page.evaluate(() => performance.getEntriesByName("ape-lab: frame").length);
    await forget(page);
    await page.evaluate(() => (window.bench.bytes = []));
  };
  // Whatever a visitor does: β, playing and going back, the timeline, the tabs.
  const keys = ["ArrowUp", "ArrowUp", "ArrowDown", "r", "Space", "Shift+ArrowLeft", "ArrowLeft", "End", "1", "2", "3", "4", "5", "6", "7", "2", "ArrowDown"];
  while (Date.now() - begin < 60_000 * MINUTES || pages.length < 4) {
    const next = begin + 60_000 * MINUTES * Math.min(1, (pages.length + 1) / 60);
    do {
      for (const key of keys) await press(page, key);
    } while (Date.now() < next);
    await look();
  }
  const half = (points) => points.slice(points.length >> 1);
  const grows = (points) => `in the second half it grew by ${slope(half(points)).toFixed(3)} MB a minute`;
  const how = `${MINUTES} min of play (β, play, timeline, tabs; ${frames} frames)`;
  row("memory of the worker's program", "MB", 64, "max", workers.map((p) => p[1]), `WebAssembly memory during ${how}; ${grows(workers)}.`);
  row("memory of the page", "MB", 150, "max", pages.map((p) => p[1]), `WebAssembly memory and JavaScript's heap in use after a collection, during ${how}; ${grows(pages)}.`);
  await close();
}

async function idle(browser, site) {
  const { page, close } = await open(browser, site.address + FLAT_OUT);
  await trained(page);
  await wait(3000);
  const debug = await browser.newBrowserCDPSession();
  const used = async () => {
    const { processInfo } = await debug.send("SystemInfo.getProcessInfo");
    return processInfo.reduce((sum, { type, cpuTime }) => sum + (["renderer", "GPU"].includes(type) ? cpuTime : 0), 0);
  };
  const shares = [];
  for (let time = 0; time < 3; time++) {
    const [begin, before] = [performance.now(), await used()];
    await wait(10_000);
    shares.push((100_000 * ((await used()) - before)) / (performance.now() - begin));
  }
  row("CPU while nothing happens", "%", 1, "median", shares, "Of one core, over 10 s, three times: everything in the processes of the page and of its drawing, after a run has ended.");
  await close();
}

const parts = { training, frames: flatOut, weight, opening, table1, pool, memory, idle };
const chosen = process.env.ONLY?.split(",") ?? Object.keys(parts);
const site = await serve();
const environment = { node: process.version, cpu: cpus()[0].model, cores: cpus().length };
try {
  for (const part of chosen) {
    console.error(`— ${part}`);
    // A browser of its own: what one part leaves behind is not the next one's.
    const browser = await launch();
    environment.chromium = browser.version();
    await parts[part](browser, site).finally(() => browser.close());
  }
  console.log(JSON.stringify({ environment, rows }));
} finally {
  site.close();
}
