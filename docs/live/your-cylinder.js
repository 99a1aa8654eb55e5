// Cylinder, runs and choice without the page: tests compare each with Python.
const study = (() => {
  const {plant: given, rows, n} = layout;
  const draws = new Float64Array(Uint8Array.from(atob(layout.draws), (c) => c.charCodeAt(0)).buffer);
  const count = draws.length / layout.most_runs;
  const NUMBER = /^[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?$/;
  const TOLD = ["k_0_W_per_K"]; // follows from k_0_low and k_0_high

  // Mass flow, kg/s, by ISO 6358.
  const flow = (b, area, P_u, P_d) => {
    const above = Math.max(0, (P_d / P_u - b) / (1 - b));
    return (area * given.sonic_coefficient * P_u * Math.sqrt(1 - above ** 2)) / Math.sqrt(given.T_in);
  };
  const atRest = (b, P_s) => {
    let [low, high] = [given.P_atm, P_s];
    for (let i = 0; i < 100; i++) {
      const P = (low + high) / 2;
      if (flow(b, 1, P_s, P) > flow(b, 1, P, given.P_atm)) low = P; else high = P;
    }
    return low;
  };
  // Texts by key -> constants of the exported C, in SI units, and the factor of k_0.
  const plant = (texts) => {
    const value = (key) => Number(texts[key]), blank = (key) => !(texts[key] ?? "").trim();
    const bore = value("bore_mm") * 1e-3, stroke = value("stroke_mm") * 1e-3, rod = value("rod_mm") * 1e-3;
    const P_s = value("P_s_Pa"), area = Math.PI * bore ** 2 / 4, rod_area = Math.PI * rod ** 2 / 4;
    const V_d_A = blank("dead_volume_m3") ? layout.dead_fraction * area * stroke / 2 : value("dead_volume_m3");
    const V = V_d_A + area * stroke / 2, A_q = 4 * V / bore + Math.PI / 2 * bore ** 2;
    const b = blank("b") ? layout.usual_b : value("b"), {product, smallest, largest, growth} = layout.catalogue;
    const factor = layout.catalogue.factor * Math.max(smallest / bore, bore / largest, 1) ** growth, middle = product * A_q / V * A_q;
    const low = blank("k_0_low") ? middle / factor : value("k_0_low");
    const high = blank("k_0_high") ? middle * factor : value("k_0_high");
    const asCatalogue = blank("k_0_low") && blank("k_0_high");
    return {
      bore, stroke, P_s, A_A: area, A_B: area - rod_area, V_d_A, critical_ratio: b, P_0: atRest(b, P_s),
      V_d_B: blank("dead_volume_B_m3") ? V_d_A : value("dead_volume_B_m3"), M: value("mass_kg"), k_f: value("friction_Ns_per_m"),
      x_min: -stroke / 2, x_max: stroke / 2, load: -rod_area * given.P_atm, coulomb: value("coulomb_N"),
      k_xu: value("C_dm3_per_sbar") * layout.area_per_conductance / given.u_max,
      k_0: asCatalogue ? middle : Math.sqrt(low * high), factor: asCatalogue ? factor : Math.sqrt(high / low), asCatalogue,
    };
  };
  // Texts of the YAML's keys; without those that keep their default.
  const keys = (texts) => {
    const told = {...texts};
    TOLD.forEach((key) => delete told[key]);
    const {k_0, factor, asCatalogue} = plant(texts);
    if (!asCatalogue) told.k_0_W_per_K = `${k_0} ± ${100 * (factor - 1)} %`;
    for (const key of Object.keys(told)) {
      told[key] = told[key].trim();
      if (!told[key]) delete told[key]; else if (NUMBER.test(told[key])) told[key] = String(Number(told[key]));
    }
    return told;
  };
  const yaml = (texts) => {
    const told = keys(texts);
    const needed = new Set(layout.fields.filter(({value}) => value !== null).map(({key}) => key));
    const line = (key) => (key in told || needed.has(key) ? `${key}: ${told[key] ?? "null"}` : layout.unset[key]);
    return layout.template.replace(/\{\{(\w+)\}\}/g, (_, key) => line(key));
  };
  const general = (value, digits) => { // as Python's format g
    if (!value || !Number.isFinite(value)) return value ? String(value).replace("Infinity", "inf") : "0";
    const [mantissa, power] = value.toExponential(digits - 1).split("e");
    if (power >= -4 && power < digits) return String(Number(value.toPrecision(digits)));
    return `${Number(mantissa)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
  };
  const repr = (value) => { // as Python's of a float
    const [digits, power] = (value && Math.abs(value) < 1e-4 ? value.toExponential() : String(value)).split("e");
    return power ? `${digits}e-${power.slice(1).padStart(2, "0")}` : `${digits}${digits.includes(".") ? "" : ".0"}`;
  };
  const comma = (text) => (/^[+-]?[0-9]+,[0-9]+$/.test(text.trim()) ? "; decimal point, not comma" : "");
  const hint = (key, value) => {
    if (["bore_mm", "stroke_mm"].includes(key) && value > 0 && value < 1) return "; is it in metres?";
    if (key === "P_s_Pa" && value > 0 && value < 100) return "; is it in bar?";
    return key === "C_dm3_per_sbar" && value >= 20 ? "; is this a nominal flow in l/min? then Q_n_l_per_min" : "";
  };
  // First field that `pneumo check` refuses: {key, line}; null if it refuses none.
  const check = (texts) => {
    const told = keys(texts), path = (key) => layout.fields.find((field) => field.key === key).path;
    const refused = (key, why) => ({key, line: `${path(key)} = ${repr(Number(told[key]))}: ${why}${hint(key, Number(told[key]))}`});
    const allowed = (key) => layout.fields.find((field) => field.key === key).allowed;
    const C = "C_dm3_per_sbar";
    const wrong = (section) => {
      for (const {key, bounds, value, path} of layout.fields.filter((field) => field.path.startsWith(section))) {
        const noFlow = {key: C, line: `${path}`.replace(/b$/, `${C}: missing; must be ${allowed(C)}; or give ${layout.flows}`)};
        if (key === "b" && !(C in told) && !(key in told)) return noFlow;
        if (!(key in told) && (value === null || key === C || key === "b")) continue;
        const whole = told[key] ?? "None", [, number, percent] = /^(.*) ± (.*) %$/.exec(whole) ?? [];
        const uncertain = NUMBER.test(number ?? "") && NUMBER.test(percent ?? ""), text = uncertain ? number : whole;
        const x = NUMBER.test(text) ? Number(text) : NaN;
        if (uncertain && !(percent >= 0 && percent <= 1e4)) return {key, line: `${path} = '${whole}': the uncertainty must be 0 to 10000 %`};
        if (x > (bounds.gt ?? -Infinity) && x >= (bounds.ge ?? -Infinity)
          && x < (bounds.lt ?? Infinity) && x <= (bounds.le ?? Number.MAX_VALUE)) {
          if (key !== "b" || C in told) continue; // C may be left out, for a nominal flow
          return noFlow;
        }
        let shown = text === "None" || Number.isInteger(x) ? text : `'${text}'`;
        if ((uncertain || !Number.isInteger(x)) && !Number.isNaN(x)) shown = repr(x);
        return {key, line: `${path} = ${shown}: must be ${allowed(key)}${Number.isNaN(x) ? comma(text) : hint(key, x)}`};
      }
      return null;
    };
    const {P_s, bore, stroke, A_A, A_B, load, coulomb, M, k_f, k_xu, P_0, critical_ratio} = plant(texts), {P_atm} = given;
    const [mm, rod] = [Number(told.bore_mm), Number(told.rod_mm)], limits = layout.plausible;
    const supply = wrong("supply");
    if (supply) return supply;
    if (P_s <= P_atm) return refused("P_s_Pa", `must exceed P_atm_Pa = ${general(P_atm, 6)} and be ${allowed("P_s_Pa")}`);
    const cylinder = wrong("cylinders");
    if (cylinder) return cylinder;
    if (rod >= mm && mm < 1) return refused("bore_mm", `must exceed rod_mm = ${general(rod, 6)} and be ${allowed("bore_mm")}`);
    if (rod >= mm) return refused("rod_mm", `must be below bore_mm = ${general(mm, 6)} and be ${allowed("rod_mm")}`);
    const wall = wrong("experiments");
    if (wall) return wall;
    const implausible = (key, why) => {
      const {line} = refused(key, why);
      return {key, line: `${line}; ${limits.remedy}`};
    };
    for (const key of ["bore_mm", "stroke_mm"]) {
      if (Number(told[key]) < limits.least_mm) return implausible(key, `below ${limits.least_mm} mm`);
    }
    const out = A_A * P_s - A_B * P_atm + load, back = A_B * P_s - A_A * P_atm - load, force = Math.min(out, back) - coulomb;
    if (force <= 0) {
      const push = general((out < back ? A_A : A_B) * (P_s - P_atm), 3);
      return implausible("coulomb_N", `the piston cannot move ${out < back ? "out" : "back"}: at P_s_Pa = ${general(P_s, 6)}`
        + ` the air pushes with ${push} N, and load, weight and Coulomb friction hold it`);
    }
    const speed = flow(critical_ratio, k_xu * given.u_max, P_s, P_0) * given.R * given.T_0 / (P_0 * A_A);
    if (speed > limits.fastest) {
      return implausible("C_dm3_per_sbar", `fully open it moves the piston of ${general(mm, 6)} mm at ${general(speed, 3)} m/s,`
        + ` no cylinder survives ${general(limits.fastest, 6)} m/s`);
    }
    const needed = {C_dm3_per_sbar: stroke / speed, friction_Ns_per_m: stroke * k_f / force, mass_kg: Math.sqrt(2 * M * stroke / force)};
    const slowest = Object.keys(needed).reduce((one, other) => (needed[other] > needed[one] ? other : one));
    if (needed[slowest] > limits.slowest) {
      return implausible(slowest, `a stroke takes ${general(needed[slowest], 3)} s, more than ${general(limits.slowest, 6)} s: the piston cannot move`);
    }
    const swept = A_A * stroke, air = Math.min(A_A, A_B) * (P_s - P_atm);
    for (const key of ["dead_volume_m3", "dead_volume_B_m3"]) {
      const times = Number(told[key] ?? 0) / swept;
      if (times > limits.most_dead) return implausible(key, `${general(times, 3)} times the ${general(swept, 3)} m³ of a stroke; is it in litres?`);
    }
    if (air < limits.least_acceleration * M) {
      return implausible("mass_kg", `the air, ${general(air, 3)} N, accelerates it by ${general(air / M, 3)} m/s² at most; is it in grams?`);
    }
    if (Number(told.amplitude_V) > limits.most_volts * given.u_max) {
      return implausible("amplitude_V", `more than ${general(limits.most_volts, 6)} times u_max_V = ${general(given.u_max, 6)}; is it in mV?`);
    }
    if (Number(told.amplitude_mm) <= Number(told.stroke_mm)) return null;
    return implausible("amplitude_mm", `an amplitude of ${general(Number(told.amplitude_mm), 4)} mm exceeds the stroke, ${general(Number(told.stroke_mm), 6)} mm`);
  };

  // One run, in a worker: the module with a plant's constants -> mean square errors [row][n][chamber] and the variance of the pressures.
  const worker = ({module, parameters, constants, k_0, loop, gain, reverse, commands, layout}) => {
    const code = new WebAssembly.Instance(module).exports;
    const at = (place, length) => new Float64Array(code.memory.buffer, place, length);
    code.take_defaults();
    Object.entries(parameters).forEach(([model, names], i) => names.forEach((name, j) => {
      if (name in constants) at(code.place_of_parameters(i), names.length)[j] = model === "full" && name === "k_0" ? k_0 : constants[name];
    }));
    at(code.place_of_commands(), commands.length).set(commands);
    const variance = code.study_run(layout.steps, layout.every, layout.h, loop, gain, reverse);
    const errors = at(code.place_of_errors(), layout.rows.length * layout.n.length * 2);
    return {variance, errors: layout.rows.map((row, i) => layout.n.map((_, j) => {
      const place = (i * layout.n.length + (row.has_n ? j : 0)) * 2; // the same at every n, for a row without one
      return Number.isNaN(variance) ? [NaN, NaN] : [...errors.slice(place, place + 2)];
    }))};
  };
  let pool = [];
  const cancel = () => { pool.forEach((one) => one.terminate()); pool = []; };
  // All runs of a study: promise of {errors: [experiment][run][row][n][chamber], swing: [experiment][run]}.
  const run = (texts, runs, progress = () => {}) => new Promise((done, failed) => {
    cancel();
    const constants = plant(texts), {k_0, stroke} = constants, module = new WebAssembly.Module(bytes), jobs = [];
    layout.experiments.forEach(({closed}, e) => {
      for (let r = 0; r < runs; r++) {
        const of = Array.from(draws.subarray(r * count, (r + 1) * count)), volts = Number(texts.amplitude_V);
        const commands = of.map((draw) => (closed ? Number(texts.amplitude_mm) * 1e-3 * draw : volts * Math.sign(draw)));
        jobs.push({e, r, message: {module, parameters: layout.parameters, constants, k_0, loop: Number(closed), commands, layout: {...layout, draws: ""},
          gain: Number(texts.k_p_V_per_m), reverse: layout.reverse_at * stroke / 2}});
      }
    });
    const table = () => layout.experiments.map(() => Array(runs)), errors = table(), swing = table();
    const url = URL.createObjectURL(new Blob([`const run = ${worker}; onmessage = ({data}) => postMessage(run(data));`]));
    let next = 0, ready = 0;
    const mine = pool = Array.from({length: Math.min(navigator.hardwareConcurrency || 2, jobs.length)}, () => new Worker(url));
    mine.forEach((one) => {
      let job;
      const take = () => { job = jobs[next++]; if (job) one.postMessage(job.message); };
      one.onerror = (event) => { cancel(); failed(new Error(event.message)); };
      one.onmessage = ({data}) => {
        errors[job.e][job.r] = data.errors;
        swing[job.e][job.r] = Math.sqrt(data.variance);
        progress(++ready / jobs.length);
        if (ready === jobs.length) { cancel(); URL.revokeObjectURL(url); done({errors, swing}); } else take();
      };
      take();
    });
  });

  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  // Models by their error at their best n, with everything known, as in the ranking of `pneumo study`.
  const rank = ({errors, swing: swings}) => {
    const kept = swings[0].map((_, r) => r).filter((r) => swings.every((of) => Number.isFinite(of[r])));
    if (!kept.length) return {headline: "No full-order run succeeded.", next: "", rows: []};
    const found = rows.slice(0, -1).map((row, i) => {
      const at = (row.has_n ? n : [NaN]).map((value, j) => ({...row, n: value, rms: Math.sqrt(mean(kept.map((r) => mean(errors.map((of) => mean(of[r][i][j]))))))}));
      return at.reduce((one, other) => (other.rms < one.rms ? other : one));
    });
    const order = ({rms}) => (Number.isFinite(rms) ? rms : Infinity);
    found.sort((one, other) => (order(one) < order(other) ? -1 : Number(order(one) > order(other))));
    const [best] = found, swing = Math.sqrt(mean(swings.map((of) => mean(kept.map((r) => of[r] ** 2)))));
    const name = best.has_n ? `${best.name} at n = ${general(best.n, 6)}` : best.name;
    return {headline: `With everything known, ${name} has the lowest error of the reduced models: ${general(best.rms / 1e3, 3)} kPa RMS.`
      + " What is not known about valve, dead volumes and wall usually adds more.", next: "pneumo study my.yaml", rows: found, swing};
  };
  return {layout, plant, yaml, check, general, run, cancel, rank};
})();

(() => {
  const {general} = study;
  const form = element("fields"), texts = {}, inputs = {}, defaults = {};
  const WALL = [["k_0_low", "lowest k₀ of a chamber's wall"], ["k_0_high", "highest k₀"]];
  const made = layout.fields.flatMap((field) => (field.key === "k_0_W_per_K" ? WALL.map(([key, words]) => ({key, words, unit: "W/K", value: null, catalogue: true})) : [field]));
  for (const {key, words, unit, value, catalogue} of made) {
    const label = document.createElement("label"), input = document.createElement("input"), small = document.createElement("small");
    Object.assign(input, {id: key, type: "text", inputMode: "decimal", autocomplete: "off", value: value ?? ""});
    small.textContent = `${words}${unit ? `, ${unit}` : ""}`;
    if (catalogue) small.textContent += "; blank: the catalogue's";
    label.append(key, small, input);
    form.insertBefore(label, element("runs").closest("p"));
    inputs[key] = input;
    defaults[key] = texts[key] = input.value;
  }
  const runs = element("runs");
  for (let r = 1; r <= layout.most_runs; r++) runs.add(new Option(String(r), String(r)));
  inputs.seeds = runs;
  defaults.seeds = runs.value = String(layout.runs);

  const tell = (text, bad = false) => { element("told").textContent = text; element("told").className = bad ? "bad" : ""; };
  // Take the inputs; what is running ends. True if they describe a cylinder.
  const changed = () => {
    study.cancel();
    for (const key of Object.keys(inputs)) { texts[key] = inputs[key].value; inputs[key].removeAttribute("aria-invalid"); }
    const said = Object.entries(texts).filter(([key, text]) => text.trim() !== defaults[key]);
    history.replaceState(null, "", said.length ? `#${new URLSearchParams(said)}` : location.pathname + location.search);
    const {k_0, factor} = study.plant(texts);
    [inputs.k_0_low.placeholder, inputs.k_0_high.placeholder] = [k_0 / factor, k_0 * factor].map((value) => general(value, 3));
    element("yaml").href = `data:text/yaml;charset=utf-8,${encodeURIComponent(study.yaml(texts))}`;
    element("progress").value = 0;
    element("result").hidden = true;
    const refused = study.check(texts);
    const at = refused && (inputs[refused.key] ?? inputs.k_0_low);
    if (at) at.setAttribute("aria-invalid", "true");
    tell(refused ? refused.line : `${2 * Number(runs.value)} runs of ${layout.steps * layout.h} s: press Run.`, Boolean(refused));
    element("run").disabled = Boolean(refused);
    return !refused;
  };
  const fill = (place, tag, cells) => cells.forEach((values, i) => {
    const row = place.insertRow();
    values.forEach((text, j) => {
      const cell = document.createElement(tag === "th" || !j ? "th" : "td");
      Object.assign(cell, {scope: tag === "th" ? "col" : "row", textContent: text});
      row.append(cell);
    });
    if (tag === "td" && !i) row.className = "first";
  });
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (!changed()) return;
    tell("Running ...");
    const began = performance.now();
    try {
      const answer = study.rank(await study.run(texts, Number(texts.seeds), (part) => { element("progress").value = part; }));
      tell(answer.headline);
      element("next").textContent = answer.next;
      document.body.dataset.seconds = (performance.now() - began) / 1e3; // for tests
      [element("heads"), element("ranking")].forEach((part) => part.replaceChildren());
      if (!answer.rows.length) return;
      const kPa = (value) => (Number.isFinite(value) ? general(value / 1e3, 3) : "–");
      fill(element("heads"), "th", [["model", "n", "RMS error (kPa)", "% of swing"]]);
      fill(element("ranking"), "td", answer.rows.map(({name, has_n, n, rms}) => [name, has_n ? general(n, 6) : "", kPa(rms),
        Number.isFinite(rms) ? general(100 * rms / answer.swing, 2) : "–"]));
      element("ranking").rows[0].className = "best";
      element("result").hidden = false;
    } catch (problem) {
      tell(problem.message, true);
    }
  });
  form.addEventListener("input", changed);
  for (const [key, text] of new URLSearchParams(location.hash.slice(1))) if (key in inputs) inputs[key].value = text;
  if (!runs.value) runs.value = defaults.seeds;
  changed();
})();
