const live = (() => {
  const names = Object.keys(layout.parameters), models = names.slice(0, -2), full = models.length;
  const rows = [...models, "full order"]; // of a replayed record
  const code = new WebAssembly.Instance(new WebAssembly.Module(bytes)).exports;
  const at = (place, count) => new Float64Array(code.memory.buffer, place, count);
  const state = at(code.place_of_state(), 6), commands = at(code.place_of_commands(), layout.most_steps);
  const pressures = at(code.place_of_pressures(), 2 * models.length);
  const squares = at(code.place_of_squares(), 2 * models.length);
  const record = at(code.place_of_record(), 3 * (layout.most_steps + 1));
  const replayed = at(code.place_of_replayed(), 2 * rows.length * layout.most_steps);
  const H = 1e-3; // s
  let steps = 0;

  // Set a number of the plant, by the paper's name, in every model that has it.
  const set = (name, value) => names.forEach((model, i) => {
    const place = layout.parameters[model].indexOf(name);
    if (place >= 0) at(code.place_of_parameters(i), layout.parameters[model].length)[place] = value;
  });
  const get = (name) => at(code.place_of_parameters(full), 99)[layout.parameters.full.indexOf(name)];
  const start = () => { steps = 0; code.start(); };
  const advance = (given) => {
    for (let k = 0; k < given.length; k += commands.length) {
      const part = given.slice(k, k + commands.length);
      commands.set(part);
      if (code.advance(part.length, H)) return false;
      steps += part.length;
    }
    return true;
  };
  // Pressures by the rows whose bit is set, a pair of arrays for each, at every sample of a record {h, u, x, v}.
  const replay = ({h, u, x, v}, wanted) => {
    const most = layout.most_steps, length = u.length, P_0 = get("P_0");
    const result = rows.map(() => [0, 1].map(() => new Float64Array(length).fill(P_0)));
    code.start_record();
    for (let first = 0; first < length - 1; first += most) {
      const steps = Math.min(most, length - 1 - first);
      [u, x, v].forEach((signal, s) => record.set(signal.subarray(first, first + steps + 1), s * (most + 1)));
      code.replay_record(steps, h, wanted);
      result.forEach((pair, row) => pair.forEach((P, side) => {
        const from = (2 * row + side) * most;
        if (wanted >> row & 1) P.set(replayed.subarray(from, from + steps), first + 1);
      }));
    }
    return result;
  };
  code.take_defaults();
  start();
  return {layout, models, rows, state, pressures, squares, set, get, start, advance, replay, H, steps: () => steps};
})();

// Text of a CSV file -> signals {h, u, x, v, P_A, P_B}; an error says what is wrong in one line.
const readRecord = (text) => {
  const lines = text.replace(/^\ufeff/, "").split(/\r?\n/).filter((line) => line.trim() && !line.startsWith("#"));
  const separator = [";", "\t", ","].find((mark) => (lines[0] ?? "").includes(mark)) ?? ",";
  const heads = (lines[0] ?? "").split(separator).map((head) => head.trim().replace(/^"|"$/g, ""));
  const missing = ["t", "u", "x", "P_A", "P_B"].filter((name) => !heads.includes(name));
  if (missing.length) throw new Error(`column ${missing.join(", ")} is missing; the first row must name t, u, x, P_A and P_B`);
  if (lines.length < 4) throw new Error("fewer than three samples");
  const column = (name) => Float64Array.from(lines.slice(1), (line, i) => {
    const cell = (line.split(separator)[heads.indexOf(name)] ?? "").trim();
    const value = Number(separator === ";" ? cell.replace(",", ".") : cell);
    if (!cell || !Number.isFinite(value)) throw new Error(`row ${i + 2}, column ${name}: ${cell || "nothing"} is not a number`);
    return value;
  });
  const [t, u, x, P_A, P_B] = ["t", "u", "x", "P_A", "P_B"].map(column), last = t.length - 1;
  const h = (t[last] - t[0]) / last;
  const late = t.findIndex((time, i) => Math.abs(time - t[0] - i * h) > 0.5 * h);
  if (!(h > 0)) throw new Error("t must increase");
  if (late >= 0) throw new Error(`row ${late + 2}: t is not evenly spaced; samples must be ${h.toPrecision(3)} s apart`);
  const slope = (i, j) => (x[j] - x[i]) / ((j - i) * h);
  const v = heads.includes("v") ? column("v") : x.map((_, i) => slope(Math.max(i - 1, 0), Math.min(i + 1, last)));
  return {h, u, x, v, P_A, P_B};
};

