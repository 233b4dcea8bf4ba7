// SPDX-License-Identifier: MIT
// Made by prismcal export: the same text for every model. prism_predict.h has the contract.
#define PRISM_TABLES
#include "prism_predict.h"

#include <math.h>

#if PRISM_FLOAT
#define PRISM_EXP expf
#else
#define PRISM_EXP exp
#endif

static int is_known(prism_number value) { return value > -PRISM_HUGE && value < PRISM_HUGE; }

static int slot_of(int64_t second) {
  const int slot = (int)(second % PRISM_HISTORY_S);
  return slot < 0 ? slot + PRISM_HISTORY_S : slot;
}

// Mean of the known values in [first, last], minus `origin`: differences keep the digits of a float.
typedef struct {
  prism_number mean, time_s;  // time_s: of the known values, relative to last
  int64_t longest_gap_s;
} span;

static span span_of(const prism_number *values, int64_t first, int64_t last, prism_number origin) {
  span result = {(prism_number)NAN, 0, 0};
  prism_number sum = 0;
  int64_t next = first, times = 0, second;
  int count = 0;
  for (second = first; second <= last + 1; ++second) {
    const int end = second > last;
    const prism_number value = end ? 0 : values[slot_of(second)];
    if (!is_known(value)) continue;
    if (second - next > result.longest_gap_s) result.longest_gap_s = second - next;
    if (end) break;
    sum += value - origin;
    times += second - last;
    ++count;
    next = second + 1;
  }
  if (count == 0) return result;
  result.mean = sum / (prism_number)count;
  result.time_s = (prism_number)times / (prism_number)count;
  return result;
}

static prism_number mean_of(const prism_number *values, int64_t first, int64_t last) {
  const prism_number newest = values[slot_of(last)], origin = is_known(newest) ? newest : 0;
  const span all = span_of(values, first, last, origin);
  return all.longest_gap_s > PRISM_MAX_GAP_S ? (prism_number)NAN : all.mean + origin;
}

static prism_number slope_of(const prism_number *values, int64_t last) {
  const int64_t first = last - PRISM_LENGTH_S + 1;
  const prism_number newest = values[slot_of(last)], origin = is_known(newest) ? newest : 0;
#if PRISM_LEAST_SQUARES
  const span all = span_of(values, first, last, origin);
  prism_number covariance = 0, variance = 0;
  int64_t second;
  if (all.longest_gap_s > PRISM_MAX_GAP_S) return (prism_number)NAN;
  for (second = first; second <= last; ++second) {
    const prism_number value = values[slot_of(second)], dt = (prism_number)(second - last) - all.time_s;
    if (!is_known(value)) continue;
    covariance += dt * (value - origin - all.mean);
    variance += dt * dt;
  }
  return variance > 0 ? covariance / variance : (prism_number)NAN;
#else
  const span now = span_of(values, last - PRISM_END_MEAN_S + 1, last, origin);
  const span before = span_of(values, first - PRISM_END_MEAN_S, first - 1, origin);
  if (now.longest_gap_s > PRISM_MAX_GAP_S || before.longest_gap_s > PRISM_MAX_GAP_S) return (prism_number)NAN;
  return (now.mean - before.mean) / ((prism_number)PRISM_LENGTH_S + now.time_s - before.time_s);
#endif
}

#if PRISM_LAGS > 0
// T - EMA(T). The filters restart after a gap that hides the past.
static void update_lags(prism_state *state, const prism_second *means) {
  const int64_t step = means->second - state->lag_second;
  const double temperature = (double)means->temperature_degc;
  int i;
  if (state->lag_age_s < 0 || step <= 0 || (double)step > PRISM_LAG_BRIDGE_S) {
    for (i = 0; i < PRISM_LAGS; ++i) state->lag_mean_degc[i] = temperature;
    state->lag_age_s = 0;
  } else {
    state->lag_age_s += step;
    for (i = 0; i < PRISM_LAGS; ++i) {
      const double keep = exp(-(double)step / prism_lag_s[i]);
      state->lag_mean_degc[i] = keep * state->lag_mean_degc[i] + (1 - keep) * temperature;
    }
  }
  state->lag_second = means->second;
}
#endif

