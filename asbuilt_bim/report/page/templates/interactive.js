"use strict";
// Searches, filters and sorts the elements, opens their cards, and keeps what is chosen in the address.
// Names become text, never markup. Markup comes out of the packs alone, which the templates drew and escaped.
(() => {
  const byId = (id) => document.getElementById(id);
  const data = JSON.parse(byId("data").textContent);
  const { columns, words, storeys, tasks, zones, trades, states } = data;
  const total = columns.id.length;
  const number = new Map(columns.id.map((id, index) => [id, index]));
  const form = byId("controls"), body = byId("table").tBodies[0], dialog = byId("card"), more = byId("more");
  const FIELDS = ["q", "storey", "class", "state", "task", "zone", "trade", "only", "sort"].filter((name) => form.elements[name]);
  const PAGE = 200, ID_PART = 5; // shorter pieces stand in GlobalIds by chance
  const SORTED = { name: "name", state: "state", lower: "-lower", upper: "-upper", seen: "-seen", area: "-area", offset: "-offset", late: "-late" };
  const collator = new Intl.Collator("en", { numeric: true });
  let chosen = {}, drawn = null, shown = [], panel = "";

  // What is chosen, and the address ---------------------------------------------------------------------------------
  function read() {
    const hash = location.hash.slice(1);
    if (hash.startsWith("e-")) return { ...chosen, e: decodeURIComponent(hash.slice(2)), s: "" };
    if (hash === "late" || hash === "since") return { only: hash };
    if (hash && !hash.includes("=")) return { ...chosen, e: "", s: "" }; // a place on the page
    return Object.fromEntries(new URLSearchParams(hash));
  }

  function address(wanted) {
    const kept = [...FIELDS, "e", "s"].filter((name) => wanted[name]).map((name) => [name, wanted[name]]);
    return `#${new URLSearchParams(kept)}`;
  }

  function go(wanted, way = "pushState") {
    try {
      history[way](null, "", address(wanted)); // as an address of its own it would scroll to the top
      follow();
    } catch {
      location.hash = address(wanted); // some browsers let no file change its address so
    }
  }

  function follow() {
    const hash = location.hash.slice(1);
    chosen = read();
    offer(chosen.sort);
    for (const name of FIELDS) if (form.elements[name].value !== (chosen[name] || "")) form.elements[name].value = chosen[name] || "";
    const wanted = address({ ...chosen, e: "", s: "" });
    if (wanted !== drawn) {
      drawn = wanted;
      shown = found(chosen);
      draw();
    }
    if (hash === "late" || hash === "since") byId("elements").scrollIntoView();
    if (chosen.state || chosen.storey || chosen.class || chosen.task || chosen.zone || chosen.trade || chosen.only) byId("filters").open = true;
    open(chosen.e ? `e ${chosen.e}` : chosen.s ? `s ${chosen.s}` : "");
    const place = hash && !hash.includes("=") && byId(hash);
    if (place && place.classList.contains("floor")) place.open = true;
    if (place) place.scrollIntoView(); // a card that closes here would lead back to where it was opened
  }

  // Which elements, in which order ----------------------------------------------------------------------------------
  const haystack = columns.id.map((id, i) =>
    [columns.name[i], columns.class[i], `Ifc${columns.class[i].replaceAll(" ", "")}`, storeys[columns.storey[i]], ...columns.task[i].map((one) => tasks[one]), ...columns.zone[i].map((one) => zones[one])].join("\n").normalize("NFC").toLowerCase());

  function found(wanted) {
    const parts = (wanted.q || "").normalize("NFC").toLowerCase().split(/\s+/).filter(Boolean);
    const storey = wanted.storey ? storeys.indexOf(wanted.storey) : -1, task = tasks.indexOf(wanted.task), zone = zones.indexOf(wanted.zone), trade = trades.indexOf(wanted.trade);
    const kept = [];
    for (let i = 0; i < total; i += 1) {
      if (wanted.storey && columns.storey[i] !== storey) continue;
      if (wanted.task && !columns.task[i].includes(task)) continue;
      if (wanted.zone && !columns.zone[i].includes(zone)) continue;
      if (wanted.trade && !columns.trade[i].includes(trade)) continue;
      if (wanted.class && columns.class[i] !== wanted.class) continue;
      if (wanted.state && columns.state[i] !== wanted.state) continue;
      if (wanted.only && !columns.only[i].includes(wanted.only)) continue;
      if (parts.every((part) => haystack[i].includes(part) || (part.length >= ID_PART && columns.id[i].toLowerCase().includes(part)))) kept.push(i);
    }
    return wanted.sort ? sorted(kept, wanted.sort) : kept;
  }

  function sorted(kept, by) {
    const way = by.startsWith("-") ? -1 : 1, key = by.replace("-", "");
    if (!Object.hasOwn(SORTED, key)) return kept;
    const values = key === "state" ? columns.state.map((one) => states.indexOf(one)) : columns[key];
    return kept.sort((a, b) => {
      const [x, y] = [values[a], values[b]];
      if (x === null || y === null) return (x === null) - (y === null) || a - b; // what is unknown stands last, either way
      return way * (typeof x === "string" ? collator.compare(x, y) : x - y) || a - b;
    });
  }

  // The table -------------------------------------------------------------------------------------------------------
  const heads = [...byId("table").tHead.rows[0].cells];

  function made(tag, name, text) {
    const node = document.createElement(tag);
    if (name) node.className = name;
    if (text !== undefined) node.textContent = text;
    return node;
  }

  const chip = (state) => made("span", `chip ${state.replaceAll(" ", "")}`, state);

  function nameCell(cell, i) {
    const link = made("a", "", columns.name[i] || columns.id[i]);
    link.href = address({ ...chosen, e: columns.id[i], s: "" });
    const more = made("span", "id", `${columns.class[i]}, ${storeys[columns.storey[i]]} `);
    more.append(made("code", "", columns.id[i]));
    cell.className = "lead";
    cell.append(link, more);
  }

  function barCell(cell, i) {
    const bar = made("span", "bar"), lower = made("i", "built"), upper = made("i", "unseen");
    lower.style.width = `${100 * columns.lower[i]}%`;
    upper.style.width = `${100 * (columns.upper[i] - columns.lower[i])}%`;
    bar.append(lower, upper);
    bar.setAttribute("aria-hidden", "true"); // the next cells say it
    cell.append(bar);
  }

  function row(i) {
    const line = made("tr");
    for (const head of heads) {
      const what = head.dataset.cell, cell = made("td", head.className);
      cell.dataset.label = head.textContent;
      if (what === "name") nameCell(cell, i);
      else if (what === "state") cell.append(chip(columns.state[i]));
      else if (what === "bar") barCell(cell, i);
      else cell.textContent = what === "late" ? columns.late[i] ?? "" : words[what][i];
      line.append(cell);
    }
    return line;
  }

  function draw() {
    body.replaceChildren();
    byId("count").textContent = shown.length;
    for (const head of heads) {
      const by = SORTED[head.dataset.cell]?.replace("-", "");
      head.removeAttribute("aria-sort");
      if (by && (chosen.sort || "").replace("-", "") === by) head.setAttribute("aria-sort", chosen.sort.startsWith("-") ? "descending" : "ascending");
    }
    drawMore();
    const floors = [...document.querySelectorAll(".floor")];
    for (const floor of floors) {
      floor.hidden = Boolean(chosen.storey) && floor.firstElementChild.textContent !== chosen.storey;
      if (chosen.storey && !floor.hidden) floor.open = true;
      pale(floor);
    }
  }

  function drawMore() {
    const from = body.rows.length;
    body.append(...shown.slice(from, from + PAGE).map(row));
    more.hidden = body.rows.length >= shown.length;
  }

  // Packs, pictures, plans ------------------------------------------------------------------------------------------
  const packs = new Map();

  function unpacked(key) {
    if (!packs.has(key)) {
      const bytes = Uint8Array.from(atob(byId(`pack-${key}`).textContent), (one) => one.charCodeAt(0));
      packs.set(key, new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).json());
    }
    return packs.get(key);
  }

  function withPictures(root) {
    for (const use of root.querySelectorAll("use")) {
      const key = use.getAttribute("href").slice(1), kept = byId(`photo-${key}`);
      if (!kept || byId(key)) continue;
      const part = (tag, given) => {
        const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
        for (const [name, value] of Object.entries(given)) node.setAttribute(name, value);
        return node;
      };
      const { width, height } = kept.dataset;
      const symbol = part("symbol", { id: key, viewBox: `0 0 ${width} ${height}`, overflow: "visible" });
      symbol.append(part("image", { href: `data:image/jpeg;base64,${kept.textContent}`, width, height }));
      byId("symbols").append(symbol);
    }
  }

  function pale(floor) {
    const kept = new Set(shown.map((i) => `#e-${columns.id[i]}`));
    for (const link of floor.querySelectorAll("a")) link.classList.toggle("pale", !kept.has(link.getAttribute("href")));
  }

  async function drawPlan(floor, index) {
    if (!floor.open || floor.lastElementChild.hasChildNodes()) return;
    floor.lastElementChild.innerHTML = (await unpacked("plans"))[index];
    pale(floor);
  }

  // A card ----------------------------------------------------------------------------------------------------------
  async function open(wanted) {
    if (wanted === panel) return;
    panel = wanted;
    if (!wanted) return void (dialog.open && dialog.close());
    const name = wanted.slice(2), i = wanted.startsWith("e ") ? number.get(name) : undefined;
    byId("card-title").textContent = i === undefined ? name : columns.name[i] || name;
    byId("card-chip").replaceChildren(...(i === undefined ? [] : [chip(columns.state[i])]));
    byId("card-sub").textContent = i === undefined ? "" : [columns.class[i], storeys[columns.storey[i]], name].join(", ");
    byId("card-body").replaceChildren();
    byId("old").hidden = byId("missing").hidden = true;
    const at = shown.indexOf(i);
    byId("previous").disabled = at <= 0;
    byId("following").disabled = at < 0 || at >= shown.length - 1;
    if (!dialog.open) dialog.showModal();
    if (typeof DecompressionStream === "undefined") return void (byId("old").hidden = false);
    const html = i !== undefined ? (await unpacked(`cards-${columns.storey[i]}`))[name] : wanted.startsWith("s ") ? (await unpacked("stations"))[name] : "";
    if (panel !== wanted) return; // another one was opened meanwhile
    byId("missing").hidden = Boolean(html);
    byId("card-body").innerHTML = html || "";
    withPictures(byId("card-body"));
    dialog.scrollTop = 0;
    dialog.dataset.ready = wanted;
  }

  function step(by) {
    const at = shown.indexOf(number.get(chosen.e)), to = shown[at + by];
    if (at >= 0 && to !== undefined) go({ ...chosen, e: columns.id[to], s: "" });
  }

  // What is done to the page ----------------------------------------------------------------------------------------
  function fill(name, values) {
    for (const value of values) form.elements[name].append(new Option(value, value));
  }

  function listen() {
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("reset", (event) => (event.preventDefault(), go({})));
    form.addEventListener("input", () => {
      const values = FIELDS.map((name) => [name, form.elements[name].value]);
      go({ ...Object.fromEntries(values) }, "replaceState");
    });
    more.addEventListener("click", () => {
      const next = body.rows.length;
      drawMore();
      body.rows[next]?.querySelector("a").focus();
    });
    dialog.addEventListener("close", () => panel && go({ ...chosen, e: "", s: "" }));
    byId("shut").addEventListener("click", () => dialog.close());
    byId("previous").addEventListener("click", () => step(-1));
    byId("following").addEventListener("click", () => step(1));
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const writing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
      if (event.key === "/" && !writing && !dialog.open) event.preventDefault(), form.elements.q.focus();
      if (dialog.open && event.key === "ArrowLeft") step(-1);
      if (dialog.open && event.key === "ArrowRight") step(1);
    });
    for (const button of document.querySelectorAll("[data-station]")) button.addEventListener("click", () => go({ ...chosen, e: "", s: button.dataset.station }));
    document.querySelectorAll(".floor").forEach((floor, index) => floor.addEventListener("toggle", () => drawPlan(floor, index)));
    for (const link of document.querySelectorAll(".matrix a, .gantt a")) link.addEventListener("click", () => byId("elements").scrollIntoView());
    window.addEventListener("hashchange", follow);
  }

  function offer(by) {
    const head = heads.find((one) => by && SORTED[one.dataset.cell]?.replace("-", "") === by.replace("-", ""));
    if (!head || [...form.elements.sort.options].some((one) => one.value === by)) return;
    form.elements.sort.append(new Option(`${head.textContent} ${by.startsWith("-") ? "↓" : "↑"}`, by));
  }

  function headButtons() {
    for (const head of heads) {
      const by = SORTED[head.dataset.cell];
      if (!by) continue;
      const button = made("button", "", head.textContent);
      button.type = "button";
      button.addEventListener("click", () => {
        const turned = by.startsWith("-") ? by.slice(1) : `-${by}`;
        go({ ...chosen, e: "", s: "", sort: chosen.sort === by ? turned : by });
      });
      head.replaceChildren(button);
    }
  }

  fill("storey", storeys);
  fill("class", [...new Set(columns.class)].sort());
  fill("state", states.filter((one) => columns.state.includes(one)));
  fill("task", tasks);
  if (zones.length) fill("zone", zones);
  if (form.elements.trade) fill("trade", trades);
  byId("filters").open = window.innerWidth > 720;
  headButtons();
  listen();
  follow();
  const floors = document.querySelectorAll(".floor");
  if (floors.length && ![...floors].some((one) => one.open)) floors[0].open = true;
  document.documentElement.dataset.ready = "yes";
})();