// Mean square errors of both chambers, Pa^2, by row at its best of these n; with the pressures.
const ranked = async (record, indices, onward = () => {}) => {
  const withN = live.models.flatMap((model, row) => (live.layout.parameters[model].includes("n") ? [row] : []));
  const all = 2 ** live.rows.length - 1, others = all - withN.reduce((sum, row) => sum + 2 ** row, 0);
  const best = live.rows.map((name) => ({name, n: null, both: Infinity}));
  const kept = live.get("n") ?? null;
  for (const [turn, n] of [null, ...indices].entries()) {
    const wanted = n === null ? others : all - others;
    if (n !== null) live.set("n", n);
    const pressures = live.replay(record, wanted);
    pressures.forEach((pair, row) => {
      if (!(wanted >> row & 1)) return;
      const squares = pair.map((P, side) => P.reduce((sum, p, k) => sum + (k ? (p - record[side ? "P_B" : "P_A"][k]) ** 2 : 0), 0) / P.length);
      const both = (squares[0] + squares[1]) / 2;
      if (both < best[row].both) best[row] = {name: live.rows[row], n, both, squares, pressures: pair};
    });
    onward(turn + 1, indices.length + 1);
    await new Promise((done) => setTimeout(done));
  }
  if (kept !== null) live.set("n", kept);
  return best.sort((one, other) => one.both - other.both);
};

