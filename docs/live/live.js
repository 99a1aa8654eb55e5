"use strict";
const live = (() => {
  const element = (id) => document.getElementById(id);
  const layout = JSON.parse(element("layout").textContent);
  const names = Object.keys(layout.parameters), models = names.slice(0, -1), full = names.length - 1;
  const bytes = Uint8Array.from(atob(element("wasm").textContent.trim()), (c) => c.charCodeAt(0));
  const code = new WebAssembly.Instance(new WebAssembly.Module(bytes), {env: {pow: Math.pow}}).exports;
  const at = (place, count) => new Float64Array(code.memory.buffer, place, count);
  const state = at(code.place_of_state(), 6), commands = at(code.place_of_commands(), layout.most_steps);
  const pressures = at(code.place_of_pressures(), 2 * models.length);
  const squares = at(code.place_of_squares(), 2 * models.length);
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
  code.take_defaults();
  start();
  return {models, state, pressures, squares, set, get, start, advance, H, steps: () => steps};
})();

(() => {
  const element = (id) => document.getElementById(id);
  const SLIDERS = [ // name, text, unit, factor to SI, least, most, step
    ["bore", "Bore", "mm", 1e-3, 10, 63, 1], ["stroke", "Stroke", "mm", 1e-3, 50, 400, 10],
    ["M", "Load", "kg", 1, 0.5, 20, 0.5], ["k_xu", "Valve area per volt", "mm²/V", 1e-6, 0.01, 0.5, 0.01],
    ["k_0", "Wall conductance k₀", "W/K", 1, 0.02, 2.5, 0.02], ["n", "Polytropic index n", "", 1, 1, 1.4, 0.05],
    ["amplitude", "Command", "V", 1, 0, 10, 0.1], ["frequency", "Frequency", "Hz", 1, 0.1, 5, 0.1],
  ];
  const chosen = {amplitude: 2, frequency: 0.5, n: 1.35, shape: "square"};
  const history = [];
  let running = false, before = 0;

  const show = (value) => Number(value.toPrecision(3)).toString();
  const apply = (name, value) => {
    chosen[name] = value;
    if (name === "bore") ["A_A", "A_B"].forEach((area) => live.set(area, Math.PI / 4 * value ** 2));
    if (name === "stroke") [["x_min", -0.5], ["x_max", 0.5]].forEach(([stop, share]) => live.set(stop, share * value));
    live.set(name, value);
    if (!["amplitude", "frequency"].includes(name)) rest();
  };
  const rest = () => { live.start(); history.length = 0; element("message").textContent = ""; draw(); };

  for (const [name, text, unit, factor, least, most, step] of SLIDERS) {
    const label = document.createElement("label"), input = document.createElement("input"), output = document.createElement("output");
    const value = chosen[name] ?? live.get(name);
    Object.assign(input, {type: "range", id: name, min: least, max: most, step, value: value / factor});
    const tell = () => { output.textContent = `${show(Number(input.value))} ${unit}`; input.setAttribute("aria-valuetext", output.textContent); };
    label.append(`${text} `, output, input);
    element("sliders").append(label);
    input.addEventListener("input", () => { tell(); apply(name, Number(input.value) * factor); });
    chosen[name] = value;
    tell();
  }
  const label = document.createElement("label"), select = document.createElement("select");
  select.id = "shape";
  for (const shape of ["square", "sine"]) select.append(new Option(shape, shape));
  select.addEventListener("change", () => { chosen.shape = select.value; });
  label.append("Excitation ", select);
  element("sliders").append(label);

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
    const wave = Math.sin(2 * Math.PI * chosen.frequency * t);
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
    pen.textAlign = "right"; pen.fillText(`${show(x1)} ${xLabel}`, w - right, h - 14); pen.textAlign = "left";
    ys.forEach((series, i) => {
      pen.strokeStyle = i ? colour.b : colour.a; pen.lineWidth = 1.6; pen.beginPath();
      series.forEach((y, k) => (k ? pen.lineTo(X(xs[i][k]), Y(y)) : pen.moveTo(X(xs[i][k]), Y(y))));
      pen.stroke();
    });
  };
  const draw = () => {
    const colour = colours(), t = live.steps() * live.H;
    element("time").textContent = `${t.toFixed(1)} s`;
    drawCylinder(colour);
    const bar = (place) => history.map((sample) => sample[place] / 1e5), times = history.map((sample) => sample[0]);
    drawLines("traces", [times, times], [bar(2), bar(3)], "s", times[0], colour);
    const volume = (sign, side) => history.map((sample) => 1e6 * (live.get(`V_d_${side}`) + live.get(`A_${side}`) * (live.get("stroke") / 2 + sign * sample[1])));
    drawLines("loop", [volume(1, "A"), volume(-1, "B")], [bar(2), bar(3)], "cm³", 0, colour);
    element("values").textContent = `x = ${(1e3 * live.state[0]).toFixed(1)} mm, P_A = ${(live.state[2] / 1e5).toFixed(2)} bar, P_B = ${(live.state[4] / 1e5).toFixed(2)} bar`;
    const count = Math.max(1, 2 * live.steps());
    const rms = rows.map((_, i) => Math.sqrt((live.squares[2 * i] + live.squares[2 * i + 1]) / count) / 1e3);
    const [least, most] = [Math.min(...rms.filter(Number.isFinite)), Math.max(...rms.filter(Number.isFinite), 1e-9)];
    rows.forEach(({row, number, bar: shown}, i) => {
      number.textContent = Number.isFinite(rms[i]) ? rms[i].toFixed(2) : "failed";
      shown.style.width = `${100 * Math.min(1, (rms[i] || 0) / most)}%`;
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
      history.push([live.steps() * live.H, live.state[0], live.state[2], live.state[4]]);
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
  element("run").addEventListener("click", () => run(!running));
  element("reset").addEventListener("click", rest);
  window.addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  live.set("n", chosen.n);
  rest();
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
})();
