// Teleoperation with the real program: a click in the picture becomes a waypoint, the waypoints a demonstration; and moving by hand.
import assert from "node:assert/strict";
import test, { after, before, describe } from "node:test";
import { keep_shot, missing, open_browser, open_page, start, until } from "./support.mjs";

const minutes = 60_000;

describe("teleoperation in the browser", { skip: missing("FLOWSCOPE_BIN"), timeout: 20 * minutes }, () => {
  let program, browser, page, complaints, at;

  before(async () => {
    program = await start(process.env.FLOWSCOPE_BIN, ["serve", "--port", "0", "--data", "{data}", "--task", "push_buttons"]);
    browser = await open_browser();
    ({ page, complaints, at } = await open_page(browser, { url: program.url }));
    await until(async () => (await text("pill-connection")) === "live", "a live connection", minutes);
    await until(() => at("picture").evaluate((image) => image.naturalWidth > 0), "a picture", minutes);
    await until(async () => (await cards().count()) > 0, "the task's own waypoints");
  });
  after(async () => {
    if (page) await keep_shot(page, "teleop-end");
    await browser?.close();
    await program?.stop();
  });

  const text = (id) => at(id).textContent();
  const cards = () => at("waypoint-card");
  const api = (path) => page.evaluate(async (p) => (await fetch(`/api/v1/${p}`)).json(), path);
  const frame = async (name) => (await api("frames")).frames.find((f) => f.name === name).position;
  const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

  /// Where a point of the world stands on the page.
  const on_page = async (point) => {
    const camera = await api("views/main/camera");
    const { position, quaternion: [w, x, y, z] } = camera.world_from_camera;
    const d = point.map((value, i) => value - position[i]);
    const rotated = [ // by the inverse rotation
      (1 - 2 * (y * y + z * z)) * d[0] + 2 * (x * y + w * z) * d[1] + 2 * (x * z - w * y) * d[2],
      2 * (x * y - w * z) * d[0] + (1 - 2 * (x * x + z * z)) * d[1] + 2 * (y * z + w * x) * d[2],
      2 * (x * z + w * y) * d[0] + 2 * (y * z - w * x) * d[1] + (1 - 2 * (x * x + y * y)) * d[2]];
    const u = (camera.fx * rotated[0] / rotated[2] + camera.cx) / camera.width;
    const v = (camera.fy * rotated[1] / rotated[2] + camera.cy) / camera.height;
    const box = await at("picture").boundingBox();
    const scale = Math.min(box.width / camera.width, box.height / camera.height);
    return [box.x + (box.width - scale * camera.width) / 2 + u * scale * camera.width,
      box.y + (box.height - scale * camera.height) / 2 + v * scale * camera.height];
  };
  /// What the server makes of the page's script: it is asked anew, with the page's own text.
  const steps = () => page.evaluate(async () => {
    const script = document.querySelector('[data-testid="script"]').value;
    const answer = await fetch("/api/v1/waypoints", { method: "PUT", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ script }) });
    return (await answer.json()).steps;
  });
  const settle = async (count) => until(async () => (await cards().count()) === count, `${count} cards`);
  const teleop = () => api("teleop");

  test("the task's own waypoints are cards, and lie in the picture", async () => {
    const differs = async (from) => !(await at("picture").screenshot()).equals(from);
    const rests = async () => { // two looks at a scene that nothing moves in
      const look = await at("picture").screenshot();
      await new Promise((resolve) => setTimeout(resolve, 700));
      return !(await differs(look)) && look;
    };
    const with_waypoints = await until(rests, "a still picture");
    await keep_shot(page, "teleop-own");
    await at("tab-data").click();
    await until(() => differs(with_waypoints), "a picture without waypoints on another tab");
    const without = await until(rests, "a still picture");
    await at("tab-record").click();
    await until(() => differs(without), "the waypoints again");
    assert.match(await at("script").inputValue(), /steps:/);
  });

  test("a click on a button becomes a waypoint within a centimetre of it", async () => {
    for (let left = await cards().count(); left > 0; --left) {
      await at("card-delete").first().click();
      if (left > 1) await settle(left - 1);
    }
    await until(async () => !/- (move|gripper)/.test(await at("script").inputValue()), "an empty script");
    await at("add-close").click();
    await settle(1);
    await at("pick").click();
    assert.equal(await at("pick").getAttribute("aria-pressed"), "true");
    await at("pick-way-in").check();
    const top = await frame("button_1_top");
    await page.mouse.click(...await on_page(top));
    await settle(3);
    const [, before_it, there] = await steps();
    assert.ok(apart(there.world.position, top) < 0.01, `${there.world.position} is not at ${top}`);
    assert.match(there.frame, /^button_1/);
    assert.equal(there.path, "linear");
    assert.ok(Math.abs(apart(before_it.world.position, there.world.position) - 0.08) < 0.002, "the way in");
    await at("pick").click();
    await keep_shot(page, "teleop-picked");
  });

  test("the page does not scroll with cards, and the picture stays the largest thing", async () => {
    const over = await page.evaluate(() => [document.documentElement, ...document.querySelectorAll(".panel")]
      .filter((e) => e.clientHeight > 0 && (e.scrollHeight > e.clientHeight + 1 || e.scrollWidth > e.clientWidth + 1))
      .map((e) => `${e.className || e.tagName} ${e.scrollWidth}x${e.scrollHeight} in ${e.clientWidth}x${e.clientHeight}`));
    assert.deepEqual(over, []);
    assert.ok((await at("picture").boundingBox()).width > (await page.locator(".side").boundingBox()).width);
  });

  test("the waypoint is pushed in, may touch, and running it does the task", async () => {
    assert.equal(await cards().nth(2).getAttribute("aria-selected"), "true", "the new one is chosen");
    const [, , before_it] = await steps();
    await at("wp-in").click();
    await until(async () => (await steps())[2].world.position[2] < before_it.world.position[2] - 0.004, "5 mm deeper");
    await at("wp-in").click();
    await until(async () => (await steps())[2].world.position[2] < before_it.world.position[2] - 0.009, "10 mm deeper");
    await cards().nth(2).getByTestId("card-touch").click();
    await until(async () => (await steps())[2].ignore_collisions, "the leave to touch");
    await at("run-script").click();
    await until(async () => /^(Done|Failed|Finished)/.test(await text("record-job")), "the end of the run", 3 * minutes);
    assert.match(await text("record-job"), /^Done; the task succeeded/);
    await keep_shot(page, "teleop-run");
  });

  test("recording it saves a successful demonstration, here and on other placements", async () => {
    await at("episodes").fill("2");
    await at("record").click();
    await until(async () => (await text("tally")).includes("of 2 tried"), "both episodes", 5 * minutes);
    assert.equal(await text("tally"), "2 saved of 2 tried");
    const { demos } = await api("demos");
    assert.equal(demos.length, 2);
    assert.notEqual(demos[0].seed, demos[1].seed);
    assert.ok(demos.every((d) => d.task === "push_buttons" && d.keyframes >= 2));
    await keep_shot(page, "teleop-recorded");
  });

  test("changes are undone and done again, in the text, too", async () => {
    const before_it = await at("script").inputValue();
    await at("add-open").click();
    await settle(4);
    await page.keyboard.press("Control+z");
    await settle(3);
    assert.equal(await at("script").inputValue(), before_it);
    await page.keyboard.press("Control+Shift+z");
    await settle(4);
    await cards().nth(3).focus();
    await page.keyboard.press("Alt+ArrowUp");
    await until(async () => (await cards().nth(2).getAttribute("data-kind")) === "gripper", "the other order");
    await page.keyboard.press("Delete");
    await settle(3);
    await at("script-as-text").click();
    await at("script").fill(before_it.replace("gripper: close", "gripper: 0.1"));
    await at("script-as-cards").click();
    await until(async () => /0\.10 open/.test(await cards().first().textContent()), "what was typed, on its card");
    await at("script-as-text").click();
    await at("script").fill(`${before_it}  - wave: hello\n`);
    await until(async () => /wave/.test(await text("failed-line") + await text("script-problem")), "the mistake");
    await at("script").fill(before_it);
    await at("script-as-cards").click();
    await until(() => at("script-problem").isHidden(), "the mended script");
  });

  test("what is added at once stands in its order, the last one chosen", async () => {
    const before_it = await cards().count();
    await cards().last().click();
    await page.evaluate(() => {
      for (const id of ["add-close", "add-open"]) document.querySelector(`[data-testid="${id}"]`).click();
    });
    await settle(before_it + 2);
    assert.match(await cards().nth(before_it).textContent(), /gripper close/);
    assert.match(await cards().nth(before_it + 1).textContent(), /gripper open/);
    assert.equal(await cards().nth(before_it + 1).getAttribute("aria-selected"), "true");
    await page.keyboard.press("Control+z");
    await settle(before_it + 1);
    await page.keyboard.press("Control+z");
    await settle(before_it);
  });

  test("a waypoint is dragged in the picture, and turned there", async () => {
    await at("reset").click();
    await until(async () => !(await api("state")).success, "a fresh scene");
    const from = (await steps())[1].world;
    const [x, y] = await on_page(from.position);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 30, y + 4, { steps: 4 });
    await page.mouse.move(x + 60, y + 8, { steps: 4 });
    await page.mouse.up();
    const moved = await until(async () => {
      const { world } = (await steps())[1];
      return apart(world.position, from.position) > 0.02 && world;
    }, "another place");
    await until(async () => Math.hypot(...(await on_page((await steps())[1].world.position)).map((v, i) => v - [x + 60, y + 8][i])) < 4, "the place under the pointer");
    assert.ok(Math.abs(moved.position[2] - from.position[2]) < 5e-4, `it keeps its height: ${from.position} to ${moved.position}`);
    await page.keyboard.down("Alt");
    await page.mouse.wheel(0, 100);
    await page.keyboard.up("Alt");
    await until(async () => {
      const [w, a, b, c] = (await steps())[1].world.quaternion, q = from.quaternion;
      return Math.abs(2 * Math.acos(Math.min(1, Math.abs(w * q[0] + a * q[1] + b * q[2] + c * q[3]))) * 180 / Math.PI - 5) < 0.2;
    }, "a turn by five degrees");
    await keep_shot(page, "teleop-dragged");
    await page.keyboard.press("Control+z");
    await page.keyboard.press("Control+z");
    await until(async () => apart((await steps())[1].world.position, from.position) < 5e-4, "the old place");
  });

  test("keys move the tool while they are held, and not while someone types", async () => {
    const before_it = await teleop();
    await page.keyboard.down("a");
    await until(async () => (await teleop()).position[1] > before_it.position[1] + 0.02, "motion along y");
    await page.keyboard.up("a");
    const rest = await until(async () => {
      const now = await teleop();
      return now.jog === "still" && now;
    }, "the end of the motion");
    assert.ok(Math.abs(rest.position[0] - before_it.position[0]) < 0.002, "along one axis only");
    await new Promise((resolve) => setTimeout(resolve, 400));
    assert.deepEqual((await teleop()).position, rest.position, "a key that was let go moves nothing");
    await at("seed").focus();
    await page.keyboard.down("d");
    await new Promise((resolve) => setTimeout(resolve, 300));
    await page.keyboard.up("d");
    assert.deepEqual((await teleop()).position, rest.position, "typing moves nothing");
    await page.keyboard.press("Escape");

    const button = await at("jog-c").boundingBox();
    await page.mouse.move(button.x + 5, button.y + 5);
    await page.mouse.down();
    await until(async () => (await teleop()).position[2] < rest.position[2] - 0.01, "motion down");
    await keep_shot(page, "teleop-jog");
    await page.mouse.up();
    await until(async () => (await teleop()).jog === "still", "the end of it");

    // On a busy machine a word may come too late: the arm stops in between, and one press of a key is two movements.
    const take_back_to = async (strokes) => {
      for (let now = await teleop(); now.strokes > strokes; now = await teleop()) {
        await page.keyboard.press("b");
        await until(async () => (await teleop()).strokes < now.strokes, "a movement taken back");
      }
    };
    await take_back_to(rest.strokes);
    assert.ok(apart((await teleop()).position, rest.position) < 1e-6, "where the first movement ended");
    await take_back_to(before_it.strokes);
    assert.ok(apart((await teleop()).position, before_it.position) < 1e-6, "where it began");
  });

  test("what is in the way is named", async () => {
    await page.keyboard.down("c");
    await until(async () => /^(In the way|Out of reach)/.test(await text("jog-said")), "a reason", 2 * minutes);
    await page.keyboard.up("c");
    await keep_shot(page, "teleop-blocked");
    await page.keyboard.press("g");
    await until(async () => (await teleop()).openness < 0.5, "closed fingers");
  });

  test("a pose reached by hand becomes a waypoint", async () => {
    const count = await cards().count();
    await page.keyboard.press("k");
    await until(async () => (await cards().count()) > count, "a new card");
    const { position } = await teleop();
    const now = await steps();
    assert.ok(now.some((s) => s.world && apart(s.world.position, position) < 3e-4), "where the tool is");
    assert.equal((await teleop()).marks, 1);
  });

  test("what did not succeed is not saved unasked", async () => {
    const { demos } = await api("demos");
    const { seed } = await api("state");
    await page.keyboard.press("n");
    await until(() => at("save-anyway").isVisible(), "the question");
    assert.equal((await api("state")).seed, seed, "nothing is dropped before the answer");
    await keep_shot(page, "teleop-ask");
    await at("stay").click();
    assert.equal(await at("save-anyway").isVisible(), false);
    await page.keyboard.press("n");
    await page.keyboard.press("n");
    await until(async () => (await api("state")).seed === seed + 1, "the next placement");
    assert.equal((await api("demos")).demos.length, demos.length);
  });

  test("no way out of an episode drops what was moved by hand unasked", async () => {
    const { demos } = await api("demos");
    const start = await api("state");
    await page.keyboard.down("a");
    await until(async () => (await teleop()).frames > 3, "a movement");
    await page.keyboard.up("a");
    await until(async () => (await teleop()).jog === "still" && await at("save-session").isEnabled(), "its end");
    const { frames } = await teleop();
    const asked = async (words) => {
      await until(() => at("leave-session").isVisible(), "the question");
      assert.match(await text("leave-session"), words);
      await new Promise((resolve) => setTimeout(resolve, 300));
      assert.equal((await teleop()).frames, frames, "nothing is dropped before the answer");
    };
    const go_on = async () => {
      await at("stay").click();
      await until(() => at("leave-session").isHidden(), "the end of the question");
    };
    await at("tab-data").click();
    await at("reset").click();
    await asked(/^Reset without it/);
    await keep_shot(page, "teleop-ask-reset");
    await go_on();
    await at("next-seed").click();
    await asked(/^Next without it/);
    await go_on();
    await page.keyboard.press("r");
    await asked(/^Reset without it/);
    await go_on();
    await at("seed").fill(String(start.seed + 7));
    await at("seed").press("Enter");
    await asked(/^Leave without it/);
    await go_on();
    assert.equal(await at("seed").inputValue(), String(start.seed), "the present scene again");
    await at("task").selectOption("open_drawer");
    await asked(/^Leave without it/);
    await go_on();
    assert.equal(await at("task").inputValue(), "push_buttons");
    assert.equal((await api("state")).episode, start.episode);
    await at("reset").click();
    await asked(/^Reset without it/);
    await at("reset").click();
    await until(async () => (await teleop()).frames < frames, "a fresh scene at the second word");
    assert.equal((await api("state")).seed, start.seed);
    await until(() => at("leave-session").isHidden(), "no more questions");
    assert.equal((await api("demos")).demos.length, demos.length);
    await at("variation").selectOption("1");
    await until(async () => (await api("state")).variation === 1, "an untouched scene is left without a question");
    await at("variation").selectOption(String(start.variation));
    await until(async () => (await api("state")).variation === start.variation, "the variation from before");
  });

  test("a task done by hand is saved by the key for the next one", async () => {
    const before_it = (await api("demos")).demos.length;
    await page.evaluate(async () => {
      const call = (path, body) => fetch(`/api/v1/${path}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
      const frames = (await (await fetch("/api/v1/frames")).json()).frames;
      const button = frames.find((f) => f.name === "button_1_top").position;
      await call("teleop/gripper", { openness: 0.1 });
      // A hand at the keys, with eyes on the button: down, level, and down again.
      for (let i = 0; i < 1500; ++i) {
        const now = await (await fetch("/api/v1/teleop")).json();
        if (now.success) break;
        const [dx, dy] = [button[0] - now.position[0], button[1] - now.position[1]];
        const level = Math.hypot(dx, dy) < 0.006, high = now.position[2] > button[2] + 0.25;
        const cut = (v) => (high ? 0 : Math.max(-0.2, Math.min(0.2, 3 * v)));
        await call("teleop/jog", { linear: [cut(dx), cut(dy), high ? -0.2 : level ? -0.1 : 0], may_touch: level });
        await new Promise((resolve) => setTimeout(resolve, 40));
      }
      await call("teleop/jog", {});
    });
    await until(async () => (await api("state")).success, "the button pressed by hand");
    await until(() => at("save-session").isEnabled(), "the offer to save it");
    // The key asks first while the page has not heard of the success.
    await until(() => at("term").evaluateAll((terms) => terms.length > 0 && terms.every((term) => term.dataset.met === "true")), "the success in the page");
    await keep_shot(page, "teleop-by-hand");
    const { seed } = await api("state");
    await page.keyboard.press("n");
    await until(async () => (await api("state")).seed === seed + 1, "the next placement", 2 * minutes);
    assert.equal((await api("demos")).demos.length, before_it + 1);
  });

  test("a waypoint goes along with what a run has moved, and is taken hold of there", async () => {
    await page.evaluate(async () => {
      const call = (path, body) => fetch(`/api/v1/${path}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
      await call("reset", { task: "slide_block_to_color_target", variation: 0, seed: 1 });
    });
    await until(async () => /slide_block/.test(await at("script").inputValue()), "the task's own script");
    await at("script-as-text").click();
    await at("script").fill("task: slide_block_to_color_target\nsteps:\n  - move: {frame: block, position: [0, 0, 0.1], rpy_deg: [180, 0, 0]}\n");
    await at("script-as-cards").click();
    await settle(1);
    const before_it = (await steps())[0].world.position;
    const job = await page.evaluate(async () => {
      const body = JSON.stringify({ task: "slide_block_to_color_target", record: false });
      return (await (await fetch("/api/v1/script", { method: "POST", headers: { "Content-Type": "application/json" }, body })).json()).job;
    });
    await until(async () => ["done", "failed"].includes((await api(`jobs/${job}`)).state), "the end of the run", 3 * minutes);
    const now = await until(async () => {
      const { position } = (await steps())[0].world;
      return apart(position, before_it) > 0.1 && position;
    }, "the block elsewhere");
    const [x, y] = await on_page(now);
    await until(async () => {
      await page.mouse.move(x + 1, y);
      await page.mouse.move(x, y);
      return at("picture").evaluate((picture) => picture.classList.contains("over-waypoint"));
    }, "a hand over the waypoint");
    await keep_shot(page, "teleop-went-along");
  });

  test("nothing was refused by the page's own policy, nothing threw", () => assert.deepEqual(complaints, []));
});