(() => {
  const SLIDERS = [ // name, text, unit, factor to SI, least, most, step
    ["bore", "Bore", "mm", 1e-3, 10, 63, 1], ["stroke", "Stroke", "mm", 1e-3, 50, 400, 5],
    ["M", "Load", "kg", 1, 0.5, 20, 0.5], ["k_xu", "Valve area per volt", "mm²/V", 1e-6, 0.01, 1, 0.01],
    ["k_0", "Wall conductance k₀", "W/K", 1, 0.02, 2.5, 0.02], ["n", "Polytropic index n", "", 1, 1, 1.4, 0.05],
    ["amplitude", "Command", "V", 1, 0, 10, 0.1], ["frequency", "Frequency", "Hz", 1, 0.1, 5, 0.1],
  ];
  const INDICES = [1, 1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4];
  const {plants, dead_per_swept: dead, colours: looks} = live.layout;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const chosen = {amplitude: 3, frequency: 2, n: 1.35, shape: "square", model: live.models.includes("M8") ? "M8" : live.models.at(-1)};
  const history = [], inputs = {};
  let running = false, before = 0, ready = false;

  const show = (value) => Number(value.toPrecision(3)).toString();
  const areaOf = (bore) => Math.PI / 4 * bore ** 2;
  // The place in the address says what is set; a link holds it.
  const remember = () => {
    if (!ready) return;
    const said = SLIDERS.map(([name]) => [name, inputs[name].value]);
    window.history.replaceState(null, "", `#${new URLSearchParams([...said, ["shape", chosen.shape], ["model", chosen.model]])}`);
  };
  const apply = (name, value) => {
    chosen[name] = value;
    live.set(name, value);
    if (name === "bore") ["A_A", "A_B"].forEach((area) => live.set(area, areaOf(value)));
    if (name === "stroke") [["x_min", -0.5], ["x_max", 0.5]].forEach(([stop, half]) => live.set(stop, half * value));
    if (["bore", "stroke"].includes(name)) ["V_d_A", "V_d_B"].forEach((V_d) => live.set(V_d, dead * areaOf(live.get("bore") ?? chosen.bore) * live.get("stroke")));
    if (!["amplitude", "frequency"].includes(name)) rest();
  };
  const rest = () => { live.start(); history.length = 0; element("message").textContent = ""; draw(); };

  const select = (text, id, options, changed, place = element("sliders")) => {
    const label = document.createElement("label"), list = Object.assign(document.createElement("select"), {id});
    for (const [value, name] of options) list.append(new Option(name, value));
    list.addEventListener("change", () => { changed(list.value); remember(); });
    label.append(text, list);
    place.append(label);
    return list;
  };
  const preset = select("Cylinder ", "preset", [...Object.keys(plants).map((name) => [name, `of the paper, ${name}`]), ["own", "own"]], (name) => {
    const values = plants[name];
    if (!values) return;
    [["bore", 2 * Math.sqrt(values.A_A / Math.PI)], ...["stroke", "M", "k_xu", "k_0"].map((constant) => [constant, values[constant]])].forEach(([slider, value]) => slide(slider, value));
    matched();
  });
  // The numbers of a cylinder of the study, where the sliders are at them.
  const matched = () => { Object.entries(plants[preset.value] ?? {}).forEach(([constant, value]) => live.set(constant, value)); rest(); };
  const matches = () => Object.entries(plants).find(([, values]) => ["A_A", "stroke", "M", "k_xu", "k_0"].every((name) => Math.abs(live.get(name) / values[name] - 1) < 0.01))?.[0] ?? "own";

  for (const [name, text, unit, factor, least, most, step] of SLIDERS) {
    const label = document.createElement("label"), input = document.createElement("input"), output = document.createElement("output");
    const value = chosen[name] ?? (name === "bore" ? 2 * Math.sqrt(live.get("A_A") / Math.PI) : live.get(name));
    Object.assign(input, {type: "range", id: name, min: least, max: most, step, value: value / factor});
    const tell = () => { output.textContent = `${show(Number(input.value))} ${unit}`; input.setAttribute("aria-valuetext", output.textContent); };
    label.append(`${text} `, output, input);
    element("sliders").append(label);
    input.addEventListener("input", () => { tell(); apply(name, Number(input.value) * factor); preset.value = matches(); remember(); });
    inputs[name] = Object.assign(input, {factor, tell});
    chosen[name] = value;
    tell();
  }
  const slide = (name, value) => { inputs[name].value = value / inputs[name].factor; inputs[name].tell(); apply(name, value); };
  const shapes = select("Excitation ", "shape", [["square", "square"], ["sine", "sine"]], (shape) => { chosen.shape = shape; });
  for (const model of live.models) element("drawn").append(new Option(model, model));
  element("drawn").addEventListener("change", (event) => { chosen.model = event.target.value; history.length = 0; remember(); });

  const rows = live.models.map((model) => {
    const row = element("errors").insertRow(), head = document.createElement("th"), bar = document.createElement("span");
    head.scope = "row";
    head.textContent = model;
    bar.className = "bar";
    row.append(head);
    const number = row.insertCell();
    row.insertCell().append(bar);
    return {row, number, bar};
  });

  const command = (t) => {
    const wave = Math.cos(2 * Math.PI * chosen.frequency * t);
    return chosen.amplitude * (chosen.shape === "square" ? Math.sign(wave) : wave);
  };

  const canvas = (id) => {
    const node = element(id), scale = window.devicePixelRatio || 1, {clientWidth: w, clientHeight: h} = node;
    if (node.width !== Math.round(w * scale) || node.height !== Math.round(h * scale)) Object.assign(node, {width: Math.round(w * scale), height: Math.round(h * scale)});
    const pen = node.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, w, h);
    pen.font = "12px system-ui, sans-serif";
    return {pen, w, h};
  };
  const colours = () => Object.fromEntries(["ink", "line", "pale", "a", "b"].map((name) => [name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()]));

  const drawCylinder = (colour) => {
    const {pen, w, h} = canvas("cylinder"), half = live.get("stroke") / 2;
    const thick = Math.min(0.8 * h, 20 + 1e3 * live.get("bore")), top = (h - thick) / 2, left = 10, long = 0.75 * w;
    const piston = left + long * (live.state[0] + half) / (2 * half);
    pen.fillStyle = colour.a; pen.globalAlpha = Math.min(0.8, live.state[2] / 1e6); pen.fillRect(left, top, piston - left, thick);
    pen.fillStyle = colour.b; pen.globalAlpha = Math.min(0.8, live.state[4] / 1e6); pen.fillRect(piston, top, left + long - piston, thick);
    pen.globalAlpha = 1; pen.strokeStyle = colour.line; pen.lineWidth = 2; pen.strokeRect(left - 4, top, long + 8, thick);
    pen.fillStyle = colour.ink; pen.fillRect(piston - 4, top, 8, thick); pen.fillRect(piston, h / 2 - 3, left + long + 8 + 0.2 * (piston - left) - piston, 6);
    pen.fillText("A", left + 4, top + 14); pen.fillText("B", left + long - 14, top + 14);
  };
  const drawLines = (id, xs, ys, xLabel, first, colour) => {
    const {pen, w, h} = canvas(id), left = 42, bottom = 30, right = 10, top = 8;
    const flat = xs.flat().filter(Number.isFinite), x0 = first ?? 0, x1 = Math.max(...flat, x0 + 1e-9), y1 = 8;
    const X = (x) => left + (w - left - right) * (x - x0) / (x1 - x0), Y = (y) => h - bottom - (h - bottom - top) * y / y1;
    pen.strokeStyle = colour.pale; pen.fillStyle = colour.ink; pen.lineWidth = 1; pen.textAlign = "right";
    for (let y = 0; y <= y1; y += 2) { pen.beginPath(); pen.moveTo(left, Y(y)); pen.lineTo(w - right, Y(y)); pen.stroke(); pen.fillText(`${y}`, left - 5, Y(y) + 4); }
    pen.textAlign = "left"; pen.fillText("bar", 4, 14); pen.fillText(show(x0), left, h - 14);
    pen.textAlign = "right"; pen.fillText(flat.length ? `${show(x1)} ${xLabel}` : xLabel, w - right, h - 14); pen.textAlign = "left";
    ys.forEach((series, i) => { // of chambers A and B, then dashed by a model
      pen.strokeStyle = i > 1 ? colour.ink : i ? colour.b : colour.a; pen.lineWidth = ys.length > 2 && i < 2 ? 3 : 1.4; pen.setLineDash(i > 1 ? [5, 4] : []); pen.beginPath();
      series.forEach((y, k) => (k ? pen.lineTo(X(xs[i][k]), Y(y)) : pen.moveTo(X(xs[i][k]), Y(y))));
      pen.stroke();
    });
    pen.setLineDash([]);
  };
  const draw = () => {
    const colour = colours(), t = live.steps() * live.H;
    element("time").textContent = `${t.toFixed(1)} s`;
    drawCylinder(colour);
    const bar = (place) => history.map((sample) => sample[place] / 1e5), times = history.map((sample) => sample[0]);
    drawLines("traces", [times, times, times, times], [bar(2), bar(3), bar(4), bar(5)], "s", times[0], colour);
    const volume = (sign, side) => history.map((sample) => 1e6 * (live.get(`V_d_${side}`) + live.get(`A_${side}`) * (live.get("stroke") / 2 + sign * sample[1])));
    drawLines("loop", [volume(1, "A"), volume(-1, "B")], [bar(2), bar(3)], "cm³", 0, colour);
    element("values").textContent = `x = ${(1e3 * live.state[0]).toFixed(1)} mm, P_A = ${(live.state[2] / 1e5).toFixed(2)} bar, P_B = ${(live.state[4] / 1e5).toFixed(2)} bar`;
    const count = Math.max(1, 2 * live.steps());
    const rms = rows.map((_, i) => Math.sqrt((live.squares[2 * i] + live.squares[2 * i + 1]) / count) / 1e3);
    const [least, most] = [Math.min(...rms.filter(Number.isFinite)), Math.max(...rms.filter(Number.isFinite), 1e-9)];
    rows.forEach(({row, number, bar: shown}, i) => {
      number.textContent = Number.isFinite(rms[i]) ? rms[i].toFixed(2) : "failed";
      shown.style.width = `${100 * Math.min(1, (rms[i] || 0) / most)}%`;
      shown.style.background = looks[live.models[i]]?.[dark.matches ? 1 : 0] ?? "";
      row.classList.toggle("best", live.steps() > 0 && rms[i] === least);
    });
  };

  const frame = (now) => {
    if (!running) return;
    const steps = Math.min(100, Math.round((now - before) / 1e3 / live.H));
    before = now;
    for (let done = 0; done < steps; done += 4) {
      const part = Array.from({length: Math.min(4, steps - done)}, (_, k) => command((live.steps() + k) * live.H));
      if (!live.advance(part)) {
        element("message").textContent = "A pressure left the positive numbers: back to rest with other settings.";
        run(false);
        return;
      }
      const drawn = 2 * live.models.indexOf(chosen.model);
      history.push([live.steps() * live.H, live.state[0], live.state[2], live.state[4], live.pressures[drawn], live.pressures[drawn + 1]]);
    }
    if (history.length > 1000) history.splice(0, history.length - 1000);
    draw();
    requestAnimationFrame(frame);
  };
  const run = (wanted) => {
    running = wanted;
    element("run").textContent = running ? "Pause" : "Run";
    element("run").setAttribute("aria-pressed", String(running));
    if (running) { before = performance.now(); requestAnimationFrame(frame); }
  };
  // A record: the file's text, or 4 s of the cylinder above, replayed by all.
  let result = null;
  const drawRecord = () => {
    if (!result) return;
    const {record, best} = result, every = Math.ceil(record.u.length / 2000), nearest = best[0];
    const thin = (signal) => Array.from({length: Math.ceil(signal.length / every)}, (_, k) => signal[k * every]);
    const t = thin(record.u).map((_, k) => k * every * record.h), bar = (P) => thin(P).map((p) => p / 1e5);
    drawLines("replayed", [t, t, t, t], [bar(record.P_A), bar(record.P_B), ...nearest.pressures.map(bar)], "s", 0, colours());
  };
  const rank = async (record, name) => {
    element("told").className = "";
    const best = await ranked(record, INDICES, (done, of) => { element("told").textContent = `${name}: ${Math.round(100 * done / of)} %`; });
    const swing = Math.max(...["P_A", "P_B"].map((side) => record[side].reduce((most, p) => Math.max(most, p), -Infinity) - record[side].reduce((least, p) => Math.min(least, p), Infinity)));
    const kilo = (square) => (Math.sqrt(square) / 1e3).toPrecision(3);
    element("ranking").replaceChildren(...best.map(({name: model, n, both, squares}) => {
      const row = document.createElement("tr"), head = document.createElement("th");
      head.scope = "row";
      head.textContent = model;
      row.append(head);
      const cells = Number.isFinite(both) ? [n?.toFixed(2) ?? "–", ...squares.map(kilo), kilo(both), `${(100 * Math.sqrt(both) / swing).toPrecision(2)} %`] : ["–", "failed", "failed", "failed", ""];
      for (const text of cells) row.insertCell().textContent = text;
      return row;
    }));
    element("ranking").rows[0].className = "best";
    element("result").hidden = false;
    element("nearest").textContent = best[0].name;
    element("told").textContent = `${name}: ${record.u.length} samples, ${show(1e3 * record.h)} ms apart. ${best[0].name} is nearest.`;
    result = {record, best};
    drawRecord();
    document.body.dataset.ranked = name; // for tests
  };
  const open = async (file) => {
    run(false);
    try {
      await rank(readRecord(await file.text()), file.name);
    } catch (problem) {
      element("told").className = "bad";
      element("told").textContent = `${file.name}: ${problem.message}`;
    }
  };
  element("file").addEventListener("change", (event) => { if (event.target.files[0]) open(event.target.files[0]); event.target.value = ""; });
  element("example").addEventListener("click", () => {
    run(false);
    rest();
    const length = 4001, record = {h: live.H, ...Object.fromEntries(["u", "x", "v", "P_A", "P_B"].map((name) => [name, new Float64Array(length)]))};
    for (let k = 0; k < length; k++) {
      const u = command(k * live.H), [x, v, P_A, , P_B] = live.state;
      Object.entries({u, x, v, P_A, P_B}).forEach(([name, value]) => { record[name][k] = value; });
      live.advance([u]);
    }
    rest();
    rank(record, "4 s of this cylinder");
  });
  const over = (event) => { event.preventDefault(); element("record").classList.toggle("over", event.type === "dragover"); };
  for (const name of ["dragover", "dragleave", "drop"]) window.addEventListener(name, over);
  window.addEventListener("drop", (event) => { if (event.dataTransfer.files[0]) open(event.dataTransfer.files[0]); });

  element("run").addEventListener("click", () => run(!running));
  element("reset").addEventListener("click", rest);
  const redraw = () => { draw(); drawRecord(); };
  window.addEventListener("resize", redraw);
  dark.addEventListener("change", redraw);

  // Take what the address says, within the sliders' ranges; the rest stays.
  const said = new URLSearchParams(location.hash.slice(1));
  const first = Object.keys(plants)[0];
  Object.entries(plants[first]).forEach(([constant, value]) => live.set(constant, value));
  for (const [name] of SLIDERS) if (said.has(name) && said.get(name) && Number.isFinite(Number(said.get(name)))) inputs[name].value = said.get(name);
  for (const [name] of SLIDERS) { inputs[name].tell(); apply(name, Number(inputs[name].value) * inputs[name].factor); }
  if (["square", "sine"].includes(said.get("shape"))) chosen.shape = said.get("shape");
  if (live.models.includes(said.get("model"))) chosen.model = said.get("model");
  [shapes.value, element("drawn").value, preset.value] = [chosen.shape, chosen.model, matches()];
  ready = true;
  matched();
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
})();
