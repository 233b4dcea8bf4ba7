// SPDX-License-Identifier: MIT
// Overlapping Allan deviation of evenly spaced rates, the same as in `prismcal allan`:
//   σ²(m) = Σ_j (x_{j+2m} − 2 x_{j+m} + x_j)² / (2 m² n),  x_j = Σ_{i<j} y_i, n terms   (NIST SP 1065, eq. 11)
// A value that is not finite is missing. A pair of clusters counts if both are complete or, if fewer than nine of ten pairs are, if each has
// three quarters of its values: the means are of these, relative to the line through the record, and their difference is scaled to the
// variance of white noise in complete clusters. The mean of the differences is that of all pairs, the line in place of missing values. As prismcal's
// measured_deg_per_h, except that prismcal lets the neighbours of a gap in a quantised rate count less.

/**
 * Returns x, the running sum of the values minus a line, the line's slope, and the number of missing values before each; from the first known
 * value to the last. The line is their mean if no value is missing, else the least-squares line.
 */
function phaseOf(rates) {
  const known = (rate) => Number.isFinite(rate);
  let begin = 0, end = rates.length, values = 0, offsets = 0, times = 0;
  while (begin < end && !known(rates[begin])) begin++;
  while (end > begin && !known(rates[end - 1])) end--;
  for (let i = begin; i < end; i++) if (known(rates[i])) { values++; offsets += rates[i] - rates[begin]; times += i; }
  const mean = rates[begin] + offsets / values, centre = times / values, length = end - begin;
  let moment = 0, spread = 0;
  for (let i = begin; i < end; i++) if (known(rates[i])) { moment += (i - centre) * (rates[i] - mean); spread += (i - centre) ** 2; }
  const slope = values < length ? moment / spread : 0, x = new Float64Array(length + 1), missing = new Uint32Array(length + 1);
  for (let i = begin, k = 0; i < end; i++, k++) {
    x[k + 1] = x[k] + (known(rates[i]) ? rates[i] - mean - slope * (i - centre) : 0);
    missing[k + 1] = missing[k] + (known(rates[i]) ? 0 : 1);
  }
  return { x, slope, missing, values, length };
}

/** The Allan deviation at cluster size m if each cluster lacks at most `most` values; the number of its pairs, and of complete pairs. */
function measure({ x, slope, missing, length }, m, most) {
  let squares = 0, differences = 0, all = 0, terms = 0, complete = 0, clusters = 0;  // differences from the line
  for (let j = 0; j + 2 * m <= length; j++) {
    all += x[j + 2 * m] - 2 * x[j + m] + x[j];
    const first = missing[j + m] - missing[j], second = missing[j + 2 * m] - missing[j + m];
    if (first + second === 0) complete++;
    if (Math.max(first, second) > most) continue;
    const a = m / (m - first), b = m / (m - second);
    const d = Math.sqrt(2 / (a + b)) * (b * (x[j + 2 * m] - x[j + m]) - a * (x[j + m] - x[j]));
    squares += d * d;
    differences += d;
    terms++;
  }
  for (let k = 0; (k + 1) * m <= length; k++) if (missing[(k + 1) * m] - missing[k * m] <= most) clusters++;
  const mean = slope * m * m + all / (length - 2 * m + 1);
  const sum = Math.max(0, squares - differences ** 2 / terms) + terms * mean ** 2;
  return { terms, complete, clusters, deviation: Math.sqrt(sum / (2 * terms)) / m };
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
  const phase = phaseOf(rates);
  if (phase.values < 3 || !(tau0_s > 0)) return [];
  const points = [];
  for (const m of sizes ?? clusterSizes(rates.length)) {
    let found = measure(phase, m, 0);
    if (m >= 4 && 10 * found.complete < 9 * (phase.length - 2 * m + 1)) found = measure(phase, m, Math.floor(m / 4));
    if (found.terms > 0) points.push({ m, tau_s: m * tau0_s, deviation: found.deviation, clusters: found.clusters });
  }
  return points;
}
