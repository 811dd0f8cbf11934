// The page below a path of a proxy and under a name of its own, as Jupyter and code-server show it.
import assert from "node:assert/strict";
import http from "node:http";
import net from "node:net";
import path from "node:path";
import test, { after, before, describe } from "node:test";
import { missing, open_browser, open_page, source_dir, start, until } from "./support.mjs";

/// Hands everything below `prefix` on to the program, with the prefix or without it; `refused` holds what came for other paths.
async function start_proxy(target, prefix, { strip }) {
  const refused = [];
  const inner = (url) => (strip ? url.slice(prefix.length) || "/" : url);
  const server = http.createServer((request, response) => {
    if (!request.url.startsWith(prefix)) {
      refused.push(request.url);
      return response.writeHead(404).end();
    }
    const onward = http.request({ host: "127.0.0.1", port: target.port, path: inner(request.url), method: request.method, headers: request.headers },
      (answer) => {
        response.writeHead(answer.statusCode, answer.headers);
        answer.pipe(response);
      });
    onward.on("error", () => response.destroy());
    response.on("close", () => onward.destroy());
    request.pipe(onward);
  });
  server.on("upgrade", (request, socket, rest) => {
    if (!request.url.startsWith(prefix)) {
      refused.push(request.url);
      return socket.destroy();
    }
    const onward = net.connect(Number(target.port), "127.0.0.1", () => {
      const headers = request.rawHeaders.reduce((text, word, i) => text + word + (i % 2 === 0 ? ": " : "\r\n"), "");
      onward.write(`GET ${inner(request.url)} HTTP/1.1\r\n${headers}\r\n`);
      onward.write(rest);
      socket.pipe(onward).pipe(socket);
    });
    onward.on("error", () => socket.destroy());
    socket.on("error", () => onward.destroy());
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return { port: server.address().port, refused, stop: () => { server.closeAllConnections(); server.close(); } };
}

const cases = [
  { name: "a prefix that is cut off", prefix: "/proxy/8080", strip: true, host: "127.0.0.1", options: [] },
  { name: "a prefix that stays", prefix: "/absproxy/8080", strip: false, host: "127.0.0.1", options: ["--base-path", "/absproxy/8080"] },
  { name: "a name of its own", prefix: "/user/anna/proxy/8080", strip: true, host: "hub.localhost", options: ["--allow-host", "hub.localhost"] },
];

describe("the page behind a proxy", { skip: missing("FLOWSCOPE_FAKE"), timeout: 600_000 }, () => {
  let browser;
  before(async () => {
    browser = await open_browser();
  });
  after(() => browser?.close());

  for (const { name, prefix, strip, host, options } of cases) {
    test(`works below ${name}`, async () => {
      const program = await start(process.env.FLOWSCOPE_FAKE,
        ["--port", "0", "--token", "0123456789abcdef", "--page", path.join(source_dir, "web/ui/dist"), ...options]);
      const proxy = await start_proxy(new URL(program.url), prefix, { strip });
      const { page, context, complaints, at } = await open_page(browser,
        { url: `http://${host}:${proxy.port}${prefix}/?token=0123456789abcdef` });
      try {
        await until(async () => (await at("pill-connection").textContent()) === "live", "a live connection");
        await until(() => at("picture").evaluate((image) => image.naturalWidth > 0), "the live picture");
        assert.equal(new URL(page.url()).pathname, `${prefix}/`);
        assert.equal(new URL(page.url()).search, "", "the token has left the address bar");
        const [cookie] = await context.cookies();
        assert.ok(`${prefix}/`.startsWith(cookie.path) && cookie.path.length > 1, `the cookie stays below the prefix: ${cookie.path}`);
        await at("tab-export").click();
        await at("export-png").click();
        await until(() => at("export-image").evaluate((image) => image.naturalWidth > 0), "the exported picture");
        await at("tab-data").click();
        await until(() => page.evaluate(() => [...document.images].every((image) => !image.complete || image.naturalWidth > 0)), "every picture");
        assert.deepEqual(proxy.refused, [], "nothing is asked for beside the prefix");
        assert.deepEqual(complaints, []);
      } finally {
        await context.close();
        proxy.stop();
        await program.stop();
      }
    });
  }
});
