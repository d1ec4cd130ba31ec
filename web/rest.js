// Lets the page rest. eframe asks for an animation frame sixty times a second, whether there is something to paint or
// not. Here it is made to wait while nothing happens; what may need a frame wakes it.
(() => {
  const request = window.requestAnimationFrame.bind(window);
  const cancel = window.cancelAnimationFrame.bind(window);
  /** How long frames go on after something has happened, and after a timer, in milliseconds. */
  const LONG = 250;
  const SHORT = 50;
  /** From one turn of a screen to the next. */
  const TURN = 1000 / 60;
  /** How long it rests at most: whatever is not heard of here shows after that. */
  const REST = 2000;
  /** The frames that wait, eframe's and those of others, by names of our own: the browser's are positive. */
  const waiting = new Map();
  /** What the browser calls those that have waited and are to come. */
  const called = new Map();
  /** When the last frame came. */
  let last = -Infinity;
  let names = 0;
  let awakeUntil = 0;
  /** Until then news is awaited: frames that nobody but egui asks for come after it. */
  let heldUntil = 0;

  /** Where somebody asks for it, every frame is measured (User Timing). What cannot be painted is not (faults.js). */
  const measured = (callback) => (time) => {
    if (!window.pageCanPaint()) return;
    const start = performance.now();
    last = start;
    callback(time);
    if (window.apeLabMeasures) performance.measure("ape-lab: frame", { start, end: performance.now() });
  };

  window.requestAnimationFrame = (callback) => {
    const now = performance.now();
    if (now < awakeUntil && now >= heldUntil) return request(measured(callback));
    names -= 1;
    waiting.set(names, callback);
    restFor(now < heldUntil ? heldUntil - now : REST);
    return names;
  };

  window.cancelAnimationFrame = (frame) => {
    if (waiting.delete(frame)) return;
    cancel(called.get(frame) ?? frame);
    called.delete(frame);
  };

  function wake(stay) {
    const now = performance.now();
    awakeUntil = Math.max(awakeUntil, now + stay);
    for (const [name, callback] of waiting) {
      const frame = measured(callback);
      const come = (time) => {
        cancel(called.get(name));
        if (called.delete(name)) frame(time);
      };
      called.set(name, request(come));
      // After a rest it need not wait for the screen's next turn, but what woke it is to be heard first.
      if (now - last > TURN && document.visibilityState === "visible") soon(come);
    }
    waiting.clear();
  }

  const channel = new MessageChannel();
  const next = [];
  channel.port1.onmessage = () => next.shift()(performance.now());

  /** After the task that is under way. */
  function soon(callback) {
    next.push(callback);
    channel.port2.postMessage(undefined);
  }

  /** A timer that wakes at the earliest time it is set to. */
  function alarm() {
    let timer;
    let at = Infinity;
    return (delay) => {
      const then = performance.now() + delay;
      if (then >= at) return;
      clearTimeout(timer);
      at = then;
      timer = setTimeout(() => {
        at = Infinity;
        wake(SHORT);
      }, delay);
    };
  }

  // Two of them: where a rest ends there need be nothing to paint yet.
  const wakeIn = alarm();
  const restFor = alarm();
  /** What a timer can be set to. */
  const MOST = 2 ** 31 - 1;

  /** There will be something to paint in so many milliseconds (src/web/page.rs). */
  window.wakePage = (delay) => (delay > 0 ? wakeIn(Math.min(delay, MOST)) : wake(LONG));

  /** There will be news in so many milliseconds, or later (src/web/worker.rs). */
  window.holdPage = (most) => (heldUntil = performance.now() + most);

  /** There is news; whether it is to be painted now. Where more is awaited, some can wait. */
  window.tellPage = (canWait) => {
    if (canWait && performance.now() < heldUntil) return false;
    heldUntil = 0;
    wake(LONG);
    return true;
  };

  const HAPPENINGS =
    "pointerdown pointerup pointermove pointercancel mousemove mouseleave touchstart touchmove touchend touchcancel " +
    "wheel keydown keyup beforeinput input compositionstart compositionupdate compositionend copy cut paste focus blur " +
    "dragenter dragover dragleave drop resize hashchange popstate visibilitychange pageshow load";
  for (const kind of HAPPENINGS.split(" ")) {
    // That a key is let go is nothing to be seen.
    const isHeld = () => kind === "keyup" && performance.now() < heldUntil;
    window.addEventListener(kind, () => isHeld() || wake(LONG), { capture: true, passive: true });
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => wake(LONG));
})();
