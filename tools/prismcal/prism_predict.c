// SPDX-License-Identifier: MIT
// Made by prismcal export: the same text for every model. prism_predict.h has the contract.
#define PRISM_TABLES
#include "prism_predict.h"

#include <math.h>
#include <string.h>

static int is_known(prism_number value) { return value > -(prism_number)1e30 && value < (prism_number)1e30; }

// Means are taken relative to the newest value: differences keep the digits of a float.
static prism_number origin_of(const prism_number *values) { return is_known(values[0]) ? values[0] : 0; }

typedef struct {
  prism_number value, age_s;
} point;

// Mean of the known values from age `first` on, minus origin_of(values), and of their ages; NAN after a gap.
static point mean_of(const prism_number *values, int first, int seconds) {
  const prism_number origin = origin_of(values);
  point mean = {0, 0};
  int age, known = 0, gap = 0, longest_gap = 0;
  for (age = first; age < first + seconds; ++age) {
    gap = is_known(values[age]) ? 0 : gap + 1;
    if (gap > longest_gap) longest_gap = gap;
    if (gap > 0) continue;
    mean.value += values[age] - origin;
    mean.age_s += (prism_number)age;
    ++known;
  }
  mean.value = longest_gap > PRISM_MAX_GAP_S ? (prism_number)NAN : mean.value / (prism_number)known;
  mean.age_s /= (prism_number)known;
  return mean;
}

static prism_number slope_of(const prism_number *values) {
#if PRISM_LEAST_SQUARES
  const point mean = mean_of(values, 0, PRISM_LENGTH_S);
  prism_number covariance = 0, variance = 0;
  int age;
  for (age = 0; age < PRISM_LENGTH_S; ++age) {
    const prism_number dt = mean.age_s - (prism_number)age;
    if (!is_known(values[age])) continue;
    covariance += dt * (values[age] - origin_of(values) - mean.value);
    variance += dt * dt;
  }
  return covariance / variance;
#else
  const point now = mean_of(values, 0, PRISM_END_MEAN_S), before = mean_of(values, PRISM_LENGTH_S, PRISM_END_MEAN_S);
  return (now.value - before.value) / (before.age_s - now.age_s);
#endif
}

void prism_reset(prism_state *state) { memset(state, 0, sizeof *state); }

// The body's temperature: a first-order response to the thermometer's, which restarts after a gap that hides the past.
static prism_number body_degc(prism_state *state, const prism_second *means) {
  const int64_t step = means->second - state->body_second;
  const double degc = (double)means->temperature_degc;
  if (PRISM_RESPONSE_S == 0 || !is_known(means->temperature_degc)) return means->temperature_degc;
  if (state->body_history_s == 0 || step <= 0 || step > PRISM_RESPONSE_BRIDGE_S) {
    state->body_degc = degc;
    state->body_history_s = 1;
  } else {
    state->body_degc += (state->body_degc - degc) * expm1(-(double)step / (double)PRISM_RESPONSE_S);
    state->body_history_s += step;
  }
  state->body_second = means->second;
  return (prism_number)state->body_degc;
}

static int is_body_settling(const prism_state *state) {
  return PRISM_RESPONSE_S > 0 && state->body_history_s <= PRISM_RESPONSE_SETTLED_S;
}

// Stores the second. A gap above PRISM_MAX_GAP_S or a step back empties the window. Returns the step from the last one.
static int64_t store(prism_state *state, const prism_second *means) {
  const prism_number now[2] = {body_degc(state, means), means->uhfo_v};
  const int64_t step = means->second - state->second;
  const int restart = state->history_s == 0 || step <= 0 || step > PRISM_MAX_GAP_S + 1;
  const int shift = restart ? PRISM_HISTORY_S : (int)step;
  int quantity, age;
  for (quantity = 0; quantity < PRISM_QUANTITIES; ++quantity) {
    prism_number *const values = state->value[quantity];
    for (age = PRISM_HISTORY_S - 1; age > 0; --age) values[age] = age < shift ? (prism_number)NAN : values[age - shift];
    values[0] = now[quantity];
  }
  if (restart) state->published_deg_per_h = (prism_number)NAN;
  state->history_s = restart ? 1 : state->history_s + step;
  state->second = means->second;
  return step;
}

