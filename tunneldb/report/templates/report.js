"use strict";
(() => {
  const $ = (selector, from = document) => from.querySelector(selector);
  const data = JSON.parse($("#data").textContent);
  const leaks = data.rows.map((row) => Object.fromEntries(data.columns.map((name, i) => [name, row[i]])));
  const byId = new Map(leaks.map((leak) => [leak.id, leak]));
  const _ = (text, values = {}) => (data.words[text] ?? text).replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
  const tabled = $("#leaks") !== null; // an owner's template may leave chapters out
  const PAGE = 100;
  const state = { sort: "chainage", up: true, page: 0, stretch: null, all: false };

  // Elements: name, attributes, children (nodes or text); "svg:" before the name for drawings.
  function make(name, attributes = {}, ...children) {
    const drawing = name.startsWith("svg:");
    const node = drawing
      ? document.createElementNS("http://www.w3.org/2000/svg", name.slice(4))
      : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else node.setAttribute(key, value);
    }
    node.append(...children);
    return node;
  }

  const fixed = (value, decimals) => (value === null ? "–" : value.toFixed(decimals));
  const signed = (value) => (value > 0 ? "+" : value < 0 ? "−" : "") + Math.abs(value).toFixed(2);
  const arc = (leak) => _("{low} to {high}", { low: signed(leak.arcFrom), high: signed(leak.arcTo) });
  const review = (leak) => make("span", { class: `review ${leak.review}` }, _(leak.review) + (leak.detected ? "" : _(", not found again")));

  const coordinates = (leak) => [leak.easting, leak.northing, leak.height].map((value) => value.toFixed(2)).join(" ");

  // Columns of the table: heading, key, cell, class; minor ones are left out on a phone.
  const several = new Set(leaks.map((leak) => leak.kind)).size > 1 || leaks.some((leak) => leak.origin !== "detected");
  const kind = (leak) => _(leak.kind) + (leak.origin === "detected" ? "" : `, ${_(leak.origin)}`);
  const columns = [
    ["No.", "id", (l) => l.id, "n"],
    [data.place, "chainage", (l) => l.label, ""],
    ...(several ? [["Kind", "kind", kind, "kinds"]] : []),
    ["Clock", "clock", (l) => l.clockLabel, "n"],
    ["Arc m", "arcFrom", arc, "n minor"],
    ["Length m", "length", (l) => fixed(l.length, 2), "n minor"],
    ["Area m²", "area", (l) => fixed(l.area, 2), "n"],
    ["Darkening dB", "drop", (l) => fixed(l.drop, 1), "n minor"],
    ["Contrast σ", "contrast", (l) => fixed(l.contrast, 1), "n minor"],
    ["Confidence", "confidence", (l) => fixed(l.confidence, 2), "n minor"],
    ...(leaks.some((leak) => leak.otherImages) ? [["Other images", "otherContrast", (l) => l.otherImages || "–", "minor"]] : []),
    ...(leaks.some((leak) => leak.severity) ? [["Severity", "severity", (l) => _(l.severityLabel), "minor"]] : []),
    ["Review", "review", review, ""],
    ["By", "by", (l) => l.by, "minor"],
    ["Remark", "remark", (l) => l.remark, "minor remark"],
    ["E, N, H m", "easting", coordinates, "n minor screen"],
  ];

  function wanted(leak, filters) {
    if (filters.review === "counted" ? leak.review === "rejected" : filters.review && leak.review !== filters.review) return false;
    if (filters.area && !(leak.area >= Number(filters.area))) return false;
    const hour = leak.clock % 12;
    if (filters.clock === "crown" && hour > 2 && hour < 10) return false;
    if (filters.clock === "right" && (hour < 2 || hour > 6)) return false;
    if (filters.clock === "left" && (hour < 6 || hour > 10)) return false;
    if (state.stretch !== null && leak.strip !== state.stretch) return false;
    const text = filters.text.trim().toLowerCase();
    return !text || String(leak.id) === text || [leak.label, leak.remark, leak.by].some((value) => value.toLowerCase().includes(text));
  }

  function chosen() {
    const filters = Object.fromEntries(new FormData($("#filters")));
    const way = state.up ? 1 : -1;
    const value = (leak) => leak[state.sort];
    return leaks
      .filter((leak) => wanted(leak, filters))
      .sort((a, b) => {
        const [x, y] = [value(a), value(b)];
        if (x === y) return a.chainage - b.chainage || a.id - b.id;
        if (x === null) return 1;
        if (y === null) return -1;
        return way * (typeof x === "string" ? x.localeCompare(y) : x - y);
      });
  }

  function sortBy(key) {
    state.up = state.sort === key ? !state.up : !["area", "drop", "contrast", "confidence", "length", "otherContrast"].includes(key);
    state.sort = key;
    state.page = 0;
    show();
  }

  let listed = [];
  function show(here = null) {
    if (!tabled) { listed = leaks; return; }
    listed = state.all ? leaks : chosen();
    const pages = Math.max(1, Math.ceil(listed.length / PAGE));
    if (here !== null) {
      const place = listed.findIndex((leak) => leak.id === here);
      if (place >= 0) state.page = Math.floor(place / PAGE);
    }
    state.page = Math.min(state.page, pages - 1);
    // sums are those of the summary: of leaks found last and not rejected, the part that lies in the stretch reported
    const area = listed.filter((leak) => leak.detected && leak.review !== "rejected").reduce((sum, leak) => sum + leak.inside, 0);
    $("#found").textContent = !data.searched && !leaks.length
      ? _("Leaks were not searched for")
      : state.all
        ? _("Leaks by chainage, including rejected ones: {count}", { count: listed.length })
        : _("Leaks: {count} of {all}, {area} m²", { count: listed.length, all: leaks.length, area: area.toFixed(2) });
    $("#table thead").replaceChildren(
      make("tr", {}, ...columns.map(([heading, key, , kind]) => {
        const sorted = state.sort === key ? { "aria-sort": state.up ? "ascending" : "descending" } : {};
        return make("th", { class: kind, ...sorted }, state.all ? _(heading) : make("button", { type: "button", onclick: () => sortBy(key) }, _(heading)));
      })),
    );
    const part = state.all ? listed : listed.slice(state.page * PAGE, (state.page + 1) * PAGE);
    $("#table tbody").replaceChildren(...part.map((leak) => row(leak, here)));
    const turn = (by) => () => { state.page += by; show(); $("#leaks").scrollIntoView(); };
    $("#pages").replaceChildren(
      ...(pages > 1
        ? [
            make("button", { type: "button", onclick: turn(-1), ...(state.page === 0 ? { disabled: "" } : {}) }, _("Previous")),
            _("Page {page} of {pages}", { page: state.page + 1, pages }),
            make("button", { type: "button", onclick: turn(1), ...(state.page === pages - 1 ? { disabled: "" } : {}) }, _("Next")),
          ]
        : []),
    );
    const chip = $("#stretch");
    chip.hidden = state.stretch === null;
    if (state.stretch !== null) chip.textContent = _("Only {stretch} ✕", { stretch: $(`#strip-${state.stretch} figcaption b`).textContent });
  }

  function row(leak, here) {
    const cells = columns.map(([, key, cell, kind]) => {
      const content = cell(leak);
      return key === "id"
        ? make("td", { class: kind }, make("a", { href: `#leak-${leak.id}` }, String(content)))
        : make("td", { class: kind }, content instanceof Node ? content : String(content));
    });
    const attributes = { class: `${leak.review}${leak.id === here ? " here" : ""}`, "data-id": leak.id };
    return make("tr", { ...attributes, onclick: () => { location.hash = `leak-${leak.id}`; } }, ...cells);
  }

  // What a leak's picture and section show lies in its strip, and is read when it is asked for.
  const read = new Map();
  function detail(leak) {
    if (!read.has(leak.strip)) {
      if (read.size > 3) read.delete(read.keys().next().value);
      const script = $(`#strip-${leak.strip} script`);
      read.set(leak.strip, script ? JSON.parse(script.textContent) : {});
    }
    return read.get(leak.strip)[leak.id];
  }

  function picture(leak, shown, file, title) {
    const [width, height] = shown.size;
    const bar = [0.5, 1, 2, 5, 10, 20, 50].findLast((length) => length < width / 2) ?? 0.5;
    const [x, y] = [width * 0.04, height * 0.95];
    const drawing = make("svg:svg", { viewBox: `0 0 ${width} ${height}`, class: `view ${leak.review}`, role: "img", "aria-label": _("Lining around leak {id}", { id: leak.id }) });
    if (file) {
      drawing.append(make("svg:image", { width, height, preserveAspectRatio: "none", href: file }));
    }
    drawing.append(make("svg:path", { d: shown.outline }));
    for (let n = 0; n < 2; n += 1) drawing.append(make("svg:line", { x1: x, x2: x + bar, y1: y, y2: y, class: "scale" }));
    const caption = file ? _("{width} m of lining; bar {bar} m", { width: width.toFixed(1), bar }) : _("No image here; bar {bar} m", { bar });
    return make("figure", {}, drawing, make("figcaption", {}, title ? `${title}: ${caption}` : caption));
  }

  function section(leak, shown) {
    const drawing = make("svg:svg", { viewBox: shown.box, class: "section", role: "img", "aria-label": _("Cross-section at leak {id}", { id: leak.id }) });
    drawing.append(make("svg:path", { d: shown.section, class: "lining" }), make("svg:path", { d: shown.band, class: "band" }));
    drawing.append(make("svg:path", { d: "M-.15 0H.15M0-.15V.15", class: "axis" }));
    const [x, y, width, height] = shown.box.split(" ").map(Number);
    for (const [hour, at, up] of [["12", 0, y + 0.35], ["3", x + width - 0.35, 0], ["6", 0, y + height - 0.35], ["9", x + 0.35, 0]]) {
      drawing.append(make("svg:text", { x: at, y: up }, hour));
    }
    const far = { distance: Math.abs(shown.at).toFixed(1) };
    const off = Math.abs(shown.at) < 0.05
      ? _("Section")
      : shown.at > 0 ? _("Section {distance} m up-chainage", far) : _("Section {distance} m down-chainage", far);
    return make("figure", {}, drawing, make("figcaption", {}, off));
  }

  function card(leak) {
    const shown = detail(leak);
    const facts = [
      [_("Area"), `${fixed(leak.area, 2)} m²`], [_("Clock"), leak.clockLabel], [_("Arc, m"), arc(leak)], [_("Length"), `${fixed(leak.length, 2)} m`],
      [_("Darkening, mean and greatest"), `${fixed(leak.drop, 1)}, ${fixed(leak.dropMax, 1)} dB`], [_("Contrast"), `${fixed(leak.contrast, 1)} σ`],
      [_("Confidence"), fixed(leak.confidence, 2)], [_("Measured"), leak.imageShare === null ? _("not yet") : _("{share} % of it", { share: Math.round(100 * leak.imageShare) })],
    ];
    if (leak.otherImages) facts.push([_("Other images"), leak.otherImages]);
    facts.push([_("E, N, H m"), coordinates(leak)]);
    const list = make("dl", {}, ...facts.map(([term, value]) => make("div", {}, make("dt", {}, term), make("dd", {}, value))));
    if (leak.by) list.append(make("div", { class: "long" }, make("dt", {}, _("Reviewed")), make("dd", {}, _("{state} by {who}, {when}", { state: _(leak.review), who: leak.by, when: leak.at }))));
    if (leak.severity) list.append(make("div", {}, make("dt", {}, _("Severity")), make("dd", {}, _(leak.severityLabel))));
    if (leak.origin !== "detected") list.append(make("div", {}, make("dt", {}, _("Origin")), make("dd", {}, _(leak.origin))));
    if (leak.remark) list.append(make("div", { class: "long" }, make("dt", {}, _("Remark")), make("dd", {}, leak.remark)));
    const pictures = make("div", { class: shown && shown.colour ? "pictures coloured" : "pictures" });
    if (shown) pictures.append(picture(leak, shown, shown.picture, ""));
    if (shown && shown.colour) pictures.append(picture(leak, shown, shown.colour, _("Colour")));
    if (shown && shown.section) pictures.append(section(leak, shown));
    return make("article", { class: "card" },
      make("header", {}, make("b", {}, `${_(leak.kind)} ${leak.id}`), make("span", {}, leak.label), review(leak)), pictures, list);
  }

  const dialog = $("#leak");
  function open(leak) {
    const place = listed.indexOf(leak);
    const go = (other) => () => { location.hash = `leak-${other.id}`; };
    const step = (by, text) => {
      const other = place < 0 ? undefined : listed[place + by];
      return make("button", { type: "button", ...(other ? { onclick: go(other) } : { disabled: "" }) }, text);
    };
    const shown = card(leak);
    const photos = $(`#finding-${leak.id} + .photos td:last-child`); // they stand with the findings, once
    if (photos) shown.append(make("div", { class: "photos" }, ...[...photos.children].map((photo) => photo.cloneNode(true))));
    dialog.replaceChildren(shown, make("div", { class: "bar-of" },
      step(-1, _("Previous")), step(1, _("Next")),
      ...($("#lining") ? [make("button", { type: "button", class: "to-strip", onclick: () => { dialog.close(); find(leak); } }, _("Show on the lining"))] : []),
      ...(tabled ? [make("button", { type: "button", class: "to-table", onclick: () => { dialog.close(); point(leak); } }, _("Show in the table"))] : []),
      make("button", { type: "button", class: "close", onclick: () => dialog.close() }, _("Close"))));
    if (!dialog.open) dialog.showModal();
  }

  function find(leak) {
    for (const link of document.querySelectorAll(".strip a.here")) link.classList.remove("here");
    const strip = $(`#strip-${leak.strip}`);
    const link = $(`a.${leak.review}[href="#leak-${leak.id}"]`, strip);
    link.classList.add("here");
    strip.scrollIntoView({ block: "center" });
    const box = $(".scroll", strip);
    box.scrollLeft = (link.getBBox().x / data.strip) * box.scrollWidth - box.clientWidth / 2;
  }

  function point(leak) {
    if (!chosen().includes(leak)) { $("#filters").reset(); $("#filters").elements.review.value = ""; state.stretch = null; }
    show(leak.id);
    const found = $(`#table tr[data-id="${leak.id}"]`);
    if (found) found.scrollIntoView({ block: "center" });
  }

  function follow() {
    const match = /^#leak-(\d+)$/.exec(location.hash);
    const leak = match && byId.get(Number(match[1]));
    if (leak) open(leak);
    else if (dialog.open) dialog.close();
  }

  // On paper there are all leaks in the table, and cards of the largest.
  function toPaper() {
    if (state.all || !tabled) return;
    Object.assign(state, { all: true });
    show();
    const largest = [...leaks].sort((a, b) => (a.review === "rejected") - (b.review === "rejected") || b.area - a.area).slice(0, data.cards);
    const order = largest.sort((a, b) => a.chainage - b.chainage || a.id - b.id);
    $("#sheets-note").textContent = order.length < leaks.length
      ? _("Largest leaks, by chainage: {count} of {all}; the HTML version of this report shows all.", { count: order.length, all: leaks.length })
      : order.length ? _("All leaks, by chainage: {count}.", { count: order.length }) : "";
    $("#sheets .cards").replaceChildren(...order.map(card));
  }
  function toScreen() {
    if (!tabled) return;
    state.all = false;
    show();
    $("#sheets .cards").replaceChildren();
  }
  async function print() {
    toPaper();
    const images = [...document.querySelectorAll("image")].map((image) => {
      const loaded = new Image();
      loaded.src = image.href.baseVal;
      return loaded.decode().catch(() => undefined);
    });
    await Promise.all(images);
    window.print();
  }

  if (tabled) {
    $("#filters").addEventListener("input", () => { state.page = 0; show(); });
    $("#filters").addEventListener("submit", (event) => event.preventDefault());
    $("#stretch").addEventListener("click", () => { state.stretch = null; show(); });
  }
  $("#print").addEventListener("click", print);
  dialog.addEventListener("close", () => {
    if (location.hash.startsWith("#leak-")) history.replaceState(null, "", location.pathname + location.search);
  });
  dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
  document.addEventListener("click", (event) => {
    // the same leak again: its hash stands there already, and no event would come
    const link = event.target.closest?.('a[href^="#leak-"]');
    if (link && link.getAttribute("href") === location.hash) follow();
    const caption = event.target.closest?.(".strip figcaption button");
    if (caption && tabled) { state.stretch = Number(caption.value); state.page = 0; show(); $("#leaks").scrollIntoView(); }
  });
  window.addEventListener("hashchange", follow);
  window.addEventListener("beforeprint", toPaper);
  window.addEventListener("afterprint", toScreen);
  if (location.hash === "#print") toPaper();
  else { show(); follow(); }
})();
