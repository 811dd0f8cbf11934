// The success terms that live on the page: canned ones for their look, the real program's for what is drawn in the picture.
import assert from "node:assert/strict";
import path from "node:path";
import test, { after, before, describe } from "node:test";
import { keep_shot, missing, open_browser, open_page, source_dir, start, until } from "./support.mjs";

const patience = 600_000;

describe("terms, canned", { skip: missing("FLOWSCOPE_FAKE"), timeout: patience }, () => {
  let program, browser, page, at, complaints;
  before(async () => {
    program = await start(process.env.FLOWSCOPE_FAKE, ["--port", "0", "--page", path.join(source_dir, "web/ui/dist")]);
    browser = await open_browser();
    ({ page, at, complaints } = await open_page(browser, { url: program.url }));
  });
  after(async () => {
    await browser?.close();
    await program?.stop();
  });
  const row = (k) => at("term").nth(k);
  const part = (k, id) => row(k).getByTestId(id);

  test("each term has its value, threshold and place in the tree", async () => {
    await until(async () => (await at("term").count()) === 2, "two terms");
    assert.equal(await row(0).getAttribute("data-path"), "in_order/0");
    assert.match(await at("terms").textContent(), /one after the other.*pressed red.*pressed blue/);
    assert.match(await part(0, "term-value").textContent(), /^\d\.\d mm$/);
    assert.equal(await part(0, "term-threshold").textContent(), "> 1.0 mm");
  });

  test("a term that becomes true says so and since when, while the other waits", async () => {
    await until(async () => (await row(0).getAttribute("data-met")) === "true", "the first term to be met");
    assert.equal(await part(0, "term-since").textContent(), "at 2.0 s");
    assert.equal(await row(1).getAttribute("data-met"), "false");
    assert.equal(await part(1, "term-since").textContent(), "");
  });

  test("its curve goes through the threshold", async () => {
    const curve = () => part(0, "term-spark").evaluate((svg) => ({
      points: svg.querySelector("polyline").getAttribute("points").split(" ").map((pair) => pair.split(",").map(Number)),
      limit: Number(svg.querySelector("line").getAttribute("y1")),
    }));
    const { points, limit } = await until(async () => {
      const now = await curve();
      return now.points.length > 3 && now;
    }, "some moments");
    assert.ok(points.at(-1)[1] < limit, "above the dashed line at the end");
    assert.ok(points.every(([x], i) => i === 0 || x > points[i - 1][0]), "time goes to the right");
    await keep_shot(page, "terms-fake");
  });

  test("a new episode starts its curve anew", async () => {
    await at("reset").click();
    await until(async () => (await row(0).getAttribute("data-met")) === "false", "an unmet term");
    assert.equal(await part(0, "term-since").textContent(), "");
    assert.deepEqual(complaints, []);
  });
});

describe("detectors in the picture", { skip: missing("FLOWSCOPE_BIN"), timeout: patience }, () => {
  let program, browser, page, at, complaints;
  before(async () => {
    program = await start(process.env.FLOWSCOPE_BIN, ["serve", "--port", "0", "--data", "{data}", "--task", "slide_block_to_color_target"]);
    browser = await open_browser();
    ({ page, at, complaints } = await open_page(browser, { url: program.url }));
  });
  after(async () => {
    await browser?.close();
    await program?.stop();
  });
  const pixels = (color) => at("picture").evaluate((image, [r, g, b]) => {
    const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4)
      count += Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 90;
    return count;
  }, color);
  const pink = [245, 115, 181], green = [74, 222, 128];

  test("the switch draws what the terms watch", async () => {
    await until(() => at("picture").evaluate((image) => image.naturalWidth > 0), "a picture");
    await until(async () => (await at("term").count()) > 0, "terms");
    const without = await pixels(pink);
    await at("detectors").check();
    await until(async () => (await pixels(pink)) > without + 100, "pink edges of an unmet box");
    await keep_shot(page, "detectors-unmet");
  });

  test("a switch stays where the hand put it while the program has not answered yet", async () => {
    const settings = "**/api/v1/views/main", held = 1500;
    await page.route(settings, async (route) => {
      await new Promise((resolve) => setTimeout(resolve, held));
      await route.continue();
    });
    await until(async () => (await at("script").inputValue()).includes("steps:"), "the task's own script");
    await at("run-script").click(); // what moves is told to the page many times while the answer is held
    const answered = page.waitForResponse(settings);
    await at("detectors").click();
    const seen = [];
    for (let look = 0; look < 50; ++look) {
      seen.push(await at("detectors").isChecked());
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    await answered;
    await page.unroute(settings);
    assert.deepEqual([...new Set(seen)], [false]);
    assert.equal(await at("detectors").isChecked(), false);
    await at("detectors").check();
    await until(() => at("run-script").isEnabled(), "the run to be over", patience);
    await at("reset").click();
  });

  test("what is met turns green, in the list and in the picture", async () => {
    await at("overlays").uncheck(); // the waypoints' axes are green too
    await at("picture").hover();
    for (let notch = 0; notch < 2; ++notch) await page.mouse.wheel(0, -100); // from near by the hand hides less of the box
    const before_run = await pixels(green);
    await until(async () => (await at("script").inputValue()).includes("steps:"), "the task's own script");
    await at("run-script").click();
    await until(async () => (await at("term").first().getAttribute("data-met")) === "true", "a met term", patience);
    await until(async () => (await pixels(green)) > before_run + 40, "green edges");
    await keep_shot(page, "detectors-met");
    await at("detectors").uncheck();
    await until(async () => (await pixels(green)) < before_run + 20, "the picture without them");
    assert.deepEqual(complaints, []);
  });
});
