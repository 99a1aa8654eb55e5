"use strict";
const STEP = 200; // rows that are drawn at once
const element = (id) => document.getElementById(id);
const rows = JSON.parse(element("data").textContent);
const heads = [...document.querySelectorAll("#fleet thead th")];
const names = heads.map((head) => head.textContent);
const body = document.querySelector("#fleet tbody");
const controls = ["search", "recommended", "column", "low", "high"].map(element);
const [search, recommended, column, low, high] = controls;
const order = new Intl.Collator("en", { numeric: true });
let sorted = { column: 0, sign: 1 };
let limit = STEP;

function fits(row) {
  const value = column.value ? row[names.indexOf(column.value)] : 0;
  return row[0].toLowerCase().includes(search.value.trim().toLowerCase())
    && (!recommended.value || row[names.indexOf("recommended")] === recommended.value)
    && (!column.value || (low.value === "" && high.value === "") || value !== null)
    && (!column.value || low.value === "" || value >= Number(low.value))
    && (!column.value || high.value === "" || value <= Number(high.value));
}

// What has no value stands last, however the rest is sorted.
function compare(a, b) {
  const [x, y] = [a[sorted.column], b[sorted.column]];
  const [none, other] = [x === null || x === "", y === null || y === ""];
  if (none || other) return none - other;
  return sorted.sign * (typeof x === "string" ? order.compare(x, y) : x - y);
}

function draw() {
  const found = rows.filter(fits).sort(compare);
  body.replaceChildren(...found.slice(0, limit).map((row) => {
    const line = document.createElement("tr");
    for (const value of row) line.append(Object.assign(document.createElement("td"), { textContent: value ?? "–" }));
    return line;
  }));
  heads.forEach((head, i) => {
    if (i === sorted.column) head.setAttribute("aria-sort", sorted.sign > 0 ? "ascending" : "descending");
    else head.removeAttribute("aria-sort");
  });
  element("shown").textContent = `${found.length} of ${rows.length} cylinders`;
  element("more").hidden = found.length <= limit;
  scatter(found);
}

const colours = JSON.parse(element("colours").textContent);
const night = matchMedia("(prefers-color-scheme: dark)");
const MARGIN = { left: 64, right: 12, top: 12, bottom: 44 };
const SIZES = [1, 2, 5].flatMap((digit) => [1, 10, 100, 1000].map((power) => digit * power)); // mm
const colour = (model) => (colours[model] ?? ["#767676", "#9a9a9a"])[night.matches ? 1 : 0];

// Values that a logarithmic axis spans, and the function from a value to a pixel.
function axis(column, from, to) {
  const values = rows.map((row) => row[names.indexOf(column)]).filter((value) => value > 0);
  const [low, high] = [Math.min(...values) / 1.1, Math.max(...values) * 1.1];
  const place = (value) => from + ((to - from) * Math.log(value / low)) / Math.log(high / low);
  return { place, ticks: SIZES.filter((value) => value >= low && value <= high) };
}

function scatter(found) {
  const canvas = element("scatter");
  const { clientWidth: width, clientHeight: height } = canvas;
  const scale = devicePixelRatio || 1;
  [canvas.width, canvas.height] = [width * scale, height * scale];
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale);
  const style = getComputedStyle(document.body);
  const x = axis("bore (mm)", MARGIN.left, width - MARGIN.right);
  const y = axis("stroke (mm)", height - MARGIN.bottom, MARGIN.top);
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = style.color;
  pen.strokeStyle = "#80808060";
  pen.textAlign = "center";
  for (const tick of x.ticks) {
    pen.strokeRect(x.place(tick), MARGIN.top, 0, height - MARGIN.top - MARGIN.bottom);
    pen.fillText(tick, x.place(tick), height - MARGIN.bottom + 16);
  }
  pen.fillText("bore (mm)", (MARGIN.left + width) / 2, height - 6);
  pen.textAlign = "right";
  for (const tick of y.ticks) {
    pen.strokeRect(MARGIN.left, y.place(tick), width - MARGIN.left - MARGIN.right, 0);
    pen.fillText(tick, MARGIN.left - 6, y.place(tick) + 4);
  }
  pen.save();
  pen.translate(14, height / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = "center";
  pen.fillText("stroke (mm)", 0, 0);
  pen.restore();
  const [bore, stroke, model] = ["bore (mm)", "stroke (mm)", "recommended"].map((head) => names.indexOf(head));
  found.forEach((row, i) => {
    const turn = 2.4 * i; // golden angle: no two neighbours are moved alike
    const radius = found.length > 1 ? 3 * ((i % 7) / 6) : 0;
    pen.fillStyle = colour(row[model]);
    pen.beginPath();
    pen.arc(x.place(row[bore]) + radius * Math.cos(turn), y.place(row[stroke]) + radius * Math.sin(turn), 4, 0, 7);
    pen.fill();
  });
  element("key").replaceChildren(...[...new Set(rows.map((row) => row[model]))].sort(order.compare).map((name) => {
    const [entry, dot] = [document.createElement("span"), document.createElement("i")];
    dot.style.background = colour(name);
    entry.append(dot, name || "none");
    return entry;
  }));
}

function again() {
  limit = STEP;
  draw();
}

heads.forEach((head, i) => head.firstElementChild.addEventListener("click", () => {
  sorted = { column: i, sign: sorted.column === i ? -sorted.sign : 1 };
  again();
}));
for (const control of controls) control.addEventListener("input", again);
element("more").addEventListener("click", () => {
  limit += STEP;
  draw();
});
element("reset").addEventListener("click", () => {
  for (const control of controls) control.value = "";
  again();
});
draw(); // a browser may have kept the filters over a reload
for (const event of ["resize", "load"]) addEventListener(event, draw);
night.addEventListener("change", draw);
