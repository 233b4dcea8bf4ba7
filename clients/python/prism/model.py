# SPDX-License-Identifier: MIT
"""Predictions of a model file, as prismd computes them (docs/formats.md, docs/compensation.md). Needs numpy."""

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
        except (KeyError, TypeError, ValueError) as why:
            raise ValueError(f"{path}: {why}" + " is missing" * isinstance(why, KeyError)) from None

    def _read(self, file):
        if file.get("format") != "prism-model" or file.get("version") not in (1, 2, 3):
            raise ValueError(f'found {file.get("format")} {file.get("version")}, expected prism-model 1 to 3')
        if file["features"].get("lag_time_constants_s"):
            raise ValueError("features: found lagged inputs, which were removed: train again, with --response")
        self.kind, self.inputs = file["kind"], [each["name"] for each in file["inputs"]]
        self.features, self.length = file["features"], file["features"]["length_s"]
        self.history = self.length + (self.features["end_mean_s"] if self.features["slope"] == "difference" else 0)
        self.box = np.array([(each.get("min", -1e300), each.get("max", 1e300)) for each in file["inputs"]], float).T
        self.stated = bool(file.get("spread"))  # else a model of version 0.1
        self.spread = dict(nuisance_deg_per_h=0.0, offset_deg_per_h=file.get("sd_deg_per_h", np.nan),
                           noise_deg_per_h=np.nan, factor=1.0) | (file.get("spread") or {})
        self.shift, self.scale, self.target, self.unit, self.constant = 0.0, 1.0, (0.0, 1.0), 1.0, 0.0
        self.trust = self.prior = None
        if self.kind in ("polynomial", "stepwise"):
            terms = {name: [term[name] for term in file["terms"]] for name in ("powers", "coefficient")}
            powers, self.alpha = _array(terms, "powers"), _array(terms, "coefficient")
            self.terms = lambda x: (x[:, None, :] ** powers).prod(axis=2)
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
                own = dict(offset_deg_per_h=0.0, noise_deg_per_h=np.sqrt(self.unit / c), factor=u.get("sd_scale", 1))
                self.spread |= {} if self.stated else own
        v, gram, self.constant = file["variances"], file.get("gram"), file["beta"]
        self.shift, self.scale = _array(norm, "input_shift"), _array(norm, "input_scale")
        self.alpha, centres, length2 = _array(file, "alpha"), _array(file, "centres"), _array(v, "length_squared")
        centres = centres.reshape(-1, len(self.inputs))
        # The kernel k of the products x·x' and the squares |x - x'|² / l².
        kernel = lambda dot, squares: v["smooth"] * np.exp(-squares / 2) + v["linear"] * dot + v["quadratic"] * dot**2
        self.terms = lambda x: kernel(x @ centres.T, ((x[:, None, :] - centres) ** 2 / length2).sum(axis=2))
        self.peak = lambda x: kernel((x**2).sum(axis=1), 0.0)
        if not file["trust"]:
            return self
        self.trust = {"overlap": 1, "relevance": None} | file["trust"]
        if prior := file.get("prior"):
            self.prior = prior["scale"], prior["levels"], [Model.__new__(Model)._read(each) for each in prior["models"]]
        covariance, n = self.terms(centres), len(centres)
        covariance[np.diag_indices(n)] += jitter * v["smooth"] if gram else v["noise"] / _array(file, "weight") + jitter
        if composite and not gram:
            time, run = _array(file, "time_h"), np.array(file["recording"])
            drift = v["nuisance"] * np.exp(-np.abs(time[:, None] - time) / v["nuisance_time_h"]) + v.get("offset", 0)
            covariance += (run[:, None] == run) * drift + v.get("warm_up", 0) * np.outer(np.exp(-time), np.exp(-time))
        # The variance of a prediction is k(x, x) - |f|² + |lift [f; 1]|² with f = factor⁻¹ k.
        self.factor = np.linalg.cholesky(covariance)
        if gram:
            lower = np.zeros((n + 1, n + 1))
            lower[np.tril_indices(n + 1)] = gram
            self.lift = np.linalg.inv(np.linalg.cholesky(lower)) / np.sqrt(c)
        else:
            ones = np.linalg.solve(self.factor, np.ones(n))
            self.lift = np.append(-ones, 1)[None, :] / np.linalg.norm(ones)
        return self

    def _own(self, inputs):
        """Bias without the prior (deg/h), and its variance in units of `unit` (0: the model has none)."""
        bias, variance = np.zeros((2, len(inputs)))
        for part in np.array_split(np.arange(len(inputs)), len(inputs) // 2048 + 1):
            x = (inputs[part] - self.shift) / self.scale
            terms = self.terms(x)
            bias[part] = (terms @ self.alpha + self.constant) * self.target[1] + self.target[0]
            if self.trust:
                f = np.linalg.solve(self.factor, terms.T)
                found = ((self.lift @ np.vstack([f, np.ones(len(x))])) ** 2).sum(axis=0) - self.trust["level"]
                variance[part] = np.maximum(0, found + np.maximum(0, self.peak(x) - (f**2).sum(axis=0)))
        return bias, variance

    def predict_inputs(self, x, extrapolation="preset"):
        """Bias, sd and sd_mean (deg/h), and whether it extrapolates, of inputs of shape (rows, inputs)."""
        x, trust, spread = np.asarray(x, float).reshape(-1, len(self.inputs)), self.trust, self.spread
        (bias, variance), drift, drift_variance, lost = self._own(x), 0.0, 0.0, 0.0
        wide = [name in ("dTdt", "U") for name in self.inputs]
        nearest, width = np.clip(x, *self.box), self.box[1] - self.box[0]
        outside = (np.abs(x - nearest) > (np.where(wide, 0.2, 0.02) if self.stated else 0.0) * width).any(axis=1)
        outside |= variance > (trust["guard"] if trust else 0)
        if self.prior:
            scale, levels, models = self.prior
            inside = [np.clip(x, *model.box) for model in models]
            drifts = [model.predict_inputs(at, "flag")[0] - level for model, at, level in zip(models, inside, levels)]
            drift, drift_variance = scale * np.mean(drifts, axis=0), scale**2 * np.var(drifts, axis=0, ddof=1)
            drift_variance, outside = drift_variance * (1 + 1 / len(models)), outside & (inside != x).any(axis=(0, 2))
        bias, variance = bias + drift, variance * self.unit
        shrink = trust and (extrapolation == "shrink" or (self.kind == "composite" and extrapolation == "preset"))
        if shrink:  # towards the mean; models with a relevance can say more of the edge of their range
            mean, target_variance = self.target[0] + drift, self.target[1] ** 2 + drift_variance
            beyond, unknown = np.abs(x - nearest) / np.where(width > 0, width, np.inf), variance / target_variance
            relevance, slopes = trust["relevance"], [name == "dTdt" or name.endswith("/dt") for name in self.inputs]
            excess = np.sqrt(beyond**2 @ relevance) if relevance else beyond.max(axis=1)
            e, g = np.maximum(excess - 0.15, 0) ** 2, (trust["skill"] + 0.9 * (1 - trust["overlap"]) - 0.1) / 0.5
            edge, w = mean, np.clip(g, 0, 1) / (1 + unknown + (10 if relevance else 20) * e)
            w_edge = w
            if relevance:
                edge, known = self._own(np.where(slopes, x, nearest))
                edge, known, lost = edge + drift, known * self.unit / target_variance, 0.5 * excess * target_variance
                w_edge = np.clip(g, 0, 1) / (1 + known + np.maximum(unknown - known - 5, 0) + e / 2)
            lost += (1 - w_edge) * (target_variance + (edge - mean) ** 2) + (1 - w) * (bias - edge) ** 2
            bias = mean + w_edge * (edge - mean) + w * (bias - edge)
        unseen, noise = (1.25, spread["noise_deg_per_h"] ** 2) if self.stated or shrink else (1, np.nan)
        error = unseen * (variance + spread["nuisance_deg_per_h"] ** 2 + lost) + spread["offset_deg_per_h"] ** 2
        found = np.array([bias, *(spread["factor"] * np.sqrt([error, error + noise]))])
        if extrapolation == "clamp" and outside.any():
            inner = np.array(self.predict_inputs(nearest, "flag")[:3])
            larger = outside & ~(found[1] > inner[1])
            found = np.where([outside, larger, larger], inner, found)
        return *found, outside

    def predict(self, frame, extrapolation="preset", slew_limit=True, max_bias_deg_per_h=100.0):
        """Columns of the log for one-second means; the settings are those of "correction".

        frame: a dict or DataFrame with a log's columns time_s, rate_deg_per_h, temperature_degc, those of the other
        inputs (uhfo_v, NAME_degc …), and, if known, `quality` (an implausible second is not used) and `partial`, in
        order of time. NaN or None: unknown. Returns the columns that the log has of these, as arrays in a dict.
        """
        second, gap = np.rint(np.asarray(frame["time_s"], float)).astype(int), self.features["max_gap_s"]
        column = lambda name: np.asarray(frame[name] if name in frame else np.full(len(second), np.nan), float)
        partial, bad = column("partial") > 0, np.zeros(len(second), bool)
        if "quality" in frame:
            bad = np.char.find(np.asarray(frame["quality"], str), "implausible") >= 0
        names = {"T": "temperature_degc", "U": "uhfo_v"}
        names |= {name: f"{name}_{unit.lower()}" for name, unit in self.features.get("sensors", {}).items()}
        for name, key in names.items():
            if key not in frame and any(name in re.split(r"[-:/]|^d", each) for each in self.inputs + ["T"]):
                raise ValueError(f"frame: found no {key}, expected the column of the input {name}")
        values = {name: np.where(bad | partial, np.nan, column(key)) for name, key in names.items()}
        rate = np.where(bad, np.nan, column("rate_deg_per_h"))
        # All runs on one axis of seconds, each after `history` seconds that are in no run.
        step, before = np.diff(second, prepend=second[:1]), np.append(False, partial)[:-1]
        follows = (step > 0) & (step <= gap + 1)
        same_run = follows & ~partial & ~before
        step = np.where(same_run, step, self.history)
        at, in_run = np.cumsum(step), np.append(0, np.repeat(same_run, step))
        in_run[at] = 1
        full = np.convolve(in_run, np.ones(self.history, int))[at] == self.history
        mean_rate, _ = self._window(at, in_run, np.where(partial, np.nan, rate), self.history)
        settling, known = self._respond(second + 10**9 * np.cumsum(partial), values), {}
        for name, series in values.items():
            known[name], known[f"d{name}/dt"] = self._window(at, in_run, series, gap)
        known["dTdt"] = np.where(full, known["dT/dt"], np.nan)
        known |= {name: known[a] - known[b] for name in self.inputs for a, _, b in [name.partition("-")] if b}
        x = np.array([known[name] for name in self.inputs]).T
        usable, out, outside = full & np.isfinite(x).all(axis=1), np.full((3, len(second)), np.nan), full & False
        *found, outside[usable] = self.predict_inputs(x[usable], extrapolation)
        out[:, usable] = found
        over = usable & ~(np.abs(out[0]) <= max_bias_deg_per_h)
        out[:, over] = np.nan
        limited = self._limit(out[0], second, max_bias_deg_per_h) if slew_limit else full & False
        words = dict(warming=~full, input_missing=full & ~usable, extrapolating=outside & ~over, over_limit=over,
                     settling=full & settling, rate_invalid=~np.isfinite(column("rate_deg_per_h")), implausible=bad,
                     slew_limited=limited)
        quality = np.full(len(second), "", object)
        for word, rows in words.items():
            quality[rows] += "+" + word
        quality = np.array([text[1:] or "good" for text in quality])
        cut = np.flatnonzero(follows & partial & ~before)  # the end of a session has the bias in use
        out[:, cut], quality[cut] = out[:, cut - 1], quality[cut - 1]
        bias, sd, sd_mean = out
        return dict(mean_rate_deg_per_h=mean_rate, mean_temperature_degc=known["T"], slope_degc_per_s=known["dTdt"],
                    mean_uhfo_v=known["U"], bias_deg_per_h=bias, sd_deg_per_h=sd, sd_mean_deg_per_h=sd_mean,
                    corrected_deg_per_h=rate - bias, corrected_mean_deg_per_h=mean_rate - bias, quality=quality)

    def _window(self, at, in_run, values, max_gap):
        """Means and slopes of the windows that end at the seconds `at`; NaN after a gap longer than max_gap."""
        age, dense = np.arange(self.history), np.full(len(in_run), np.nan)
        dense[at] = values
        known, dense = np.isfinite(dense) * 1.0, np.nan_to_num(dense, posinf=0, neginf=0)
        holes = np.convolve(in_run - known, np.ones(max_gap + 1))[: len(dense)] > max_gap

        def sums(first, last):  # count, sum of the ages, sum of the values
            part = (age >= first) & (age < last)
            pairs = (known, part), (known, part * age), (dense, part)
            count, ages, total = (np.convolve(series, weights)[at] for series, weights in pairs)
            return np.where(np.convolve(holes, part & (age < last - max_gap))[at], np.nan, count), ages, total

        with np.errstate(invalid="ignore", divide="ignore"):
            count, ages, total = sums(0, self.length)
            if self.features["slope"] == "difference":
                (n, new, now), (m, old, before) = sums(0, self.history - self.length), sums(self.length, self.history)
                return total / count, (now / n - before / m) / (old / m - new / n)
            products, squares = np.convolve(dense, age)[at], np.convolve(known, age**2)[at]
            return total / count, (ages * total - count * products) / (count * squares - ages**2)

    def _respond(self, time, values):
        """Passes T through its response, in place; returns the rows before it has settled."""
        settling = np.zeros(len(time), bool)
        tau, degc = self.features.get("response_s", {}).get("T", 0), values["T"]
        last = since = -np.inf
        for row in np.flatnonzero(np.isfinite(degc) & (tau > 0)):
            step, now, last = time[row] - last, degc[row], time[row]
            if not 0 < step <= max(self.features["max_gap_s"] + 1, tau // 10):
                body, since = now, last
            else:
                body += (body - now) * np.expm1(-step / tau)
            degc[row], settling[row] = body, last - since < 3 * tau
        return settling

    def _limit(self, bias, second, max_bias):
        """Limits the change of the bias, in place; returns where."""
        span, limited, inputs = 2 * max_bias, np.zeros(len(bias), bool), len(self.inputs)
        if np.ptp(self.box, axis=0).max() < 1e300 and inputs <= 10:
            grid = np.meshgrid(*np.linspace(*self.box, int(min(1024.5 ** (1 / inputs), 65))).T)
            span = np.fmin(span, np.ptp(self.predict_inputs(np.stack(grid, axis=-1), "flag")[0]))
        room = max(1e-6, 4 * span / self.length) * np.diff(second, prepend=second[:1])
        for row in range(1, len(bias)):
            change = bias[row] - bias[row - 1]
            if abs(change) > room[row] > 0:  # after an unknown bias there is no limit
                bias[row], limited[row] = bias[row - 1] + np.sign(change) * room[row], True
        return limited
