import { defineConfig } from "vite";

// The page is served under a policy of default-src 'self': nothing may be inlined as a data: address or a script.
export default defineConfig({
  base: "./", // a proxy may show the page below a path of its own
  build: { target: "es2022", assetsInlineLimit: 0, modulePreload: false, reportCompressedSize: false },
  server: { proxy: Object.fromEntries(["/api", "/stream", "/snapshot", "/health", "/exports"].map(
    (path) => [path, { target: process.env.FLOWSCOPE_URL ?? "http://127.0.0.1:8080", ws: true }])) },
});
