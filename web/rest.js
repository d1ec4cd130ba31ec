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
  /**
   * The frames that were asked for, eframe's and those of others, by names of our own: what they call, and the browser's
   * name of those that it was asked for. The others rest.
   */
  const frames = new Map();
  /** When something was last painted. */
  let painted = -Infinity;
  let names = 0;
  let awakeUntil = 0;
  /** Until then news is awaited: frames that nobody but egui asks for come after it. */
  let heldUntil = 0;

  /** Where somebody asks for it, every frame is measured (User Timing). What cannot be painted is not (faults.js). */
  function come(name, time) {
    const frame = frames.get(name);
    if (!frames.delete(name)) return;
    const { callback, turn } = frame;
    cancel(turn);
    if (!window.pageCanPaint()) return;
    const start = performance.now();
    callback(time);
    if (window.apeLabMeasures) performance.measure("ape-lab: frame", { start, end: performance.now() });
  }

  /** Has a frame come with the screen's next turn. */
  function ask(name, frame) {
    frame.turn ??= request((time) => come(name, time));
  }

  window.requestAnimationFrame = (callback) => {
    const now = performance.now();
    names -= 1;
    const frame = { callback, turn: undefined };
    frames.set(names, frame);
    if (now < heldUntil) rest.set(heldUntil - now);
    else if (now < awakeUntil) ask(names, frame);
    else rest.set(REST);
    return names;
  };

  window.cancelAnimationFrame = (name) => {
    const frame = frames.get(name);
    cancel(frame ? frame.turn : name);
    frames.delete(name);
  };

  function wake(stay, isVisitor = false) {
    const now = performance.now();
    awakeUntil = Math.max(awakeUntil, now + stay);
    rest.stop();
    // Where nothing was painted in this turn of the screen, neither the visitor nor what comes after a rest waits for the next;
    // but what woke it is to be heard first.
    const isFree = now - painted > TURN && document.visibilityState === "visible";
    for (const [name, frame] of frames) {
      const isNext = isFree && (isVisitor || frame.turn === undefined);
      ask(name, frame);
      if (isNext) soon((time) => come(name, time));
    }
  }

  const channel = new MessageChannel();
  const next = [];
  channel.port1.onmessage = () => next.shift()(performance.now());

  /** After the task that is under way. */
  function soon(callback) {
    next.push(callback);
    channel.port2.postMessage(undefined);
  }

  /** A timer that wakes at the earliest time it is set to, unless it is stopped before. */
  function alarm() {
    let timer;
    let at = Infinity;
    function set(delay) {
      const then = performance.now() + delay;
      if (then >= at) return;
      stop();
      at = then;
      timer = setTimeout(ring, delay);
    }
    function stop() {
      clearTimeout(timer);
      at = Infinity;
    }
    function ring() {
      at = Infinity;
      const now = performance.now();
      if (now < heldUntil) set(heldUntil - now);
      else wake(SHORT);
    }
    return { set, stop };
  }

  /** When egui wants to paint again. */
  const wish = alarm();
  /** When a rest is over; there need be nothing to paint then. */
  const rest = alarm();
  /** What a timer can be set to. */
  const MOST = 2 ** 31 - 1;

  /** There will be something to paint in so many milliseconds (src/web/page.rs). */
  window.wakePage = (delay) => (delay > 0 ? wish.set(Math.min(delay, MOST)) : wake(LONG));

  /** It begins to paint (src/web/page.rs); what it will wish for after that, it says anew. */
  window.pagePaints = () => {
    painted = performance.now();
    wish.stop();
  };

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
    window.addEventListener(kind, () => isHeld() || wake(LONG, true), { capture: true, passive: true });
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => wake(LONG));
})();
