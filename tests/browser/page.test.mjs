// The page's states and controls against the server with canned data.
import assert from "node:assert/strict";
import path from "node:path";
import test, { after, before, beforeEach, afterEach, describe } from "node:test";
import { keep_shot, missing, open_browser, open_page, source_dir, start, until } from "./support.mjs";

const tabs = ["record", "train", "debug", "data", "export"];
const api = (path) => (url) => url.pathname === `/api/v1/${path}`;
const answer = (route, json, status = 200) => route.fulfill({ status, contentType: "application/json", body: JSON.stringify(json) });

describe("the page", { skip: missing("FLOWSCOPE_FAKE"), timeout: 1_800_000 }, () => {
  let program, browser, now;
  const at = (id) => now.at(id);
  const text = (id) => at(id).textContent();
  const open = async (options = {}) => {
    await now?.context.close();
    now = await open_page(browser, { url: program.url, ...options });
    return now;
  };
  const open_live = async (options) => {
    await open(options);
    await until(async () => (await text("pill-connection")) === "live", "a live connection");
    await until(async () => (await at("task").inputValue()) !== "", "the scene");
  };
  const open_trace = async () => {
    await at("tab-debug").click();
    await at("trace-row").last().click();
    await until(async () => /^step \d/.test(await text("step-readout")), "a shown trace");
    return Number(/\/(\d+)/.exec(await text("step-readout"))[1]);
  };

  before(async () => {
    browser = await open_browser();
  });
  beforeEach(async () => {
    program = await start(process.env.FLOWSCOPE_FAKE, ["--port", "0", "--page", path.join(source_dir, "web/ui/dist")]);
  });
  afterEach(async () => {
    await now?.context.close();
    now = undefined;
    await program.stop();
  });
  after(() => browser?.close());

  for (const [width, height] of [[1280, 720], [1600, 900]]) {
    test(`fits ${width}x${height} without scrolling, in every tab`, async () => {
      await open_live({ width, height });
      await open_trace();
      for (const tab of tabs) {
        await at(`tab-${tab}`).click();
        await keep_shot(now.page, `fake-${tab}-${width}`);
        const over = await now.page.evaluate(() => {
          const inside = (e) => e.scrollHeight <= e.clientHeight + 1 && e.scrollWidth <= e.clientWidth + 1;
          const boxes = [document.documentElement, document.querySelector(".top"), document.querySelector(".view-bar"),
            document.querySelector(".timeline"), ...document.querySelectorAll(".panel")].filter((e) => e.clientHeight > 0);
          return boxes.filter((e) => !inside(e)).map((e) => `${e.className || e.tagName} ${e.scrollWidth}x${e.scrollHeight} in ${e.clientWidth}x${e.clientHeight}`);
        });
        assert.deepEqual(over, [], `tab ${tab}`);
      }
      const picture = await at("picture").boundingBox();
      const side = await now.page.locator(".side").boundingBox();
      assert.ok(picture.width > side.width, "the picture is the largest thing");
      assert.deepEqual(now.complaints, []);
    });
  }

  test("holds one stream and one socket, no more", async () => {
    const asked = [], sockets = [];
    await open_live({ prepare: async (page) => {
      page.on("request", (request) => asked.push(new URL(request.url()).pathname));
      page.on("websocket", (socket) => sockets.push(socket.url()));
    } });
    await until(() => at("picture").evaluate((image) => image.naturalWidth > 0), "a picture");
    for (const tab of tabs) await at(`tab-${tab}`).click();
    assert.equal(asked.filter((path) => path === "/stream").length, 1);
    assert.equal(sockets.length, 1);
  });

  test("says that the program is starting, then goes on by itself", async () => {
    let refusals = 3;
    await open({ prepare: (page) => page.route((url) => url.pathname === "/health", (route) =>
      (refusals-- > 0 ? answer(route, { status: "loading", message: "compiling the scene" }, 503) : route.continue())) });
    await until(() => at("banner").isVisible(), "the banner");
    assert.match(await text("banner"), /starting: compiling the scene/);
    await until(async () => (await text("pill-connection")) === "live", "a live connection");
    assert.equal(await at("banner").isVisible(), false);
  });

  test("says that the connection is lost and greys the picture", async () => {
    await open_live();
    await open_trace();
    await program.kill();
    await until(() => at("banner").isVisible(), "the banner");
    assert.match(await text("banner"), /Connection lost/);
    assert.match(await at("picture").getAttribute("class"), /stale/);
    assert.equal(await at("slider").isDisabled(), true);
    await keep_shot(now.page, "fake-lost");
  });

  test("comes back after a short break", async () => {
    let cut;
    await open_live({ prepare: (page) => page.routeWebSocket(/events/, (socket) => {
      socket.connectToServer();
      cut ??= () => socket.close();
    }) });
    await cut();
    await until(async () => (await text("pill-connection")) === "lost", "the break");
    await until(async () => (await text("pill-connection")) === "live", "the new connection");
    assert.equal(await at("banner").isVisible(), false);
  });

  test("tells what to do when there is nothing yet", async () => {
    await open_live({ prepare: async (page) => {
      await page.route(api("demos"), (route) => answer(route, { demos: [] }));
      await page.route(api("train"), (route) => answer(route, { running: false, step: 0, loss: 0, loss_flow: 0, loss_open: 0, samples_per_s: 0,
        minutes: 0, demos: 0, validation: { position_mm: 0, rotation_deg: 0, keyframes: 0, tasks: [] }, loss_history: [], validation_history: [], error: null }));
      await page.routeWebSocket(/events/, (socket) => socket.send("{\"type\":\"log\",\"data\":{\"level\":\"info\",\"message\":\"\"}}"));
    } });
    await at("tab-data").click();
    assert.equal(await at("data-empty").isVisible(), true);
    await at("tab-train").click();
    assert.equal(await at("train-empty").isVisible(), true);
    assert.equal(await at("train-start").isDisabled(), true);
    await keep_shot(now.page, "fake-empty");
  });

  test("says the loss of each part and the held-out error of each task", async () => {
    const tasks = [{ task: "open_drawer", position_mm: 1.25, rotation_deg: 0.4, keyframes: 3 }, { task: "push_buttons", position_mm: 12, rotation_deg: 2, keyframes: 6 }];
    await open_live({ prepare: async (page) => {
      await page.route(api("train"), (route) => answer(route, { running: false, step: 40, loss: 1, loss_flow: 0.8, loss_position: 0.25,
        loss_rotation: 0.5, loss_open: 0.125, skipped: 2, samples_per_s: 10, minutes: 1, demos: 2,
        validation: { position_mm: 6, rotation_deg: 1, keyframes: 9, tasks }, loss_history: [], validation_history: [], error: null }));
      await page.routeWebSocket(/events/, (socket) => socket.send("{\"type\":\"log\",\"data\":{\"level\":\"info\",\"message\":\"\"}}"));
    } });
    await at("tab-train").click();
    await until(async () => (await text("train-parts")).includes("openness 0.125"), "the parts of the loss");
    assert.equal(await text("train-parts"), "loss of position 0.25, rotation 0.5, openness 0.125; 2 steps skipped, their loss was not finite");
    const rows = at("task-errors").locator("tbody tr");
    assert.equal(await rows.count(), 2);
    assert.match(await rows.first().textContent(), /open drawer.*1\.[23] mm.*0\.4°.*3 keyframes/);
    await keep_shot(now.page, "fake-train-tasks");
  });

  test("shows a refused call with its place, and marks the line of a script", async () => {
    await open_live({ prepare: (page) => page.route(api("script"), (route) =>
      answer(route, { error: { code: "bad_script", message: "unknown key gripperr", where: "script:2:5" } }, 400)) });
    await until(async () => (await at("script").inputValue()) !== "", "the script");
    await at("run-script").click();
    await until(() => at("notice").isVisible(), "the notice");
    assert.match(await text("notice"), /unknown key gripperr/);
    assert.match(await text("notice"), /script:2:5/);
    assert.equal(await text("failed-line"), "2");
  });

  test("names the field of a number that is no number, and sends nothing", async () => {
    let predictions = 0;
    await open_live({ prepare: (page) => page.route(api("predict"), (route) => {
      ++predictions;
      return route.continue();
    }) });
    await at("tab-debug").click();
    await at("flow-steps").fill("");
    await at("predict").click();
    await until(() => at("notice").isVisible(), "the notice");
    assert.match(await text("notice"), /flow steps/);
    assert.equal(predictions, 0);
  });

  test("steps by buttons, keys and slider, and not while someone types", async () => {
    await open_live();
    const last = await open_trace();
    await at("step-first").click();
    assert.equal(await text("step-readout"), `step 0/${last}`);
    await at("step-forward").click();
    assert.equal(await text("step-readout"), `step 1/${last}`);
    await now.page.keyboard.press("End");
    assert.equal(await text("step-readout"), `step ${last}/${last}`);
    await now.page.keyboard.press("ArrowLeft");
    assert.equal(await text("step-readout"), `step ${last - 1}/${last}`);
    await now.page.keyboard.press("Home");
    await at("predict-seed").focus();
    await now.page.keyboard.press("End");
    assert.equal(await text("step-readout"), `step 0/${last}`);
    await at("slider").fill("2");
    assert.equal(await text("step-readout"), `step 2/${last}`);
    assert.match(await text("step-t"), new RegExp(`t = ${(2 / last).toFixed(3)}`));
  });

  test("plays to the end and stops there, or at a breakpoint", async () => {
    await open_live();
    const last = await open_trace();
    await at("step-first").click();
    await at("play").click();
    await until(async () => (await text("step-readout")) === `step ${last}/${last}`, "the end");
    await until(async () => (await at("play").getAttribute("aria-pressed")) === "false", "the stop");
    await at("break-quantity").selectOption("points");
    await at("break-value").fill("-1");
    await at("play").click();
    await until(async () => /Stopped at step 1/.test(await text("notice")), "the breakpoint");
    assert.equal(await text("step-readout"), `step 1/${last}`);
  });

  test("every step is asked for in the picture, the last one always", async () => {
    const shown = [];
    await open_live({ prepare: async (page) => page.on("request", (request) => {
      if (request.url().endsWith("/show")) shown.push(request.postDataJSON().step);
    }) });
    const last = await open_trace();
    await now.page.keyboard.press("Home");
    for (let k = 0; k < last; ++k) await now.page.keyboard.press("ArrowRight");
    await until(() => shown.at(-1) === last, "the last step");
    assert.ok(shown.length <= last + 3, `one call a step at most: ${shown}`);
  });

  test("predicts, branches and keeps both futures", async () => {
    await open_live();
    await at("tab-debug").click();
    const before_predicting = await until(() => at("trace-row").count(), "the predictions from before");
    await at("flow-steps").fill("4");
    await at("predict").click();
    await until(async () => (await at("trace-row").count()) === before_predicting + 1, "the prediction");
    await at("step-first").click();
    await at("branch-x").fill("0.250");
    await at("branch").click();
    await until(async () => /branched from .* at step 0/.test(await text("trace-origin")), "the branch");
    assert.equal(await at("trace-row").count(), before_predicting + 2);
    assert.match(await text("comparison"), /mm apart at t = .*mm at the end/);
    await at("trace-parent").click();
    await until(async () => !(await text("trace-origin")).includes("branched"), "the parent");
    await at("trace-compare").first().click();
    await until(() => at("comparison").isVisible(), "the comparison");
  });

  test("an answer that comes late takes no prediction away", async () => {
    let let_go, asked = 0;
    const held = new Promise((resolve) => { let_go = resolve; });
    await open_live({ prepare: (page) => page.route(api("traces"), async (route) => {
      if (++asked > 1) return route.continue();
      const response = await route.fetch(); // as it was before the prediction
      await held;
      await route.fulfill({ response });
    }) });
    await at("tab-debug").click();
    await at("predict").click();
    await until(async () => (await at("trace-row").count()) === 2, "the new prediction beside the old one");
    const late = now.page.waitForResponse((response) => api("traces")(new URL(response.url())));
    let_go();
    await (await late).finished();
    await new Promise((resolve) => setTimeout(resolve, 300));
    assert.equal(await at("trace-row").count(), 2);
  });

  test("the mouse turns, shifts and zooms the camera", async () => {
    const drags = [];
    await open_live({ prepare: async (page) => page.on("request", (request) => {
      if (request.url().endsWith("/drag")) drags.push(request.postDataJSON());
    }) });
    const box = await at("picture").boundingBox();
    const drag = async (button) => {
      await now.page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      await now.page.mouse.down({ button });
      await now.page.mouse.move(box.x + box.width / 2 + 60, box.y + box.height / 2 + 30, { steps: 3 });
      await now.page.mouse.up({ button });
    };
    const sum = (action, key) => drags.filter((d) => d.action === action).reduce((total, d) => total + d[key], 0);
    await drag("left");
    await until(() => Math.abs(sum("rotate", "dx") - 60 / box.height) < 0.01, "the whole turn");
    await drag("right");
    await until(() => Math.abs(sum("pan", "dy") - 30 / box.height) < 0.01, "the whole shift");
    await now.page.mouse.wheel(0, 120);
    await until(() => sum("zoom", "dy") > 0, "the zoom");
  });

  test("demonstrations show their keyframes and are deleted only on a second word", async () => {
    await open_live();
    await at("tab-data").click();
    await until(() => at("demo-card").count(), "the cards");
    const count = await at("demo-card").count();
    await at("demo-card").first().click();
    assert.ok((await at("keyframes").locator("img").count()) > 1);
    await at("demo-delete").click();
    assert.equal(await at("demo-card").count(), count);
    await at("demo-delete-confirm").click();
    await until(async () => (await at("demo-card").count()) === count - 1, "the deletion");
  });

  test("every control has a name that can be read aloud", async () => {
    await open_live();
    await open_trace();
    const nameless = [];
    for (const tab of tabs) {
      await at(`tab-${tab}`).click();
      nameless.push(...await now.page.locator("button:visible, select:visible, input:visible, textarea:visible").evaluateAll((controls) =>
        controls.filter((c) => !(c.getAttribute("aria-label") || c.textContent.trim() || c.labels?.[0]?.textContent.trim())).map((c) => c.outerHTML)));
    }
    assert.deepEqual(nameless, []);
  });

  test("the tabs move by arrow keys", async () => {
    await open_live();
    await at("tab-record").focus();
    await now.page.keyboard.press("ArrowRight");
    assert.equal(await at("tab-train").getAttribute("aria-selected"), "true");
    assert.equal(await now.page.evaluate(() => document.activeElement.id), "tab-train");
  });
});
