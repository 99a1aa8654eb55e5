"use strict";
// What paper/study/pages/packing.py has packed, unpacked: one Float32Array of Pa for each row, NaN where there is no value.
const MISSING = -32768;

async function unpacked(id, groups, samples) {
  const text = document.getElementById(id).textContent;
  const deflated = new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))]);
  const inflated = deflated.stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(inflated).arrayBuffer());
  const count = planes.length / 2;
  const values = new Int16Array(count); // sums wrap around in it as the differences did
  for (let i = 0; i < count; i++) {
    const code = planes[i] | (planes[count + i] << 8);
    values[i] = (code >>> 1) ^ -(code & 1);
  }
  let start = 0;
  return groups.map(({ rows, step }) => {
    const group = values.subarray(start, (start += rows * samples));
    for (let i = 1; i < samples; i++) group[i] += group[i - 1];
    for (let i = samples; i < group.length; i++) {
      group[i] += i < 2 * samples ? group[i - samples] : 2 * group[i - samples] - group[i - 2 * samples];
    }
    return Array.from({ length: rows }, (_, row) =>
      Float32Array.from(group.subarray(row * samples, (row + 1) * samples), (value) => (value === MISSING ? NaN : value * step)));
  });
}
