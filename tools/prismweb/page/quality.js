// SPDX-License-Identifier: MIT
// Maps a quality, a line state or a severity to one of three levels: good, care (caution) or bad (check).

/** Level and explanation of each reason in a quality (docs/protocol.md). */
const kReasons = {
  good: ["good", "corrected without reservation"],
  warming: ["care", "the averaging window is not full yet; no correction until it is"],
  no_model: ["care", "no model loaded; rates are not corrected"],
  extrapolating: ["care", "an input is outside the model's training range"],
  fallback: ["care", "an input of the main model is unknown; the fallback model corrects"],
  settling: ["care", "the lag filters have not settled after the start"],
  slew_limited: ["care", "the applied bias is moving to the model's value (slew limit)"],
  clocks_differ: ["bad", "frames arrive at another rate than the description says; times and slopes are wrong"],
  no_data: ["bad", "no current measurement"],
  rate_invalid: ["bad", "the gyro reports an invalid rate"],
  input_missing: ["bad", "an input of the model is unknown"],
  over_limit: ["bad", "the model's bias is above the configured limit"],
  implausible: ["bad", "a measured value is implausible for its sensor"],
};
const kRank = { good: 0, care: 1, bad: 2 };
export const kMarks = { good: "●", care: "▲", bad: "■" };

/** "good", "care" or "bad" of a quality such as "warming+no_model". Unknown reasons are "care". */
export function levelOfQuality(quality) {
  if (!quality) return "bad";
  return quality
    .split("+")
    .map((reason) => kReasons[reason]?.[0] ?? "care")
    .reduce((worst, level) => (kRank[level] > kRank[worst] ? level : worst), "good");
}

/** Explanation of a quality, for the user. */
export function textOfQuality(quality) {
  if (!quality) return kReasons.no_data[1];
  return quality.split("+").map((reason) => kReasons[reason]?.[1] ?? reason).join("; ");
}

export const levelOfState = (state) => (state === "receiving" || state === "replaying" ? "good" : "bad");

export const levelOfSeverity = (severity) => ({ error: "bad", warning: "care" })[severity] ?? "good";

export const worse = (a, b) => (kRank[a] >= kRank[b] ? a : b);
