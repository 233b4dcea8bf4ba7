// SPDX-License-Identifier: MIT
// Compares prism_predict.c on this machine with values that prismcal computed. Made by prismcal export.
#include <math.h>
#include <stdio.h>

#include "prism_pairs.h"

static prism_state state;

// The number of wrong values; 0: the evaluator computes what prismd computes.
int prism_selftest(void);
int prism_selftest(void) {
  const int seconds = PRISM_HISTORY_S - 1 + PRISM_RAMP;
  int wrong = 0, i, k;
  for (k = 0; k < PRISM_PAIRS; ++k) {
    prism_number inputs[PRISM_INPUTS];
    unsigned flags = 0;
    for (i = 0; i < PRISM_INPUTS; ++i) inputs[i] = (prism_number)prism_pairs[k].inputs[i];
    // Comparing with <= fails also for NAN.
    if (fabs((double)prism_bias(inputs, &flags) - prism_pairs[k].bias) <= PRISM_TOLERANCE && flags == prism_pairs[k].flags)
      continue;
    printf("pair %d of prism_pairs.h differs\n", k);
    ++wrong;
  }
  // A curved ramp of one-second means fills the window.
  prism_reset(&state);
  for (k = 0; k < seconds; ++k) {
    const double degc = PRISM_RAMP_T + PRISM_RAMP_STEP * k * (0.5 + 0.5 * k / seconds);
    const prism_second means = {k, 1, (prism_number)degc, (prism_number)PRISM_RAMP_U};
    const prism_correction found = prism_push(&state, &means);
    const int row = k - (PRISM_HISTORY_S - 1);
    if (row < 0 ? found.flags == PRISM_WARMING : fabs((double)found.bias_deg_per_h - prism_ramp_bias[row]) <= PRISM_TOLERANCE)
      continue;
    printf("second %d of the ramp differs\n", k);
    ++wrong;
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
