// SPDX-License-Identifier: MIT
// Compares prism_predict.c on this machine with values that prismcal computed. Made by prismcal export.
#include <stdio.h>

#include "prism_pairs.h"

static prism_state state;

// Comparing with >= fails also for NAN.
static int differs(double found, double expected) {
  const double difference = found > expected ? found - expected : expected - found;
  return !(difference <= PRISM_TOLERANCE);
}

// The number of wrong values; 0: the evaluator computes what prismd computes.
int prism_selftest(void);
int prism_selftest(void) {
  const int seconds = PRISM_HISTORY_S - 1 + PRISM_RAMP;
  int wrong = 0, i, k;
  for (k = 0; k < PRISM_PAIRS; ++k) {
    prism_number inputs[PRISM_INPUTS];
    unsigned flags = 0;
    for (i = 0; i < PRISM_INPUTS; ++i) inputs[i] = (prism_number)prism_pair_inputs[k][i];
    if (differs((double)prism_bias(inputs, &flags), prism_pair_bias[k]) || flags != prism_pair_flags[k]) {
      printf("pair %d of prism_pairs.h differs\n", k);
      ++wrong;
    }
  }
  // A curved ramp of one-second means fills the window.
  prism_reset(&state);
  for (k = 0; k < seconds; ++k) {
    prism_second means;
    prism_correction correction;
    const int expected = k - (PRISM_HISTORY_S - 1);
    means.second = k;
    means.rate_deg_per_h = 1;
    means.temperature_degc = (prism_number)(PRISM_RAMP_T + PRISM_RAMP_STEP * (double)k * (0.5 + 0.5 * (double)k / (double)seconds));
    means.uhfo_v = (prism_number)PRISM_RAMP_U;
    correction = prism_push(&state, &means);
    if (expected < 0 ? correction.flags != PRISM_WARMING : differs((double)correction.bias_deg_per_h, prism_ramp_bias[expected])) {
      printf("second %d of the ramp differs\n", k);
      ++wrong;
    }
  }
  return wrong;
}

#ifndef PRISM_NO_MAIN
int main(void) {
  const int wrong = prism_selftest();
  printf("%d of %d values differ\n", wrong, PRISM_PAIRS + PRISM_HISTORY_S - 1 + PRISM_RAMP);
  return wrong != 0;
}
#endif
