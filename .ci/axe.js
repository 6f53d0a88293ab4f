// Holds a report page against axe-core in Chromium: from 320 to 1280 px, dark, and as printed. No text may run off its card.
// npm install --prefix /tmp/axe axe-core puppeteer-core
// NODE_PATH=/tmp/axe/node_modules CHROMIUM=/usr/bin/chromium node .ci/axe.js "$PWD/out/report.html"
const fs = require("fs");
const puppeteer = require("puppeteer-core");

const AXE = fs.readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const CASES = [
  { name: "320 px", width: 320 },
  { name: "390 px", width: 390 },
  { name: "768 px", width: 768 },
  { name: "1280 px", width: 1280 },
  { name: "dark", width: 1280, scheme: "dark" },
  { name: "dark, 390 px", width: 390, scheme: "dark" },
  { name: "print", width: 700, media: "print" },
];

// In the page: texts that end past their row, card or the page; pictures that scroll by themselves are left out.
function runOff() {
  const found = [];
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const holder = texts.currentNode.parentElement;
    if (!texts.currentNode.textContent.trim() || holder.closest(".stage, .hidden, svg")) continue;
    const right = Math.min(innerWidth, (holder.closest("tr, section, dialog, main") || document.body).getBoundingClientRect().right);
    const range = document.createRange();
    range.selectNodeContents(texts.currentNode);
    if ([...range.getClientRects()].some((box) => box.width > 1 && box.right > right + 1)) found.push(texts.currentNode.textContent.trim().slice(0, 40));
  }
  return found;
}

async function held(browser, page, one) {
  const tab = await browser.newPage();
  const faults = [];
  tab.on("console", (said) => ["error", "warning"].includes(said.type()) && faults.push(said.text()));
  tab.on("pageerror", (error) => faults.push(String(error)));
  tab.on("request", (asked) => !/^(data:|file:\/\/)/.test(asked.url()) && faults.push(`asks for ${asked.url()}`));
  await tab.setBypassCSP(true); // axe is a script, and the page lets none run
  await tab.setViewport({ width: one.width, height: 844 });
  await tab.emulateMediaFeatures([{ name: "prefers-color-scheme", value: one.scheme || "light" }]);
  if (one.media) await tab.emulateMediaType(one.media);
  await tab.goto(`file://${page}`, { waitUntil: "load" });
  await tab.evaluate(() => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
  const wide = await tab.evaluate(() => document.documentElement.scrollWidth);
  if (wide > one.width) faults.push(`is ${wide} px wide`);
  for (const text of await tab.evaluate(runOff)) faults.push(`runs off: ${text}`);
  await tab.evaluate(AXE);
  const { violations } = await tab.evaluate(() => window.axe.run());
  faults.push(...violations.map((rule) => `${rule.id}: ${rule.nodes.length} times, ${rule.nodes[0].html.slice(0, 120)}`));
  await tab.close();
  console.log(`${one.name}: ${faults.length ? faults.join("\n  ") : "0 violations, no request, no error"}`);
  return faults.length;
}

(async () => {
  const options = { executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox"] };
  const browser = await puppeteer.launch(options);
  let count = 0;
  for (const one of CASES) count += await held(browser, process.argv[2], one);
  await browser.close();
  process.exitCode = count ? 1 : 0;
})();