static void forget(prism_state *state) {
  int i;
  for (i = 0; i < PRISM_HISTORY_S; ++i) {
    state->temperature_degc[i] = (prism_number)NAN;
#if PRISM_USES_UHFO
    state->uhfo_v[i] = (prism_number)NAN;
#endif
  }
  state->published_deg_per_h = (prism_number)NAN;
  state->started = 0;
}

void prism_reset(prism_state *state) {
  forget(state);
  state->second = state->warm_since = state->published_second = 0;
#if PRISM_LAGS > 0
  state->lag_second = 0;
  state->lag_age_s = -1;
#endif
}

// Stores the second; values that are not known are NAN. A gap above PRISM_MAX_GAP_S or a step back empties the window.
static void store(prism_state *state, const prism_second *means) {
  const int64_t step = means->second - state->second;
  int64_t second;
  if (state->started && (step <= 0 || step - 1 > PRISM_MAX_GAP_S)) forget(state);
  if (!state->started) {
    state->warm_since = means->second;
  } else {
    for (second = state->second + 1; second < means->second; ++second) {
      state->temperature_degc[slot_of(second)] = (prism_number)NAN;
#if PRISM_USES_UHFO
      state->uhfo_v[slot_of(second)] = (prism_number)NAN;
#endif
    }
  }
  state->started = 1;
  state->second = means->second;
  state->temperature_degc[slot_of(means->second)] = means->temperature_degc;
#if PRISM_USES_UHFO
  state->uhfo_v[slot_of(means->second)] = means->uhfo_v;
#endif
#if PRISM_LAGS > 0
  if (is_known(means->temperature_degc)) update_lags(state, means);
#endif
}

static prism_number input_of(const prism_state *state, const prism_second *means, int64_t first, int input) {
  (void)means;
  switch (prism_input[input]) {
    case PRISM_INPUT_T:
      return mean_of(state->temperature_degc, first, means->second);
    case PRISM_INPUT_SLOPE:
      return slope_of(state->temperature_degc, means->second);
#if PRISM_USES_UHFO
    case PRISM_INPUT_U:
      return mean_of(state->uhfo_v, first, means->second);
#endif
    default:
#if PRISM_LAGS > 0
      if (is_known(means->temperature_degc))
        return (prism_number)((double)means->temperature_degc - state->lag_mean_degc[prism_input[input] - PRISM_INPUT_LAG1]);
#endif
      return (prism_number)NAN;
  }
}

// The inputs themselves, or the nearest point of the training range.
static void limit(const prism_number inputs[PRISM_INPUTS], prism_number at[PRISM_INPUTS], unsigned *flags) {
  int i;
  for (i = 0; i < PRISM_INPUTS; ++i) at[i] = inputs[i];
#if PRISM_HAS_RANGE
  for (i = 0; i < PRISM_INPUTS; ++i) {
    if (inputs[i] < prism_low[i] || inputs[i] > prism_high[i]) *flags |= PRISM_EXTRAPOLATING;
  }
#if PRISM_CLAMP
  if (!(*flags & PRISM_EXTRAPOLATING)) return;
  for (i = 0; i < PRISM_INPUTS; ++i) {
    if (at[i] < prism_min[i]) at[i] = prism_min[i];
    if (at[i] > prism_max[i]) at[i] = prism_max[i];
  }
#endif
#else
  (void)flags;
#endif
}

