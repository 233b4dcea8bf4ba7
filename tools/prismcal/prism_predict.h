// SPDX-License-Identifier: MIT
// Bias of a laser gyro from its one-second means, as prismd computes it. C99; needs a libm. Made by prismcal export.
//
// No allocation, no recursion, no file-scope state. RAM: sizeof(prism_state) for each gyro; stack: at most 512 bytes and that
// of exp(). Operations for each second: three passes over the window (PRISM_HISTORY_S values of each quantity); for each
// of PRISM_CENTRES an exponential and 3 PRISM_INPUTS + 2 multiplications and additions; for each of PRISM_TERMS, at most
// 9 PRISM_INPUTS. Do not compile with -ffast-math: unknown values are NAN.
#ifndef PRISM_PREDICT_H
#define PRISM_PREDICT_H

#include <stdint.h>

#include "prism_model.h"

// Flags; the names and values of prismd's quality.
#define PRISM_WARMING 1u         // the window is not yet full: no bias
#define PRISM_INPUT_MISSING 4u   // an input is unknown: no bias
#define PRISM_EXTRAPOLATING 8u   // an input is outside the training range
#define PRISM_OVER_LIMIT 32u     // the bias was above PRISM_MAX_BIAS: no bias
#define PRISM_SETTLING 64u       // the body's temperature has not settled since the start
#define PRISM_RATE_INVALID 128u  // the rate is unknown: no corrected rate
#define PRISM_SLEW_LIMITED 1024u // the change since the last second was limited

// Means over the samples of one second; NAN: unknown. Leave out implausible samples. Do not push a second of which only a
// part was measured, or without a sample: a gap of at most PRISM_MAX_GAP_S is bridged.
typedef struct {
  int64_t second;  // counts seconds; any origin
  prism_number rate_deg_per_h, temperature_degc, uhfo_v;
} prism_second;

typedef struct {
  prism_number bias_deg_per_h;       // NAN: unknown
  prism_number corrected_deg_per_h;  // rate - bias; NAN: one of them is unknown
  unsigned flags;                    // 0: good
} prism_correction;

// Of one gyro. Only for the functions below.
typedef struct {
  prism_number value[PRISM_QUANTITIES][PRISM_HISTORY_S];  // temperature, UHFO voltage; by age, s; NAN: unknown
  int64_t second, history_s;                              // of the last push, and seconds of the window until then
  double body_degc;                                       // after the response; a float would lose small steps
  int64_t body_second, body_history_s;                    // of the response, as for the window; 0: not started
  prism_number published_deg_per_h;                       // NAN: the next bias is not limited
} prism_state;

// At the start of each session of the gyro.
void prism_reset(prism_state *state);

// Takes the seconds in order of time. The bias is that of the window that ends with this second.
prism_correction prism_push(prism_state *state, const prism_second *means);

// The model alone, without window and limits. `inputs`: finite, in the order of prism_model.h. Adds PRISM_EXTRAPOLATING to
// flags.
prism_number prism_bias(const prism_number inputs[PRISM_INPUTS], unsigned *flags);

#endif
