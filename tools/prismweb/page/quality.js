// SPDX-License-Identifier: MIT
// What a quality and a state of the line mean to a person: good, with care, or to be looked at.

/** In words, one for each reason that a quality names (docs/protocol.md). */
const kReasons = {
  good: ["good", "corrected without reservation"],
  warming: ["care", "the window is not full yet: no correction until it is"],
  no_model: ["care", "no model is loaded: nothing is corrected"],
  extrapolating: ["care", "an input is outside of what the model was trained on"],
  fallback: ["care", "the fallback model corrects, as an input of the first one is not known"],
  settling: ["care", "the lag filters have not forgotten how they began"],
  slew_limited: ["care", "the bias is on its way to the model's"],
  no_data: ["bad", "nothing is measured now"],
  rate_invalid: ["bad", "the gyro itself says that its rate is not valid"],
  input_missing: ["bad", "an input of the model is not known"],
  over_limit: ["bad", "the model's bias is beyond the limit of sanity"],
  implausible: ["bad", "a measured value is beyond what its sensor can say or do"],
};
const kRank = { good: 0, care: 1, bad: 2 };
export const kMarks = { good: "●", care: "▲", bad: "■" };

/** "good", "care" or "bad" of a quality such as "warming+no_model". A reason that is not known here is "care". */
export function meaningOfQuality(quality) {
  if (!quality) return "bad";
  return quality
    .split("+")
    .map((reason) => kReasons[reason]?.[0] ?? "care")
    .reduce((worst, meaning) => (kRank[meaning] > kRank[worst] ? meaning : worst), "good");
}

/** The same in words. */
export function wordsOfQuality(quality) {
  if (!quality) return kReasons.no_data[1];
  return quality.split("+").map((reason) => kReasons[reason]?.[1] ?? reason).join("; ");
}

export const meaningOfState = (state) => (state === "receiving" || state === "replaying" ? "good" : "bad");

export const meaningOfSeverity = (severity) => ({ error: "bad", warning: "care" })[severity] ?? "good";

export const worse = (a, b) => (kRank[a] >= kRank[b] ? a : b);
