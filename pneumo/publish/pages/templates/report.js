const data = JSON.parse(document.getElementById("data").textContent);
const { models, experiments, chambers } = data;
const element = (id) => document.getElementById(id);
const KILO = 1e3;
const INK = "#1a1a1a", SOFT = "#4a4a4a", PALE = "#e6e6e6", FULL = "#b5b5b5";

// What is chosen: experiment, transport, chamber, n ("best" or its place on the grid), models, window (s) or null.
const first = models.flatMap((model, m) => (model.first ? [m] : []));
const state = { e: 0, t: data.transports.at(-1), c: 0, n: "best", models: new Set(first), window: null };
let traces = null; // of the chosen experiment and transport: t, full[chamber], errors[model][chamber][n], in s and Pa

// --- Numbers of a cell --------------------------------------------------------------------------

const experiment = () => experiments[state.e];
const cells = () => experiment().cells[state.t];
const placeOf = (m) => (state.n === "best" ? cells().best[m] : state.n); // null where the model failed at every n
const errorOf = (m, place = placeOf(m)) => (place === null ? null : traces.errors[m][state.c][models[m].has_n ? place : 0]);
const duration = () => (experiment().stored - 1) * experiment().dt;
const closeUp = () => experiment().close_up.map((i) => i * experiment().dt);

// Places of the samples on the page: some over the whole run, all that are stored in the close-up.
function placesOf({ stored, close_up: [from, to] }) {
  const places = Array.from({ length: stored }, (_, i) => i);
  return places.filter((i) => i % data.every === 0 || (i >= from && i <= to));
}

const timeOf = (i) => traces.places[i] * experiment().dt;
const within = (t, [from, to]) => t >= from - 1e-9 && t <= to + 1e-9;
const inWindow = (i) => !state.window || within(timeOf(i), state.window);

// Of those, the ones to look at: equally far apart, all inside the close-up only.
function samplesToDraw() {
  const inside = state.window?.every((t) => within(t, closeUp()));
  const looked = (i) => (inside ? within(timeOf(i), closeUp()) : traces.places[i] % data.every === 0);
  return [...traces.places.keys()].filter(looked);
}

// Of every step for the whole run; for a window from the samples that are drawn.
function meanSquare(m, place) {
  if (place === null) return null;
  if (!state.window) return cells().mse[m][place][state.c];
  const error = errorOf(m, place);
  const values = traces.shown.filter(inWindow).map((i) => error[i] ** 2);
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
  return Number.isFinite(mean) ? mean : null;
}

function bothChambers(m) {
  const found = placeOf(m) === null ? [null] : cells().mse[m][placeOf(m)];
  return found.includes(null) ? null : Math.sqrt(found.reduce((sum, value) => sum + value, 0) / found.length);
}

// --- Plots --------------------------------------------------------------------------------------

const axis = (label, more) => ({
  label, font: "12px system-ui, sans-serif", labelFont: "600 12px system-ui, sans-serif", stroke: INK, labelSize: 20,
  grid: { stroke: PALE, width: 1 }, ticks: { stroke: FULL, width: 1, size: 4 },
  values: (_, splits) => splits.map((value) => String(+value.toPrecision(10))), ...more,
});
const lines = () => models.map((model) => ({
  label: model.name, stroke: model.colour, width: 1.4, dash: model.dash.map((length) => 1.4 * length), points: { show: false },
}));
const common = { legend: { show: false }, focus: { alpha: 0.2 }, width: 300, height: 200 };
const rangeOf = (scale) => (_, low, high) => (low === null ? [0, 1] : uPlot.rangeNum(low, high, 0.06, scale));

function timePanel(id, label, series) {
  return new uPlot({
    ...common,
    series: [{}, ...series, ...lines()],
    scales: { x: { time: false }, y: { range: rangeOf(false) } },
    axes: [axis(id === "error" ? "t (s)" : "", id === "error" ? { size: 34 } : { size: 22, labelSize: 0, values: (_, splits) => splits.map(() => "") }), axis(label, { size: 48 })],
    padding: [8, 10, 0, 0],
    cursor: {
      sync: { key: "time" }, y: false, points: { size: 6 }, drag: { x: true, y: false, setScale: false },
      bind: { dblclick: () => () => choose({ window: null }) },
    },
    hooks: { setSelect: [brushed], setCursor: [(plot) => readOut(plot.cursor.idx)] },
  }, [[0], ...Array(series.length + models.length).fill([null])], element(id));
}

function brushed(plot) {
  const { left, width } = plot.select;
  if (width < 3) return;
  plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  const window = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
  queueMicrotask(() => choose({ window })); // not before the other panel, brushed along, has read its scale
}

const superscript = (number) => [...String(number)].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit] ?? "⁻").join("");
const power = (value) => {
  const exponent = Math.log10(value);
  return Math.abs(exponent - Math.round(exponent)) < 1e-6 ? `10${superscript(Math.round(exponent))}` : "";
};

