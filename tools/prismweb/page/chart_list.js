// SPDX-License-Identifier: MIT
// The strip charts of one gyro: series, colours and labels.
export const kCharts = [
  { key: "rate", title: "Rate", unit: "deg/h", tall: true, series: [
    { key: "raw", label: "raw", colour: "--raw" },
    { key: "corrected", label: "corrected", colour: "--corrected", width: 1.8 }] },
  { key: "bias", title: "Applied bias, ± 2 sd", unit: "deg/h", series: [
    { key: "bias", label: "bias", colour: "--bias", band: "sd", times: 2, width: 1.6 }] },
  { key: "temperature", title: "Temperature", unit: "°C", series: [
    { key: "temperature", label: "T", colour: "--temperature" }] },
  { key: "slope", title: "Temperature slope", unit: "°C/s", series: [
    { key: "slope", label: "dT/dt", colour: "--slope" }] },
  { key: "uhfo", title: "UHFO, the high-frequency oscillator", unit: "V", series: [
    { key: "uhfo", label: "U", colour: "--uhfo" }] },
  { key: "line", title: "Line", unit: "frames/s", fromZero: true, series: [
    { key: "samples", label: "samples", colour: "--samples", decimals: 0 },
    { key: "missing", label: "missing", colour: "--bad", pattern: [4, 3], decimals: 0 }] },
];

/** The two averaging times that the rate chart can plot. */
export const kMeans = { window: { raw: "raw", corrected: "corrected" }, second: { raw: "raw_1s", corrected: "corrected_1s" } };

export const kSpans = [[60, "1 min"], [300, "5 min"], [1200, "20 min"], [3600, "1 h"], [21600, "6 h"], [86400, "24 h"], [604800, "7 d"], [2592000, "30 d"], [31536000, "365 d"]];
