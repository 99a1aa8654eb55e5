// --- What is chosen, by pointer, keyboard and address --------------------------------------------

function address() {
  const chosen = new URLSearchParams({
    e: experiment().name, t: state.t, c: chambers[state.c], n: state.n === "best" ? "best" : data.n[data.common],
    m: [...state.models].sort((a, b) => a - b).map((m) => models[m].name).join(" "),
  });
  chosen.set("w", state.window ? state.window.map(seconds).join(" ") : "all");
  return `#${chosen}`;
}

// Whatever the address names and the study has; the rest stays.
function read() {
  const chosen = new URLSearchParams(location.hash.slice(1));
  const e = experiments.findIndex(({ name }) => name === chosen.get("e"));
  const c = chambers.indexOf(chosen.get("c"));
  const n = { best: "best", [data.n[data.common]]: "common" }[chosen.get("n")];
  const window = (chosen.get("w") ?? "").split(" ").map(Number);
  const close = window.length !== 2 || window.some(Number.isNaN); // a run opens at its close-up
  return {
    ...(e >= 0 && { e }),
    ...(data.transports.includes(chosen.get("t")) && { t: chosen.get("t") }),
    ...(c >= 0 && { c }),
    ...(n && { n }),
    ...(chosen.has("m") && { models: new Set(models.flatMap(({ name }, m) => (chosen.get("m").split(" ").includes(name) ? [m] : []))) }),
    window: chosen.get("w") === "all" ? null : close ? closeUp(experiments[e >= 0 ? e : state.e]) : window,
  };
}

// Take a choice over, with a window from one interval's edge to another's.
function choose(change) {
  const reload = traces === null || (change.e ?? state.e) !== state.e || (change.t ?? state.t) !== state.t;
  if ("e" in change && change.e !== state.e && !("window" in change)) change.window = state.window && closeUp(experiments[change.e]);
  Object.assign(state, change);
  if (state.window) {
    const edges = edgesOf(experiment());
    const nearest = (t) => edges.reduce((best, edge, i) => (Math.abs(edge - t) < Math.abs(edges[best] - t) ? i : best), 0);
    const length = Math.min(Math.max(state.window[1] - state.window[0], 0), duration());
    const start = Math.min(Math.max(state.window[0], 0), duration() - length);
    const from = Math.min(nearest(start), edges.length - 2);
    const to = Math.max(nearest(start + length), from + 1);
    state.window = from === 0 && to === edges.length - 1 ? null : [edges[from], edges[to]];
  }
  history.replaceState(null, "", address());
  return draw(reload).catch((error) => {
    element("trouble").textContent = `The traces cannot be drawn: ${error.message}. The browser may be too old.`;
    element("trouble").hidden = false;
  });
}

const toggled = (m) => {
  const chosen = new Set(state.models);
  if (!chosen.delete(m)) chosen.add(m);
  return { models: chosen };
};
const around = (list, value, by) => list[(list.indexOf(value) + by + list.length) % list.length];

// A window stretched by a factor, or moved by a fraction of its length.
function reframe({ factor = 1, by = 0 }) {
  const [from, to] = state.window ?? [0, duration()];
  const [middle, half] = [(from + to) / 2 + by * (to - from), ((to - from) / 2) * factor];
  choose({ window: [middle - half, middle + half] });
}
const KEYS = {
  ArrowLeft: () => choose({ e: around([...experiments.keys()], state.e, -1) }),
  ArrowRight: () => choose({ e: around([...experiments.keys()], state.e, 1) }),
  n: () => choose({ n: state.n === "best" ? "common" : "best" }),
  t: () => choose({ t: around(data.transports, state.t, 1) }),
  c: () => choose({ c: around([...chambers.keys()], state.c, 1) }),
  "+": () => reframe({ factor: 0.5 }),
  "-": () => reframe({ factor: 2 }),
  ",": () => reframe({ by: -0.5 }),
  ".": () => reframe({ by: 0.5 }),
  z: () => choose({ window: closeUp() }),
  Escape: () => choose({ window: null }),
  "?": () => element("help").showModal(),
};
for (let digit = 0; digit < Math.min(models.length, 10); digit++) KEYS[(digit + 1) % 10] = () => choose(toggled(digit));

document.addEventListener("keydown", (event) => {
  const { target, key } = event;
  if (event.ctrlKey || event.metaKey || event.altKey || !(key in KEYS) || target.closest("dialog")) return;
  // Fields and lists keep the keys that they know themselves.
  if (target.closest("select, input") && key !== "Escape" && !(target.type === "radio" && !key.startsWith("Arrow"))) return;
  event.preventDefault();
  KEYS[key]();
});

function button(model, m) {
  const looks = { type: "button", className: "model", value: m, title: `${model.name}: ${model.text}` };
  const made = Object.assign(document.createElement("button"), looks);
  const dash = model.dash.map((length) => 1.6 * length).join(" ");
  made.innerHTML = `${m < 10 ? `<kbd>${(m + 1) % 10}</kbd>` : ""}<svg width="30" height="8" aria-hidden="true"><line x1="0" x2="30" y1="4" y2="4" stroke-width="2.4" stroke-dasharray="${dash}"/></svg>`;
  made.append(model.name);
  made.addEventListener("click", () => choose(toggled(m)));
  for (const event of ["pointerenter", "focus"]) made.addEventListener(event, () => highlight(m));
  for (const event of ["pointerleave", "blur"]) made.addEventListener(event, () => highlight(null));
  return made;
}

function paintButtons() {
  for (const made of element("models").children) made.querySelector("line").setAttribute("stroke", colourOf(+made.value));
}

element("models").append(...models.map(button));
paintButtons();
element("experiment").append(...experiments.map(({ name, text }, e) => new Option(`${name}: ${text.replace(/ \(.*?\)|, [^,]*$/g, "")}`, e)));
element("n").append(new Option("each model's best in this run", "best"), new Option(`${data.n[data.common].toFixed(2)} for all models`, "common"));
element("experiment").addEventListener("change", (event) => choose({ e: +event.target.value }));
element("n").addEventListener("change", (event) => choose({ n: event.target.value }));
element("transport").addEventListener("change", (event) => choose({ t: event.target.value }));
element("chamber").addEventListener("change", (event) => choose({ c: +event.target.value }));
for (const id of ["from", "to"]) element(id).addEventListener("change", () => choose({ window: [+element("from").value, +element("to").value] }));
element("close-up").addEventListener("click", () => choose({ window: closeUp() }));
element("whole").addEventListener("click", () => choose({ window: null }));
element("keys").addEventListener("click", () => element("help").showModal());
addEventListener("hashchange", () => {
  if (location.hash.includes("=")) choose(read()); // else a place on the page
});
choose(read());