// The input of a code of prism_input: means of temperature and UHFO voltage, slope.
static prism_number input_of(const prism_state *state, int code) {
  if (code >= PRISM_QUANTITIES) return slope_of(state->value[0]);
  return mean_of(state->value[code], 0, PRISM_LENGTH_S).value + origin_of(state->value[code]);
}

// (sum of weight exp(-|z - centre|^2)) + (sum of coefficient times the product of z ^ power), with
// z = (input - shift) / scale. The sum is in double.
prism_number prism_bias(const prism_number inputs[PRISM_INPUTS], unsigned *flags) {
  prism_number z[PRISM_INPUTS];
  double sum = 0;
  int i, k, power, outside = 0;
  for (i = 0; i < PRISM_INPUTS; ++i) {
    const prism_number room = prism_margin[i] * (prism_max[i] - prism_min[i]);
    if (inputs[i] < prism_min[i] - room || inputs[i] > prism_max[i] + room) outside = 1;
  }
  if (outside) *flags |= PRISM_EXTRAPOLATING;
  for (i = 0; i < PRISM_INPUTS; ++i) {
    z[i] = inputs[i];
    if (PRISM_CLAMP && outside && z[i] < prism_min[i]) z[i] = prism_min[i];
    if (PRISM_CLAMP && outside && z[i] > prism_max[i]) z[i] = prism_max[i];
    z[i] = (z[i] - prism_shift[i]) / prism_scale[i];
  }
#if PRISM_CENTRES > 0
  for (k = 0; k < PRISM_CENTRES; ++k) {
    prism_number square = 0;
    for (i = 0; i < PRISM_INPUTS; ++i) {
      const prism_number difference = prism_centre[k * PRISM_INPUTS + i] - z[i];
      square += difference * difference;
    }
    sum += (double)prism_weight[k] * (double)PRISM_EXP(-square);
  }
#endif
  for (k = 0; k < PRISM_TERMS; ++k) {
    prism_number product = prism_coefficient[k];
    for (i = 0; i < PRISM_INPUTS; ++i) {
      for (power = 0; power < prism_power[k * PRISM_INPUTS + i]; ++power) product *= z[i];
    }
    sum += (double)product;
  }
  return (prism_number)sum;
}

// The bias of the window, or NAN with its reason in flags.
static prism_number window_bias(const prism_state *state, unsigned *flags) {
  prism_number inputs[PRISM_INPUTS], bias;
  int i;
  if (state->history_s < PRISM_HISTORY_S) {
    *flags |= PRISM_WARMING;
    return (prism_number)NAN;
  }
  if (is_known(state->value[0][0]) && is_body_settling(state)) *flags |= PRISM_SETTLING;
  for (i = 0; i < PRISM_INPUTS; ++i) {
    inputs[i] = input_of(state, prism_input[i]);
    if (is_known(inputs[i])) continue;
    *flags |= PRISM_INPUT_MISSING;
    return (prism_number)NAN;
  }
  bias = prism_bias(inputs, flags);
  if (bias >= -PRISM_MAX_BIAS && bias <= PRISM_MAX_BIAS) return bias;
  *flags = (*flags & PRISM_SETTLING) | PRISM_OVER_LIMIT;
  return (prism_number)NAN;
}

prism_correction prism_push(prism_state *state, const prism_second *means) {
  prism_correction correction = {0, 0, 0};
  const prism_number most = (prism_number)PRISM_MAX_SLEW * (prism_number)store(state, means);
  const prism_number wanted = window_bias(state, &correction.flags), last = state->published_deg_per_h;
  prism_number bias = wanted;
  if (is_known(last) && bias > last + most) bias = last + most;
  if (is_known(last) && bias < last - most) bias = last - most;
  if (bias < wanted || bias > wanted) correction.flags |= PRISM_SLEW_LIMITED;
  state->published_deg_per_h = correction.bias_deg_per_h = bias;
  correction.corrected_deg_per_h = (prism_number)NAN;
  if (is_known(means->rate_deg_per_h))
    correction.corrected_deg_per_h = means->rate_deg_per_h - bias;
  else
    correction.flags |= PRISM_RATE_INVALID;
  return correction;
}
