// A colour means the same in the picture and on the page: render/overlay.h, colors.ts and the style sheet agree.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import { source_dir } from "./support.mjs";

const read = (file) => readFileSync(path.join(source_dir, file), "utf8");

function rgb_of_header() {
  const colors = {};
  for (const [, name, values] of read("render/overlay.h").matchAll(/constexpr Rgba (\w+)\{([^}]*)\}/g)) {
    const [r, g, b, a] = values.split(",").map((v) => Number.parseFloat(v));
    colors[name] = { rgb: [r, g, b].map((v) => Math.round(v * 255)), alpha: a };
  }
  return colors;
}

test("the page's palette is the renderer's", () => {
  const header = rgb_of_header();
  assert.ok(Object.keys(header).length >= 7, "the palette of render/overlay.h was not found");
  const script = read("web/ui/src/colors.ts");
  for (const [name, { rgb, alpha }] of Object.entries(header)) {
    const match = new RegExp(`\\b${name}: "rgba?\\(([^)]*)\\)"`).exec(script);
    assert.ok(match, `colors.ts lacks ${name}`);
    const [r, g, b, a = 1] = match[1].split(",").map(Number);
    [r, g, b].forEach((value, i) => assert.ok(Math.abs(value - rgb[i]) <= 1, `${name}: ${match[1]} is not ${rgb}`));
    assert.equal(a, alpha, `${name}: alpha`);
  }
});

test("the style sheet uses the same colours", () => {
  const header = rgb_of_header();
  const sheet = read("web/ui/src/styles.css");
  for (const name of ["noise", "action", "inside", "expert", "failure", "met", "unmet"]) {
    const match = new RegExp(`--${name}: rgb\\((\\d+) (\\d+) (\\d+)\\)`).exec(sheet);
    assert.ok(match, `styles.css lacks --${name}`);
    match.slice(1).map(Number).forEach((value, i) =>
      assert.ok(Math.abs(value - header[name].rgb[i]) <= 1, `--${name}: ${match[0]} is not ${header[name].rgb}`));
  }
});
