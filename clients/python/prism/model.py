# SPDX-License-Identifier: MIT
"""Predictions of a model file, as prismd computes them (docs/formats.md, docs/compensation.md). Needs numpy."""

import itertools
import json
import re

import numpy as np


def _array(file, name):
    values = np.array(file[name], float)
    if not np.isfinite(values).all():
        raise ValueError(f"{name}: found a number that is not finite, expected finite ones")
    return values


class Model:
    """A model file of prism. Errors: ValueError with the place, what was found, and what was expected."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            text = "".join(re.sub(r"^\s*//.*", "", line) for line in file)
        try:
            self._read(json.loads(text, parse_constant=lambda word: float("nan")))
        except KeyError as missing:
            raise ValueError(f"{path}: {missing} is missing") from None
        except (json.JSONDecodeError, TypeError, ValueError) as why:
            raise ValueError(f"{path}: {why}") from None

    def _read(self, file):
        if file.get("format") != "prism-model" or file.get("version") not in (1, 2):
            raise ValueError(f'found {file.get("format")} {file.get("version")}, expected prism-model 1 or 2')
        self.kind, self.features, self.spread = file["kind"], file["features"], file.get("spread")
        self.inputs, f = [each["name"] for each in file["inputs"]], self.features
        self.history = f["length_s"] + (f["end_mean_s"] if f["slope"] == "difference" else 0)
        box = [(each["min"], each["max"]) if "min" in each else (-1e300, 1e300) for each in file["inputs"]]
        self.box = np.array(box, float).T
        self.sd, self.powers, self.prior, self.trust = file.get("sd_deg_per_h", np.nan), None, None, None
        if self.kind in ("polynomial", "stepwise"):
            terms = {name: [term[name] for term in file["terms"]] for name in ("powers", "coefficient")}
            self.powers, self.alpha, self.constant = _array(terms, "powers"), _array(terms, "coefficient"), 0.0
            self.shift, self.scale, self.target, self.unit = 0.0, 1.0, (0.0, 1.0), 0.0
            return self
        if self.kind not in ("lssvm", "ir_lssvm", "sparse_lssvm", "svr", "composite"):
            raise ValueError(f"kind: found {self.kind}, expected a model of prism 0.4")
        norm, composite, c, jitter = file["normalisation"], self.kind == "composite", 1.0, 1e-8
        self.target, self.unit = (norm["target_shift"], norm["target_scale"]), norm["target_scale"] ** 2
        if not composite:  # the same form, with one length
            u, c, jitter = file.get("uncertainty"), file["c"], 0.0
            v = dict(smooth=1.0, length_squared=file["sigma2"], linear=0.0, quadratic=0.0, noise=1 / c)
            file = file | dict(beta=file["b"], variances=v, trust=None)
            if u:
                file |= dict(trust=dict(level=0.0, guard=u["guard_fraction"], skill=1.0), gram=u.get("gram"))
                self.unit *= u["prior_variance"]
                self.own_spread = dict(nuisance_deg_per_h=0.0, offset_deg_per_h=0.0, factor=u.get("sd_scale", 1),
                                       noise_deg_per_h=np.sqrt(self.unit / c))
        v, gram, self.constant = file["variances"], file.get("gram"), file["beta"]
        self.variances = v["smooth"], _array(v, "length_squared"), v["linear"], v["quadratic"]
        self.shift, self.scale = _array(norm, "input_shift"), _array(norm, "input_scale")
        self.centres, self.alpha = _array(file, "centres").reshape(-1, len(self.inputs)), _array(file, "alpha")
        if not file["trust"]:
            return self
        self.trust = {"overlap": 1, "relevance": None} | file["trust"]
        if prior := file.get("prior"):
            models = [Model.__new__(Model)._read(model) for model in prior["models"]]
            self.prior = prior["scale"], prior["levels"], models
        covariance, n = self._terms(self.centres), len(self.centres)
        covariance[np.diag_indices(n)] += jitter * v["smooth"] if gram else v["noise"] / _array(file, "weight") + jitter
        if composite and not gram:
            time, run = _array(file, "time_h"), np.array(file["recording"])
            drift = v["nuisance"] * np.exp(-np.abs(time[:, None] - time) / v["nuisance_time_h"]) + v.get("offset", 0)
            covariance += (run[:, None] == run) * drift + v.get("warm_up", 0) * np.outer(np.exp(-time), np.exp(-time))
        # The variance of a prediction is k(x, x) - |f|^2 + |lift [f; 1]|^2 with f = factor^-1 k.
        self.factor = np.linalg.cholesky(covariance)
        if gram:
            lower = np.zeros((n + 1, n + 1))
            lower[np.tril_indices(n + 1)] = gram
            self.lift = np.linalg.inv(np.linalg.cholesky(lower)) / np.sqrt(c)
        else:
            ones = np.linalg.solve(self.factor, np.ones(n))
            self.lift = np.append(-ones, 1)[None, :] / np.linalg.norm(ones)
        return self

    def _terms(self, x):
        """The terms of which alpha makes the sum: products of powers, or kernel values, of normalised inputs."""
        if self.powers is not None:
            return (x[:, None, :] ** self.powers).prod(axis=2)
        smooth, length2, linear, quadratic = self.variances
        squares, products = ((x[:, None, :] - self.centres) ** 2 / length2).sum(axis=2), x @ self.centres.T
        return smooth * np.exp(-squares / 2) + linear * products + quadratic * products**2

    def _own(self, inputs):
        """Bias without the prior, and its variance in units of the normalised target (0: the model has none)."""
        bias, variance = np.zeros((2, len(inputs)))
        for part in np.array_split(np.arange(len(inputs)), len(inputs) // 2048 + 1):
            x = (inputs[part] - self.shift) / self.scale
            terms = self._terms(x)
            bias[part] = (terms @ self.alpha + self.constant) * self.target[1] + self.target[0]
            if self.trust:
                (smooth, _, linear, quadratic), square = self.variances, (x**2).sum(axis=1)
                f = np.linalg.solve(self.factor, terms.T)
                left = smooth + linear * square + quadratic * square**2 - (f**2).sum(axis=0)
                found = np.maximum(0, left) + ((self.lift @ np.vstack([f, np.ones(len(x))])) ** 2).sum(axis=0)
                variance[part] = np.maximum(0, found - self.trust["level"])
        return bias, variance

    def predict_inputs(self, x, extrapolation="preset"):
        """Bias, sd and sd_mean (deg/h), and whether it extrapolates, of inputs of shape (rows, inputs)."""
        x = np.asarray(x, float).reshape(-1, len(self.inputs))
        bias, variance = self._own(x)
        drift, drift_variance, strange = 0.0, 0.0, True
        if self.prior:
            scale, levels, models = self.prior
            inside = [np.clip(x, *model.box) for model in models]
            drifts = [model.predict_inputs(at, "flag")[0] - level for model, at, level in zip(models, inside, levels)]
            drift, strange = scale * np.mean(drifts, axis=0), (inside != x).any(axis=(0, 2))
            drift_variance = scale**2 * np.var(drifts, axis=0, ddof=1) * (1 + 1 / len(models))
        bias, mean, target_variance = bias + drift, self.target[0] + drift, self.target[1] ** 2 + drift_variance
        wide = [name in ("dTdt", "U") or name.startswith("lag") for name in self.inputs]
        width, nearest = self.box[1] - self.box[0], np.clip(x, *self.box)
        outside = (np.abs(x - nearest) > (np.where(wide, 0.2, 0.02) if self.spread else 0.0) * width).any(axis=1)
        if trust := self.trust:
            outside = (outside | (variance > trust["guard"])) & strange
        variance, lost, spread = variance * self.unit, 0.0, self.spread
        if trust and (extrapolation == "shrink" or (self.kind == "composite" and extrapolation == "preset")):
            spread, relevance = spread or self.own_spread, trust["relevance"]
            beyond = np.abs(x - nearest) / np.where(width > 0, width, np.inf)
            excess = np.sqrt(beyond**2 @ relevance) if relevance else beyond.max(axis=1)
            e, unknown = np.maximum(excess - 0.15, 0) ** 2, variance / target_variance
            g = np.clip((trust["skill"] + 0.9 * (1 - trust["overlap"]) - 0.1) / 0.5, 0, 1)
            w = w_edge = g / (1 + unknown + (10 if relevance else 20) * e)
            edge = mean  # unless the model can say more of the edge of its range
            if relevance:
                slopes = [name == "dTdt" or name.endswith("/dt") for name in self.inputs]
                edge, known = self._own(np.where(slopes, x, nearest))
                edge, known = edge + drift, known * self.unit / target_variance
                w_edge = g / (1 + known + np.maximum(unknown - known - 5, 0) + e / 2)
                lost = 0.5 * excess * target_variance
            lost += (1 - w_edge) * (target_variance + (edge - mean) ** 2) + (1 - w) * (bias - edge) ** 2
            bias = mean + w_edge * (edge - mean) + w * (bias - edge)
        sd, sd_mean = np.full((2, len(x)), np.nan)
        if spread:
            error = 1.25 * (variance + spread["nuisance_deg_per_h"] ** 2 + lost) + spread["offset_deg_per_h"] ** 2
            sd, sd_mean = (spread["factor"] * np.sqrt(error + more) for more in (0, spread["noise_deg_per_h"] ** 2))
        else:
            sd[:] = self.own_spread["factor"] * np.sqrt(variance) if trust else self.sd
        if extrapolation == "clamp" and outside.any():
            inner, inner_sd, inner_mean, _ = self.predict_inputs(nearest, "flag")
            bias, larger = np.where(outside, inner, bias), outside & ~(sd > inner_sd)
            sd, sd_mean = np.where(larger, inner_sd, sd), np.where(larger, inner_mean, sd_mean)
        return bias, sd, sd_mean, outside

    def predict(self, frame, extrapolation="preset", slew_limit=True, max_bias_deg_per_h=100.0):
        """Columns of the log for one-second means; the settings are those of "correction".

        frame: a dict or DataFrame with a log's columns time_s, rate_deg_per_h, temperature_degc, those of the other
        inputs (uhfo_v, NAME_degc …), and, if known, `quality` (an implausible second is not used) and `partial`, in
        order of time. NaN or None: unknown. Returns the columns that the log has of these, as arrays in a dict.
        """
        second, gap = np.rint(np.asarray(frame["time_s"], float)).astype(int), self.features["max_gap_s"]
        empty = np.full(len(second), np.nan)
        column = lambda name: np.asarray(frame[name], float) if name in frame else empty
        partial = column("partial") > 0
        bad = np.char.find(np.asarray(frame["quality"], str), "implausible") >= 0 if "quality" in frame else empty > 0
        names = {"T": "temperature_degc", "U": "uhfo_v"}
        names |= {name: f"{name}_{unit.lower()}" for name, unit in self.features.get("sensors", {}).items()}
        for name, key in names.items():
            if key not in frame and any(name in re.split(r"[-:/]|^d", each) for each in self.inputs + ["T"]):
                raise ValueError(f"frame: found no {key}, expected the column of the input {name}")
        values = {name: np.where(bad | partial, np.nan, column(key)) for name, key in names.items()}
        rate = np.where(bad, np.nan, column("rate_deg_per_h"))
        time = second + 10**9 * np.cumsum(partial)  # a session begins after a long gap
        known = {name: empty.copy() for each in names for name in (each, f"d{each}/dt")}
        mean_rate, full, rows = empty.copy(), empty > 0, np.flatnonzero(~partial)
        step = np.diff(time[rows])
        for run in np.split(rows, np.flatnonzero((step <= 0) | (step > gap + 1)) + 1) if len(rows) else []:
            at = time[run] - time[run[0]]
            full[run] = at + 1 >= self.history
            mean_rate[run], _ = self._window(at, rate[run], self.history)
            for name, series in values.items():
                known[name][run], known[f"d{name}/dt"][run] = self._window(at, series[run], gap)
        lags, settling = self._lags(time, {name: each for name, each in values.items() if name != "U"})
        known |= {"dTdt": np.where(full, known["dT/dt"], np.nan)} | lags
        known |= {name: known[a] - known[b] for name in self.inputs for a, _, b in [name.partition("-")] if b}
        x = np.array([known[name] for name in self.inputs]).T
        usable, out, outside = full & np.isfinite(x).all(axis=1), np.full((3, len(second)), np.nan), empty > 0
        *found, outside[usable] = self.predict_inputs(x[usable], extrapolation)
        out[:, usable] = found
        over = usable & ~(np.abs(out[0]) <= max_bias_deg_per_h)
        out[:, over] = np.nan
        limited = self._limit(out[0], second, max_bias_deg_per_h) if slew_limit else empty > 0
        words = dict(warming=~full, input_missing=full & ~usable, extrapolating=outside & ~over, over_limit=over,
                     settling=full & settling, rate_invalid=~np.isfinite(column("rate_deg_per_h")), implausible=bad,
                     slew_limited=limited)
        quality = np.array(["+".join(itertools.compress(words, row)) or "good" for row in zip(*words.values())])
        step = np.diff(second)
        cut = np.flatnonzero(partial[1:] & ~partial[:-1] & (step > 0) & (step <= gap + 1)) + 1
        out[:, cut], quality[cut] = out[:, cut - 1], quality[cut - 1]  # the end of a session has the bias in use
        bias, sd, sd_mean = out
        return dict(mean_rate_deg_per_h=mean_rate, mean_temperature_degc=known["T"], slope_degc_per_s=known["dTdt"],
                    mean_uhfo_v=known["U"], bias_deg_per_h=bias, sd_deg_per_h=sd, sd_mean_deg_per_h=sd_mean,
                    corrected_deg_per_h=rate - bias, corrected_mean_deg_per_h=mean_rate - bias, quality=quality)

    def _window(self, at, values, max_gap):
        """Means and slopes of the windows that end `at` seconds of a run; NaN after a gap longer than max_gap."""
        length, age, dense = self.features["length_s"], np.arange(self.history), np.full(at[-1] + 1, np.nan)
        dense[at] = values
        known = np.where(np.isfinite(dense), 1.0, 0.0)
        dense = np.where(known, dense, 0)
        holes = np.convolve(1 - known, np.ones(max_gap + 1))[: len(dense)] > max_gap
        over = lambda series, weights: np.convolve(series, weights)[at]

        def mean(first, last):
            part = (age >= first) & (age < last)
            count = np.where(over(holes, part & (age < last - max_gap)), np.nan, over(known, part))
            return over(dense, part) / count, over(known, part * age) / count, count

        with np.errstate(invalid="ignore", divide="ignore"):
            level, centre, count = mean(0, length)
            if self.features["slope"] == "difference":
                (now, new, _), (before, old, _) = mean(0, self.history - length), mean(length, self.history)
                return level, (now - before) / (old - new)
            weight = (age < length) * age
            covariance = centre * level * count - over(dense, weight)
            return level, covariance / (over(known, weight * age) - centre**2 * count)

    def _lags(self, time, values):
        """Value minus EMA of each quantity and time constant, by names of inputs; and the rows before they settle."""
        constants = np.array(self.features.get("lag_time_constants_s", []), float)
        series = np.array(list(values.values()))[:, :, None]  # T first
        lag, settling = np.full((*series.shape[:2], len(constants)), np.nan), np.zeros(len(time), bool)
        mean, age, rows = np.nan, 0, np.flatnonzero(np.isfinite(values["T"])) if len(constants) else []
        for last, row in zip([*rows[:1], *rows], rows):
            step, now = time[row] - time[last], series[:, row]
            if not 0 < step <= max(self.features["max_gap_s"] + 1, constants.min() / 10):
                mean = np.nan * mean
            age = 0 if (np.isnan(mean) & np.isfinite(now)).any() else age + step
            keep = np.exp(-step / constants)
            mean = np.where(np.isnan(mean), now, keep * mean + (1 - keep) * now)
            lag[:, row] = now - mean
            settling[row] = age < 3 * constants.max()
        return {f"lag{i + 1}" + (f":{name}" if name != "T" else ""): lag[k, :, i]
                for k, name in enumerate(values) for i in range(len(constants))}, settling

    def _limit(self, bias, second, max_bias):
        """Limits the change of the bias, in place; returns where."""
        span, limited = 2 * max_bias, np.zeros(len(bias), bool)
        if np.ptp(self.box, axis=0).max() < 1e300 and len(self.inputs) <= 10:
            side = int(min(1024.5 ** (1 / len(self.inputs)), 65))
            grid = np.meshgrid(*np.linspace(*self.box, side).T)
            span = np.fmin(span, np.ptp(self.predict_inputs(np.stack(grid, axis=-1), "flag")[0]))
        most = max(1e-6, 4 * span / self.features["length_s"])
        for row in range(1, len(bias)):
            room, change = most * (second[row] - second[row - 1]), bias[row] - bias[row - 1]
            if abs(change) > room > 0:  # after an unknown bias there is no limit
                bias[row], limited[row] = bias[row - 1] + np.sign(change) * room, True
        return limited