function overN() {
  const room = (data.n.at(-1) - data.n[0] || 0.1) / 25;
  const plot = new uPlot({
    ...common,
    series: [{}, ...lines()],
    scales: { x: { time: false, range: [data.n[0] - room, data.n.at(-1) + room] }, y: { distr: 3 } },
    axes: [axis("n", { size: 34, space: 40 }), axis("MSE (Pa²)", { size: 42, values: (_, splits) => splits.map(power) })],
    padding: [8, 34, 0, 0],
    cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
    hooks: { draw: [drawChosen] },
  }, [data.n, ...models.map(() => data.n.map(() => null))], element("over-n"));
  plot.over.addEventListener("click", () => choose({ n: plot.cursor.idx ?? state.n }));
  return plot;
}

// Marks of the chosen n, and each model's name beside the end of its curve.
function drawChosen(plot) {
  const { ctx, bbox } = plot;
  const ratio = devicePixelRatio;
  ctx.save();
  if (state.n !== "best") {
    const x = plot.valToPos(data.n[state.n], "x", true);
    ctx.strokeStyle = SOFT;
    ctx.setLineDash([4 * ratio, 3 * ratio]);
    ctx.strokeRect(x, bbox.top, 0, bbox.height);
    ctx.setLineDash([]);
  }
  const names = [];
  for (const m of state.models) {
    const curve = plot.data[m + 1];
    const place = placeOf(m);
    if (place !== null && curve[place] !== null) {
      ctx.fillStyle = models[m].colour;
      ctx.beginPath();
      ctx.arc(plot.valToPos(data.n[place], "x", true), plot.valToPos(curve[place], "y", true), 4.5 * ratio, 0, 2 * Math.PI);
      ctx.fill();
    }
    const end = curve.findLast((value) => value !== null);
    if (end) names.push({ text: models[m].name, y: plot.valToPos(end, "y", true) });
  }
  names.sort((a, b) => a.y - b.y);
  const apart = 12 * ratio;
  names.forEach((name, i) => { if (i) name.y = Math.max(name.y, names[i - 1].y + apart); });
  const bottom = bbox.top + bbox.height;
  for (let i = names.length - 1; i >= 0; i--) names[i].y = Math.min(names[i].y, bottom - (names.length - 1 - i) * apart);
  ctx.font = `600 ${11 * ratio}px system-ui, sans-serif`;
  ctx.fillStyle = INK;
  ctx.textAlign = "left";
  ctx.textBaseline = "middle";
  for (const { text, y } of names) ctx.fillText(text, bbox.left + bbox.width + 5 * ratio, y);
  ctx.restore();
}

const plots = {
  pressure: timePanel("pressure", "pressure (kPa)", [{ label: "full order", stroke: FULL, width: 4, points: { show: false } }]),
  error: timePanel("error", "error (kPa)", [{ label: "zero", stroke: FULL, width: 1, points: { show: false } }]),
  "over-n": overN(),
};
const fit = () => {
  for (const [id, plot] of Object.entries(plots)) plot.setSize({ width: element(id).clientWidth, height: element(id).clientHeight });
};
new ResizeObserver(fit).observe(document.querySelector(".panels"));

// --- What is on the page ------------------------------------------------------------------------

const kilo = (valueOf) => traces.shown.map((i) => (Number.isFinite(valueOf(i)) ? valueOf(i) / KILO : null));

function drawTraces() {
  const { shown } = traces;
  const t = shown.map(timeOf);
  const nothing = Array(t.length).fill(null);
  const full = traces.full[state.c];
  const errors = models.map((_, m) => (state.models.has(m) ? errorOf(m) : null));
  const reduced = errors.map((error) => (error ? kilo((i) => full[i] - error[i]) : nothing));
  const [min, max] = state.window ?? [0, duration()];
  const show = (plot, rows) => plot.batch(() => {
    plot.setData([t, ...rows], false);
    plot.setScale("x", { min, max });
  });
  show(plots.pressure, [kilo((i) => full[i]), ...reduced]);
  show(plots.error, [Array(t.length).fill(0), ...errors.map((error) => (error ? kilo((i) => error[i]) : nothing))]);
}

function drawOverN() {
  const curve = (m) => data.n.map((_, place) => meanSquare(m, place) || null); // a logarithmic axis has no zero
  plots["over-n"].setData([data.n, ...models.map((_, m) => (state.models.has(m) ? curve(m) : data.n.map(() => null)))]);
}