#if PRISM_CENTRES > 0
// ((sum of weight exp(-gamma |z - centre|^2)) + linear x + x quadratic x + constant) target_scale + target_shift, with
// x = (input - shift) / scale and z = x factor. Sums in double.
static prism_number model_of(const prism_number at[PRISM_INPUTS]) {
  prism_number x[PRISM_INPUTS], z[PRISM_INPUTS];
  double sum = 0;
  int i, k;
  for (i = 0; i < PRISM_INPUTS; ++i) {
    x[i] = (at[i] - prism_shift[i]) / prism_scale[i];
    z[i] = x[i] * prism_factor[i];
  }
  for (k = 0; k < PRISM_CENTRES; ++k) {
    prism_number square = 0;
    for (i = 0; i < PRISM_INPUTS; ++i) {
      const prism_number difference = prism_centre[k][i] - z[i];
      square += difference * difference;
    }
    sum += (double)prism_weight[k] * (double)PRISM_EXP(-PRISM_GAMMA * square);
  }
#if PRISM_QUADRATIC
  for (i = 0; i < PRISM_INPUTS; ++i) {
    double row = (double)prism_linear[i];
    for (k = 0; k < PRISM_INPUTS; ++k) row += (double)prism_quadratic[i][k] * (double)x[k];
    sum += row * (double)x[i];
  }
#endif
  return (prism_number)((sum + (double)PRISM_CONSTANT) * (double)PRISM_TARGET_SCALE + (double)PRISM_TARGET_SHIFT);
}
#else
// The sum of coefficient times the product of input ^ power.
static prism_number model_of(const prism_number at[PRISM_INPUTS]) {
  double sum = 0;
  int term, i, power;
  for (term = 0; term < PRISM_TERMS; ++term) {
    prism_number product = prism_coefficient[term];
    for (i = 0; i < PRISM_INPUTS; ++i) {
      for (power = 0; power < prism_power[term][i]; ++power) product *= at[i];
    }
    sum += (double)product;
  }
  return (prism_number)sum;
}
#endif

prism_number prism_bias(const prism_number inputs[PRISM_INPUTS], unsigned *flags) {
  prism_number at[PRISM_INPUTS];
  limit(inputs, at, flags);
  return model_of(at);
}

// The bias of the window, or NAN with its reason in flags.
static prism_number window_bias(const prism_state *state, const prism_second *means, unsigned *flags) {
  prism_number inputs[PRISM_INPUTS], bias;
  const int64_t first = means->second - PRISM_LENGTH_S + 1;
  int i;
  if (means->second - state->warm_since + 1 < PRISM_HISTORY_S) {
    *flags |= PRISM_WARMING;
    return (prism_number)NAN;
  }
#if PRISM_LAGS > 0
  if (is_known(means->temperature_degc) && (double)state->lag_age_s < PRISM_LAG_SETTLED_S) *flags |= PRISM_SETTLING;
#endif
  for (i = 0; i < PRISM_INPUTS; ++i) {
    inputs[i] = input_of(state, means, first, i);
    if (is_known(inputs[i])) continue;
    *flags |= PRISM_INPUT_MISSING;
    return (prism_number)NAN;
  }
  bias = prism_bias(inputs, flags);
  if (bias >= -PRISM_MAX_BIAS && bias <= PRISM_MAX_BIAS) return bias;
  *flags = (*flags & PRISM_SETTLING) | PRISM_OVER_LIMIT;
  return (prism_number)NAN;
}

// Limits the change since the last published bias.
static prism_number follow(prism_state *state, prism_number wanted, int64_t second, unsigned *flags) {
  prism_number bias = wanted;
  if (is_known(wanted) && is_known(state->published_deg_per_h)) {
    const prism_number most = PRISM_MAX_SLEW * (prism_number)(second - state->published_second);
    if (bias > state->published_deg_per_h + most) bias = state->published_deg_per_h + most;
    if (bias < state->published_deg_per_h - most) bias = state->published_deg_per_h - most;
    if (bias < wanted || bias > wanted) *flags |= PRISM_SLEW_LIMITED;
  }
  state->published_deg_per_h = bias;
  state->published_second = second;
  return bias;
}

prism_correction prism_push(prism_state *state, const prism_second *means) {
  prism_correction correction = {0, 0, 0};
  prism_number wanted;
  store(state, means);
  wanted = window_bias(state, means, &correction.flags);
  correction.bias_deg_per_h = follow(state, wanted, means->second, &correction.flags);
  correction.corrected_deg_per_h = (prism_number)NAN;
  if (is_known(means->rate_deg_per_h))
    correction.corrected_deg_per_h = means->rate_deg_per_h - correction.bias_deg_per_h;
  else
    correction.flags |= PRISM_RATE_INVALID;
  return correction;
}
