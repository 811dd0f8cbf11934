// The whole way by clicking, with the real program: record, train, predict, step, branch, export, lose the connection.
import assert from "node:assert/strict";
import test, { after, before, describe } from "node:test";
import { keep_shot, missing, open_browser, open_page, start, until } from "./support.mjs";

const demonstrations = 3;
const minutes = 60_000;

describe("from a demonstration to a film", { skip: missing("FLOWSCOPE_BIN"), timeout: 40 * minutes }, () => {
  let program, browser, page, complaints, at;

  before(async () => {
    program = await start(process.env.FLOWSCOPE_BIN, ["serve", "--port", "0", "--data", "{data}"]);
    browser = await open_browser();
    ({ page, complaints, at } = await open_page(browser, { url: program.url }));
  });
  after(async () => {
    if (page) await keep_shot(page, "walk-end");
    await browser?.close();
    await program?.stop();
  });

  const text = (id) => at(id).textContent();
  const picture = () => at("picture").screenshot();

  test("the page opens without the token in its address and shows the scene", async () => {
    assert.ok(!page.url().includes("token"), page.url());
    await until(async () => (await text("pill-connection")) === "live", "a live connection", minutes);
    await until(() => at("picture").evaluate((image) => image.naturalWidth > 0), "a picture", minutes);
    assert.ok((await text("instruction")).length > 4);
    await until(async () => (await at("script").inputValue()).includes("steps:"), "the task's own script");
    await keep_shot(page, "walk-record");
  });

  test("recording moves the arm in the picture and saves demonstrations", async () => {
    await at("episodes").fill(String(demonstrations));
    const still = await picture();
    await at("record").click();
    await until(async () => (await text("pill-recording")) === "rec", "the recording pill");
    const first = await until(async () => {
      const now = await picture();
      return !now.equals(still) && now;
    }, "a picture that differs from the still scene", minutes);
    await until(async () => !(await picture()).equals(first), "a picture that goes on changing", minutes);
    await keep_shot(page, "walk-recording");
    await until(async () => (await text("tally")).includes(`of ${demonstrations} tried`), "all episodes", 10 * minutes);
    assert.equal(await text("tally"), `${demonstrations} saved of ${demonstrations} tried`);
  });

  test("the demonstrations are there with their pictures", async () => {
    await at("tab-data").click();
    await until(async () => (await at("demo-card").count()) === demonstrations, "a card for each");
    await at("demo-card").first().click();
    const strip = at("keyframes").locator("img");
    assert.ok((await strip.count()) >= 3);
    await until(() => strip.first().evaluate((image) => image.naturalWidth >= 128), "a keyframe's picture");
    await keep_shot(page, "walk-data");
  });

  test("training runs and its loss is drawn", async () => {
    await at("tab-train").click();
    await at("preset").selectOption("nano");
    await at("train-limit").fill("0.3");
    await page.locator(".method summary").click();
    await at("train-radius").selectOption("cosine");
    assert.match(await text("train-method"), /radius: cosine/);
    await at("train-start").click();
    await until(async () => Number((await text("train-step")).replace(/\D/g, "")) > 0, "a training step", 3 * minutes);
    await until(async () => Number(await at("loss-chart").getAttribute("data-points")) > 1, "a loss curve", 2 * minutes);
    await keep_shot(page, "walk-train");
    await until(() => at("train-start").isEnabled(), "the end of training", 3 * minutes);
    assert.equal(await at("train-error").isVisible(), false, await text("train-error"));
    assert.ok(Number.isFinite(Number(await text("train-loss"))), await text("train-loss"));
    assert.match(await text("train-parts"), /^loss of position [\d.]+(e-\d+)?, rotation [\d.]+(e-\d+)?, openness [\d.]+(e-\d+)?$/);
  });

  test("training goes on from where it ended", async () => {
    const steps = async () => Number((await text("train-step")).replace(/\D/g, ""));
    const before = await steps();
    await at("train-limit").fill("0.1");
    await at("train-resume").click();
    await until(async () => (await steps()) > before, "a step after the last one", 2 * minutes);
    await until(() => at("train-resume").isVisible(), "the end of training", 3 * minutes);
    assert.equal(await at("train-error").isVisible(), false, await text("train-error"));
  });

  test("a prediction is stepped through, and the picture follows", async () => {
    await at("tab-debug").click();
    await until(() => at("debug-done").isVisible(), "word that recording left the task done");
    await at("debug-done").locator("button").click();
    await until(() => at("debug-done").isHidden(), "a fresh scene");
    await at("flow-steps").fill("4");
    await at("predict-integrator").selectOption("midpoint");
    await at("predict").click();
    await until(async () => (await text("step-readout")) === "step 4/4", "the prediction's last step", 2 * minutes);
    assert.match(await text("trace-error"), /mm and .*° from the expert/);
    assert.match(await text("trace-origin"), /cosine radius, midpoint/);
    const end = await picture();
    await at("step-first").click();
    assert.equal(await text("step-readout"), "step 0/4");
    assert.match(await text("step-t"), /t = 0\.000/);
    await until(async () => !(await picture()).equals(end), "another picture at step 0");
    const start_radius = Number.parseFloat(await text("step-radius"));
    await page.keyboard.press("Escape");
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowRight");
    assert.equal(await text("step-readout"), "step 2/4");
    assert.ok(Number.parseFloat(await text("step-radius")) < start_radius, "the region shrinks");
    await keep_shot(page, "walk-debug");
  });

  test("an edited state runs on to another future", async () => {
    const before_branch = await at("trace-row").count();
    const x = Number(await at("branch-x").inputValue());
    await at("branch-x").fill((x + 0.1).toFixed(3));
    await at("branch").click();
    await until(async () => /branched from .* at step 2/.test(await text("trace-origin")), "the branched trace", minutes);
    assert.equal(await at("trace-row").count(), before_branch + 1);
    await keep_shot(page, "walk-branch");
    await at("trace-parent").click();
    await until(async () => !(await text("trace-origin")).includes("branched"), "the parent");
  });

  test("a picture and a film come out", async () => {
    await at("tab-export").click();
    await at("export-width").fill("640");
    await at("export-height").fill("480");
    await at("export-png").click();
    const image = await until(async () => {
      const size = (await at("export-image").count()) && (await at("export-image").evaluate((i) => [i.naturalWidth, i.naturalHeight]));
      return size && size[0] > 0 && size;
    }, "the exported picture", 2 * minutes);
    assert.deepEqual(image, [640, 480]);
    const href = await at("export-link").getAttribute("href");
    const bytes = await page.evaluate(async (url) => (await (await fetch(url)).arrayBuffer()).byteLength, href);
    assert.ok(bytes > 20_000, `a picture of ${bytes} bytes shows nothing`);
    await at("export-strip").click();
    await until(async () => (await at("export-image").count()) && (await at("export-image").evaluate((i) => i.naturalWidth > 2000)),
      "all steps side by side", 2 * minutes);
    await at("export-cloud").click();
    await until(async () => (await at("export-link").count()) && (await at("export-link").getAttribute("href")).includes(".ply"),
      "the cloud", 2 * minutes);
    await at("export-mp4").click();
    const video = at("export-video");
    await until(async () => (await video.count()) === 1 && (await video.evaluate((v) => v.currentTime > 0.2 && v.videoWidth === 640)),
      "a playing film", 3 * minutes);
    await keep_shot(page, "walk-export");
  });

  test("a prediction is carried out", async () => {
    await at("tab-debug").click();
    await at("execute").click();
    await until(async () => /^(Moved|Failed)/.test(await text("execute-job")), "the end of the motion", 2 * minutes);
    await keep_shot(page, "walk-execute");
  });

  test("nothing was refused by the page's own policy, nothing threw", () => assert.deepEqual(complaints, []));

  test("a lost server is said at once", async () => {
    await program.kill();
    await until(() => at("banner").isVisible(), "the banner");
    assert.match(await text("banner"), /Connection lost/);
    assert.equal(await text("pill-connection"), "lost");
    assert.match(await at("picture").getAttribute("class"), /stale/);
    assert.equal(await at("play").isDisabled(), true);
    await keep_shot(page, "walk-lost");
  });
});
