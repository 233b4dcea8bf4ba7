// SPDX-License-Identifier: MIT
// Overlapping Allan deviation of evenly spaced rates, the same as in `prismcal allan`:
//   σ²(m) = Σ_j (x_{j+2m} − 2 x_{j+m} + x_j)² / (2 m² n),  x_j = Σ_{i<j} y_i, n terms   (NIST SP 1065, eq. 11)
// A value that is not finite is a gap: the terms of the segments between gaps are summed, without interpolation.

/** Returns the segments without a gap, each as the running sum of its values minus the mean of all values. */
function phasesOf(rates) {
  let values = 0, offsets = 0, origin = 0;
  for (const rate of rates) {
    if (!Number.isFinite(rate)) continue;
    if (values++ === 0) origin = rate;
    offsets += rate - origin;
  }
  const mean = origin + offsets / values, phases = [];
  for (let i = 0; i < rates.length; ) {
    if (!Number.isFinite(rates[i])) { i++; continue; }
    let end = i;
    while (end < rates.length && Number.isFinite(rates[end])) end++;
    const phase = new Float64Array(end - i + 1);
    for (let k = 1; i < end; i++, k++) phase[k] = phase[k - 1] + (rates[i] - mean);
    phases.push(phase);
  }
  return { phases, values };
}

/** About 15 cluster sizes per decade, from 1 to a third of the number of values. */
export function clusterSizes(values) {
  const sizes = [];
  for (let k = 0; ; k++) {
    const m = Math.round(10 ** (k / 15));
    if (m > Math.floor(values / 3)) return sizes;
    if (m !== sizes[sizes.length - 1]) sizes.push(m);
  }
}

/**
 * Returns points {m, tau_s, deviation, clusters} of `rates` (any unit; NaN or null is a gap), spaced `tau0_s`, for the given cluster
 * sizes. Sizes without a pair of clusters are omitted. Empty for fewer than three values.
 */
export function allanDeviation(rates, tau0_s, sizes) {
  const { phases, values } = phasesOf(rates);
  if (values < 3 || !(tau0_s > 0)) return [];
  const points = [];
  for (const m of sizes ?? clusterSizes(values)) {
    let squares = 0, terms = 0, clusters = 0;
    for (const x of phases) {
      const n = x.length - 1;
      clusters += Math.floor(n / m);
      for (let j = 0; j + 2 * m <= n; j++, terms++) {
        const d = x[j + 2 * m] - 2 * x[j + m] + x[j];
        squares += d * d;
      }
    }
    if (terms > 0) points.push({ m, tau_s: m * tau0_s, deviation: Math.sqrt(squares / (2 * terms)) / m, clusters });
  }
  return points;
}