function drawRanking() {
  const rows = models.map((_, m) => {
    const square = meanSquare(m, placeOf(m));
    return { m, rms: square === null ? null : Math.sqrt(square) };
  });
  rows.sort((a, b) => (a.rms ?? Infinity) - (b.rms ?? Infinity));
  const known = rows.map((row) => row.rms).filter((rms) => rms > 0);
  const [low, high] = known.length ? [Math.floor(Math.log10(known[0])), Math.ceil(Math.log10(known.at(-1)))] : [0, 1];
  const share = (rms) => (100 * (Math.log10(rms) - low)) / (high - low || 1);
  const digits = known[0] < 100 ? 3 : 2; // of kPa
  const number = (pascal) => (pascal === null ? "failed" : (pascal / KILO).toFixed(digits));
  element("lowest").textContent = String(+(10 ** (low - 3)).toPrecision(3));
  element("highest").textContent = String(+(10 ** (high - 3)).toPrecision(3));
  const ticks = Array.from({ length: high - low + 1 }, (_, i) => (100 * i) / (high - low || 1));
  element("ranking").replaceChildren(...rows.map(({ m, rms }) => {
    const model = models[m];
    const row = Object.assign(document.createElement("tr"), { className: state.models.has(m) ? "drawn" : "" });
    row.dataset.model = m;
    const place = placeOf(m);
    const n = model.has_n && place !== null ? data.n[place].toFixed(2) : "–";
    const grid = ticks.map((x) => `<line x1="${x}%" x2="${x}%" y1="-4" y2="20" stroke="${PALE}"/>`).join("");
    const dot = rms > 0 ? `<circle cx="${share(rms)}%" cy="8" r="4.5" fill="${model.colour}"/>` : "";
    row.innerHTML = `<th scope="row"></th><td class="right">${n}</td><td><svg aria-hidden="true">${grid}<line x1="0" x2="100%" y1="8" y2="8" stroke="${PALE}"/>${dot}</svg></td>`
      + `<td class="right">${number(rms)}</td><td class="right">${number(bothChambers(m))}</td><td class="right here"></td>`;
    row.cells[0].textContent = model.name;
    row.addEventListener("pointerenter", () => highlight(m));
    row.addEventListener("pointerleave", () => highlight(null));
    return row;
  }));
}

// Errors where the pointer is, beside the models' names.
function readOut(index) {
  for (const row of element("ranking").rows) {
    const value = index === null || index === undefined || !traces ? NaN : errorOf(+row.dataset.model)?.[traces.shown[index]];
    row.querySelector(".here").textContent = Number.isFinite(value) ? (value / KILO).toFixed(2) : "";
  }
}

function highlight(m) {
  for (const [id, plot] of Object.entries(plots)) {
    const shift = id === "over-n" ? 1 : 2;
    plot.setSeries(m === null || !state.models.has(m) ? null : m + shift, { focus: true });
  }
}

const seconds = (t) => String(+t.toPrecision(6));

function describe() {
  const { name, text, failed } = experiment();
  const chamber = chambers[state.c];
  const when = state.window ? `t = ${state.window.map(seconds).join(" to ")} s` : "whole run";
  element("about").textContent = `${name}: ${text}${failed ? `; ${failed}` : ""}`;
  element("pressure-head").textContent = `Pressure in chamber ${chamber}: full order (broad, grey) and reduced models`;
  element("error-head").textContent = `Error in chamber ${chamber}: full order minus reduced`;
  element("over-n-head").textContent = `MSE over n, chamber ${chamber}, ${when}`;
  element("ranking-head").textContent = `RMS error, chamber ${chamber}, ${when}`;
  const { dt } = experiment();
  const { shown } = traces;
  const apart = `one every ${seconds((traces.places[shown[1]] - traces.places[shown[0]]) * dt)} s`;
  element("sampling").textContent = state.window
    ? `From the ${shown.filter(inWindow).length} samples drawn, ${apart}. “A, B”: both chambers, whole run, every step.`
    : `From every step of the run. “A, B”: both chambers together, as the paper averages. Drawn: ${apart}.`;
  element("close-up").textContent = `Close-up at ${closeUp().map(seconds).join(" to ")} s`;
  for (const id of ["from", "to"]) element(id).max = duration();
  [element("from").value, element("to").value] = (state.window ?? [0, duration()]).map(seconds);
  element("experiment").value = state.e;
  element("n").value = state.n;
  for (const input of document.querySelectorAll("[name=transport]")) input.checked = input.value === state.t;
  for (const input of document.querySelectorAll("[name=chamber]")) input.checked = +input.value === state.c;
  for (const button of element("models").children) button.setAttribute("aria-pressed", String(state.models.has(+button.value)));
}

let turn = 0;
async function draw(reload) {
  const mine = ++turn;
  if (reload) {
    const { e } = state;
    const { step } = experiment();
    const places = placesOf(experiment());
    const steps = cells().steps;
    const groups = models.flatMap((model, m) => chambers.map((_, c) =>
      ({ rows: model.has_n ? data.n.length : 1, step: steps[m * chambers.length + c] })));
    const [full, errors] = await Promise.all([
      unpacked(`full-${e}`, chambers.map(() => ({ rows: 1, step })), places.length),
      unpacked(`${state.t}-${e}`, groups, places.length),
    ]);
    if (mine !== turn) return; // something else was chosen meanwhile
    traces = { places, full: full.map(([row]) => row), errors: models.map((_, m) => chambers.map((_, c) => errors[m * chambers.length + c])) };
  }
  traces.shown = samplesToDraw();
  describe();
  drawTraces();
  drawOverN();
  drawRanking();
  document.body.dataset.drawn = address(); // for tests: what is on the page
}
