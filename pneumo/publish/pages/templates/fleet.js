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
