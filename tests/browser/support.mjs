// Starts a flowscope program (the real one or the one with canned data) and opens its page in Chromium.
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url));
export const source_dir = path.resolve(here, "../..");
const { chromium } = createRequire(path.join(source_dir, "web/ui/package.json"))("playwright-core");

const browser_arguments = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync"];

/// Limits only end a test that hangs; a busy machine may take its time.
const patience_ms = 60_000;

/// FLOWSCOPE_SLOW_MS delays every call of the page by that much: a test that asks before an answer came then fails surely.
const slow_ms = Number(process.env.FLOWSCOPE_SLOW_MS ?? 0);

/// Why a suite cannot run here, or false: the form that node:test's `skip` takes.
export function missing(variable) {
  const program = process.env[variable];
  if (!program) return `${variable} is not set`;
  return existsSync(program) ? false : `${variable}: there is no ${program}`;
}

/// A running program; `url` is the address that it printed. `stop` ends it and removes its data.
export async function start(program, options) {
  const data = mkdtempSync(path.join(tmpdir(), "flowscope-browser-"));
  const child = spawn(program, options.map((option) => option.replace("{data}", data)), { stdio: ["ignore", "pipe", "pipe"] });
  let said = "";
  const ended = new Promise((resolve) => child.once("exit", resolve));
  const url = await new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`no address after 60 s; it said:\n${said}`)), 60_000);
    const listen = (chunk) => {
      said += chunk;
      const match = /http:\/\/\S+/.exec(said);
      if (!match || !said.slice(match.index).includes("\n")) return;
      clearTimeout(timer);
      resolve(match[0]);
    };
    child.stdout.on("data", listen);
    child.stderr.on("data", (chunk) => (said += chunk));
    child.once("error", reject);
    child.once("exit", (code) => reject(new Error(`${program} ended with ${code}; it said:\n${said}`)));
  });
  return {
    url,
    data,
    said: () => said,
    async kill(signal = "SIGKILL") {
      child.kill(signal);
      await ended;
    },
    async stop() {
      if (child.exitCode === null && child.signalCode === null) {
        child.kill("SIGTERM");
        const timer = setTimeout(() => child.kill("SIGKILL"), 10_000);
        await ended;
        clearTimeout(timer);
      }
      rmSync(data, { recursive: true, force: true });
    },
  };
}

export async function open_browser() {
  return await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: browser_arguments });
}

/// A page whose complaints (exceptions, refused content) are kept in `complaints`.
export async function open_page(browser, { width = 1280, height = 720, prepare = async () => {}, url }) {
  const context = await browser.newContext({ viewport: { width, height } });
  context.setDefaultTimeout(patience_ms);
  const page = await context.newPage();
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (message) => {
    // A refused call is also written to the console; those are the calls' own business.
    if (message.type() === "error" && !message.text().startsWith("Failed to load resource")) complaints.push(message.text());
  });
  if (slow_ms > 0) {
    await context.route(/\/api\/v1\//, async (route) => {
      await new Promise((resolve) => setTimeout(resolve, slow_ms));
      await route.fallback();
    });
  }
  await prepare(page);
  await page.goto(url, { waitUntil: "domcontentloaded" });
  return { page, context, complaints, at: (id) => page.getByTestId(id) };
}

/// Waits until `look` gives something true; fails with what it gave last.
export async function until(look, what, timeout_ms = patience_ms) {
  const end = Date.now() + timeout_ms;
  let last;
  do {
    last = await look();
    if (last) return last;
    await new Promise((resolve) => setTimeout(resolve, 100));
  } while (Date.now() < end);
  throw new Error(`not within ${timeout_ms / 1000} s: ${what} (last: ${JSON.stringify(last)})`);
}

/// A screenshot into FLOWSCOPE_SHOTS, when that is set: for people who want to see the page.
export async function keep_shot(page, name) {
  const folder = process.env.FLOWSCOPE_SHOTS;
  if (!folder) return;
  mkdirSync(folder, { recursive: true });
  await page.screenshot({ path: path.join(folder, `${name}.png`) });
}
