const data = JSON.parse(document.getElementById("data").textContent);
const { models, experiments, chambers } = data;
const element = (id) => document.getElementById(id);
const KILO = 1e3, MILLI = 1e-3;
const MOST_SAMPLES = 1500; // of a trace drawn one by one; a longer window shows limits of intervals
const scheme = matchMedia("(prefers-color-scheme: dark)");
const LOOKS = {
  light: { ink: "#1a1a1a", soft: "#4a4a4a", pale: "#e6e6e6", full: "#a8a8a8" },
  dark: { ink: "#e8e6e1", soft: "#b9b6b0", pale: "#333333", full: "#8d8d8d" },
};
const look = () => LOOKS[scheme.matches ? "dark" : "light"];
const colourOf = (m) => (scheme.matches ? models[m].on_dark : models[m].colour);

// What is chosen: experiment, transport, chamber, n ("best" or "common"), models, window (s) or null for the whole run.
const first = models.flatMap((model, m) => (model.first ? [m] : []));
const state = { e: data.opening, t: data.transports.at(-1), c: 0, n: "best", models: new Set(first), window: null };
let traces = null; // of the chosen experiment and transport, from `draw`

// --- Numbers of a cell --------------------------------------------------------------------------

const experiment = () => experiments[state.e];
const cells = () => experiment().cells[state.t];
const placeOf = (m) => (state.n === "best" ? cells().best[m] : data.common); // null where the model failed at every n
const rowsOf = (m) => (models[m].has_n && cells().best[m] !== data.common ? 2 : 1); // a row for each different n
const rowOf = (m) => (state.n === "best" ? 0 : rowsOf(m) - 1);
const edgesOf = ({ edges, h }) => edges.map((step) => step * h);
const duration = () => edgesOf(experiment()).at(-1);
const closeUp = ({ close_up, h } = experiment()) => close_up.map((step) => step * h);

// Times of the samples on the page: equally far apart, and finer in the close-up.
function timesOf({ edges, stride, finer, close_up: [from, to], h }) {
  const steps = [];
  for (let step = 0; step <= edges.at(-1);) {
    steps.push(step);
    const dense = step >= from && step < to;
    step = Math.min(...[Math.floor(step / stride) * stride + stride, ...(dense ? [step + finer] : [])]);
  }
  return steps.map((step) => step * h);
}

// Intervals of the window: the first, and the one after the last.
function intervals() {
  const edges = edgesOf(experiment());
  if (!state.window) return [0, edges.length - 1];
  return state.window.map((t) => edges.findIndex((edge) => edge >= t - 1e-9));
}

// Of every step: of the whole run as computed, of a window as the mean of its intervals.
function meanSquare(m, c = state.c) {
  const place = placeOf(m);
  if (place === null) return null;
  if (!state.window) return cells().mse[m][place][c];
  const { edges } = experiment(), [from, to] = intervals(), squares = traces.squares[m][c][rowOf(m)];
  let [sum, count] = [0, 0];
  for (let i = from; i < to; i++) {
    const steps = edges[i + 1] - edges[i] + (i === edges.length - 2); // the run's last step too
    sum += steps * 2 ** squares[i];
    count += steps;
  }
  return Number.isFinite(sum) ? sum / count : null;
}

function bothChambers(m) {
  const squares = chambers.map((_, c) => meanSquare(m, c));
  return squares.includes(null) ? null : Math.sqrt(squares.reduce((sum, value) => sum + value, 0) / squares.length);
}

// --- Plots --------------------------------------------------------------------------------------

const axis = (label, more) => ({
  label, font: "12px system-ui, sans-serif", labelFont: "600 12px system-ui, sans-serif", stroke: () => look().ink, labelSize: 20,
  grid: { stroke: () => look().pale, width: 1 }, ticks: { stroke: () => look().full, width: 1, size: 4 },
  values: (_, splits) => splits.map((value) => String(+value.toPrecision(10))), ...more,
});
const lines = () => models.map((model, m) => ({
  label: model.name, stroke: () => colourOf(m), width: 1.5, dash: model.dash.map((length) => 1.4 * length), points: { show: false },
}));
const common = { legend: { show: false }, focus: { alpha: 0.2 }, width: 300, height: 200 };
const rangeOf = (scale) => (_, low, high) => (low === null ? [0, 1] : uPlot.rangeNum(low, high, 0.06, scale));

const grey = (label, width) => ({ label, stroke: () => look().full, width, points: { show: false } });

