"use strict";
const items = [...document.querySelectorAll(".item")];
const groups = [...document.querySelectorAll(".group")];
const grids = [...document.querySelectorAll(".grid")];
const boxes = [...document.querySelectorAll("input[name=status]")];
const tiles = [...document.querySelectorAll(".tile")];
const part = document.getElementById("part");
const search = document.getElementById("search");
const falls = document.getElementById("falls");
// Words of an item itself, not of items that it links to; "table" with its number is one word, and a number ends where its digits end.
const normal = (text) => text.toLowerCase().replace(/\s+/g, " ").replace(/\b(tables?|figs?\.?|sections?) (\d+)/g, "$1_$2");
const words = new Map(items.map((item) => [item, ` ${normal(item.dataset.words)} `]));
const pattern = (word) => new RegExp(`[^\\p{L}\\d_]${word.replace(/[^\p{L}\d_]/gu, "\\$&")}${/\d$/.test(word) ? "(?![\\d.]*\\d)" : ""}`, "u");
const initially = new Map(groups.map((group) => [group, group.open]));

function filter() {
  const statuses = new Set(boxes.filter((box) => box.checked).map((box) => box.value));
  const wanted = normal(search.value.trim()).split(" ").filter(Boolean).map(pattern);
  const everything = statuses.size === boxes.length && !wanted.length && !part.value && !falls.checked;
  const shown = new Set();
  for (const item of items) {
    const fits = statuses.has(item.dataset.status)
      && (!part.value || item.parentElement.dataset.part === part.value)
      && (!falls.checked || item.dataset.falls === "1")
      && wanted.every((word) => word.test(words.get(item)));
    item.hidden = !fits;
    if (fits) shown.add(item.id);
  }
  for (const group of groups) {
    group.hidden = !group.querySelector(".item:not([hidden])");
    group.open = everything ? initially.get(group) : !group.hidden;
  }
  for (const grid of grids) {
    const cells = [...grid.querySelectorAll("td[data-id]")];
    for (const cell of cells) cell.classList.toggle("off", !shown.has(cell.dataset.id));
    grid.hidden = !cells.some((cell) => shown.has(cell.dataset.id));
  }
  const only = statuses.size === 1 ? [...statuses][0] : null;
  for (const tile of tiles) tile.setAttribute("aria-pressed", String(tile.dataset.status === only));
  document.getElementById("shown").textContent = `${shown.size} of ${items.length} items`;
  document.getElementById("none").hidden = shown.size > 0;
}

function reset() {
  for (const box of boxes) box.checked = true;
  part.value = search.value = "";
  falls.checked = false;
  filter();
}

// A link to an item opens it, even where a filter hid it.
function visit() {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  if (target.closest("[hidden]")) reset();
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
  target.scrollIntoView({ block: "start" });
  if (target.classList.contains("item")) target.querySelector("summary").focus({ preventScroll: true });
}

for (const tile of tiles) {
  tile.addEventListener("click", () => {
    const only = tile.getAttribute("aria-pressed") !== "true";
    for (const box of boxes) box.checked = !only || box.value === tile.dataset.status;
    filter();
  });
}
for (const control of [...boxes, part, falls]) control.addEventListener("change", filter);
search.addEventListener("input", filter);
document.getElementById("reset").addEventListener("click", reset);
window.addEventListener("hashchange", visit);
document.addEventListener("click", (event) => {
  const link = event.target.closest("a[href^='#']");
  if (link && link.hash === location.hash) visit();
});
window.addEventListener("load", () => setTimeout(visit)); // after the browser has gone to the anchor by itself
filter(); // a browser may have kept the form's values over a reload