function timePanel(id, label, first, others) {
  const series = [first, ...others], last = id === "error";
  return new uPlot({
    ...common,
    series: [{}, ...series],
    scales: { x: { time: false }, y: { range: rangeOf(false) } },
    axes: [
      axis(last ? "t (s)" : "", last ? { size: 34 } : { size: 8, labelSize: 0, values: (_, splits) => splits.map(() => "") }),
      axis(label, { size: 48, space: ["u", "x"].includes(id) ? 16 : 30 }),
    ],
    padding: [6, 10, 0, 0],
    cursor: {
      sync: { key: "time" }, y: false, points: { size: 6 }, drag: { x: true, y: false, setScale: false },
      bind: { dblclick: () => () => choose({ window: null }) },
    },
    hooks: { setSelect: [brushed], setCursor: [(plot) => readOut(plot.cursor.idx)] },
  }, [[0], ...series.map(() => [null])], element(id));
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
    padding: [8, 82, 0, 0],
    cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
    hooks: { draw: [drawChosen] },
  }, [data.n, ...models.map(() => data.n.map(() => null))], element("over-n"));
  return plot;
}

// Marks of the chosen n, and each model's name beside the end of its curve.
function drawChosen(plot) {
  const { ctx, bbox } = plot;
  const ratio = devicePixelRatio;
  ctx.save();
  if (state.n !== "best") {
    const x = plot.valToPos(data.n[data.common], "x", true);
    ctx.strokeStyle = look().soft;
    ctx.setLineDash([4 * ratio, 3 * ratio]);
    ctx.strokeRect(x, bbox.top, 0, bbox.height);
    ctx.setLineDash([]);
  }
  const names = [];
  for (const m of state.models) {
    const curve = plot.data[m + 1];
    const place = placeOf(m);
    if (models[m].has_n && place !== null && curve[place] !== null) {
      ctx.fillStyle = colourOf(m);
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
  ctx.fillStyle = look().ink;
  ctx.textAlign = "left";
  ctx.textBaseline = "middle";
  for (const { text, y } of names) ctx.fillText(text, bbox.left + bbox.width + 5 * ratio, y);
  ctx.restore();
}

const plots = {
  u: timePanel("u", "u (V)", grey("u", 1.5), []),
  x: timePanel("x", "x (mm)", grey("x", 1.5), []),
  pressure: timePanel("pressure", "P (kPa)", grey("full order", 4), lines()),
  error: timePanel("error", "error (kPa)", grey("zero", 1), lines()),
  "over-n": overN(),
};
const fit = () => {
  for (const [id, plot] of Object.entries(plots)) plot.setSize({ width: element(id).clientWidth, height: element(id).clientHeight });
};
new ResizeObserver(fit).observe(document.querySelector(".panels"));
scheme.addEventListener("change", () => {
  for (const plot of Object.values(plots)) plot.redraw();
  paintButtons();
  drawRanking();
});

// --- What is on the page ------------------------------------------------------------------------

// Whether a window is drawn sample by sample; a longer one by the lowest and highest value of every step in each interval.
function near() {
  const [from, to] = state.window ?? [0, duration()];
  return traces.t.filter((t) => t >= from - 1e-9 && t <= to + 1e-9).length <= MOST_SAMPLES;
}

const scaled = (values, unit) => Array.from(values, (value) => (Number.isFinite(value) ? value / unit : null));
const zigzag = ([low, high], unit) => scaled(low, unit).flatMap((value, i) => [value, Number.isFinite(high[i]) ? high[i] / unit : null]);

function drawTraces() {
  const samples = near(), edges = edgesOf(experiment());
  const t = samples ? traces.t : edges.slice(1).flatMap((end, i) => [0.25, 0.75].map((part) => edges[i] + part * (end - edges[i])));
  const curve = (of, limits, unit) => (samples ? scaled(of, unit) : zigzag(limits, unit));
  const signal = (place, unit) => curve(traces.signals[place], traces.signalLimits[place], unit);
  const nothing = Array(t.length).fill(null);
  const full = traces.signals[2 + state.c];
  const shown = models.map((_, m) => (state.models.has(m) && placeOf(m) !== null ? { error: traces.errors[m][state.c][rowOf(m)], limits: traces.limits[m][state.c][rowOf(m)] } : null));
  const reduced = shown.map((one) => (one && samples ? scaled(one.error.map((error, i) => full[i] - error), KILO) : nothing));
  const errors = shown.map((one) => (one ? curve(one.error, one.limits, KILO) : nothing));
  const [min, max] = state.window ?? [0, duration()];
  const show = (plot, ...rows) => plot.batch(() => {
    plot.setData([t, ...rows], false);
    plot.setScale("x", { min, max });
  });
  show(plots.u, signal(0, 1));
  show(plots.x, signal(1, MILLI));
  show(plots.pressure, signal(2 + state.c, KILO), ...reduced);
  show(plots.error, Array(t.length).fill(0), ...errors);
}

function drawOverN() {
  const curve = (m) => data.n.map((_, place) => cells().mse[m][place][state.c] || null); // a logarithmic axis has no zero
  plots["over-n"].setData([data.n, ...models.map((_, m) => (state.models.has(m) ? curve(m) : data.n.map(() => null)))]);
}

function drawRanking() {
  const rows = models.map((_, m) => {
    const square = meanSquare(m);
    return { m, rms: square === null ? null : Math.sqrt(square) };
  });
  rows.sort((a, b) => (a.rms ?? Infinity) - (b.rms ?? Infinity));
  const known = rows.map((row) => row.rms).filter((rms) => rms > 0);
  const [low, high] = known.length ? [Math.floor(Math.log10(known[0])), Math.ceil(Math.log10(known.at(-1)))] : [0, 1];
  const along = (rms) => (100 * (Math.log10(rms) - low)) / (high - low || 1);
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
    const grid = ticks.map((x) => `<line x1="${x}%" x2="${x}%" y1="-4" y2="20" stroke="${look().pale}"/>`).join("");
    const dot = rms > 0 ? `<circle cx="${along(rms)}%" cy="8" r="4.5" fill="${colourOf(m)}"/>` : "";
    row.innerHTML = `<th scope="row"></th><td class="right">${n}</td><td><svg aria-hidden="true">${grid}<line x1="0" x2="100%" y1="8" y2="8" stroke="${look().pale}"/>${dot}</svg></td>`
      + `<td class="right">${number(rms)}</td><td class="right">${number(bothChambers(m))}</td><td class="right here"></td>`;
    row.cells[0].textContent = model.name;
    row.addEventListener("pointerenter", () => highlight(m));
    row.addEventListener("pointerleave", () => highlight(null));
    return row;
  }));
}

// Errors where the pointer is, beside the models' names; limits of an interval have no single error.
function readOut(index) {
  const known = index !== null && index !== undefined && traces !== null && near();
  for (const row of element("ranking").rows) {
    const m = +row.dataset.model;
    const value = known && placeOf(m) !== null ? traces.errors[m][state.c][rowOf(m)][index] : NaN;
    row.querySelector(".here").textContent = Number.isFinite(value) ? (value / KILO).toFixed(2) : "";
  }
}

function highlight(m) {
  for (const id of ["pressure", "error", "over-n"]) {
    const shift = id === "over-n" ? 1 : 2;
    plots[id].setSeries(m === null || !state.models.has(m) ? null : m + shift, { focus: true });
  }
}

const seconds = (t) => String(+t.toPrecision(6));

function describe() {
  const { name, text, failed } = experiment();
  const chamber = chambers[state.c], samples = near();
  const when = state.window ? `t = ${state.window.map(seconds).join(" to ")} s` : "whole run";
  element("about").textContent = `${name}: ${text}${failed ? `; ${failed}` : ""}`;
  element("pressure-head").textContent = `Pressure in chamber ${chamber}: full order (grey)${samples ? " and models" : "; a shorter window shows the models too"}`;
  element("error-head").textContent = `Error of the models in chamber ${chamber}: full order minus model`;
  element("over-n-head").textContent = `Mean square error over n, chamber ${chamber}, whole run`;
  element("ranking-head").textContent = `RMS error over all steps, kPa, ${when}`;
  element("of-chamber").textContent = `chamber ${chamber}`;
  const inside = traces.t.filter((t) => !state.window || (t >= state.window[0] - 1e-9 && t <= state.window[1] + 1e-9));
  element("sampling").textContent = samples
    ? `Drawn: ${inside.length} samples, ${seconds(1e3 * (inside[1] - inside[0]))} ms apart.`
    : `Drawn: the lowest and the highest value of every step in intervals of ${seconds(edgesOf(experiment())[1])} s. Shorter windows show samples.`;
  element("close-up").textContent = `Close-up: ${closeUp().map(seconds).join(" to ")} s`;
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
    const { e, t } = state, { steps, edges } = experiment();
    const times = timesOf(experiment()), spans = edges.length - 1;
    const groups = (rowsOfModel, step) => models.flatMap((_, m) => chambers.map((_, c) => ({ rows: rowsOfModel(m), step: step(m * chambers.length + c) })));
    const stepOf = (place) => cells().steps[place];
    const [signals, signalLimits, errors, limits, squares] = await Promise.all([
      unpacked(`signals-${e}`, steps.map((step) => ({ rows: 1, step })), times.length),
      unpacked(`signal-limits-${e}`, steps.map((step) => ({ rows: 2, step })), spans),
      unpacked(`${t}-errors-${e}`, groups(rowsOf, stepOf), times.length),
      unpacked(`${t}-limits-${e}`, groups((m) => 2 * rowsOf(m), stepOf), spans),
      unpacked(`${t}-squares-${e}`, groups(rowsOf, () => 1 / data.per_octave), spans),
    ]);
    if (mine !== turn) return; // something else was chosen meanwhile
    const byModel = (list) => models.map((_, m) => chambers.map((_, c) => list[m * chambers.length + c]));
    const pairs = (rows) => rows.flatMap((row, i) => (i % 2 ? [[rows[i - 1], row]] : []));
    traces = { t: times, signals: signals.map(([row]) => row), signalLimits, errors: byModel(errors), limits: byModel(limits.map(pairs)), squares: byModel(squares) };
  }
  describe();
  drawTraces();
  drawOverN();
  drawRanking();
  document.body.dataset.drawn = address(); // for tests: what is on the page
}
