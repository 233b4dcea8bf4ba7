# SPDX-License-Identifier: MIT
"""Predictions of a model file, computed as prismd computes them (docs/formats.md, docs/compensation.md). Needs numpy."""

import json
import re

import numpy as np


def _over(values, at, length):
    """Sums over `length` values that end at each position of `at`."""
    total = np.concatenate([[0], np.cumsum(values)])
    return total[at + 1] - total[at + 1 - length]


class _Windows:
    """Windows that end at the seconds `at` of a series with NaN for unknown values; `inside`: seconds of a run."""

    def __init__(self, series, inside, at, max_gap):
        self.series, self.at, self.known = series, at, np.isfinite(series)
        self.level = np.nanmean(series) if self.known.any() else 0.0
        holes = np.convolve(inside & ~self.known, np.ones(max_gap + 1))[: len(series)] > max_gap
        self.gap = lambda at, length: _over(holes, at, max(0, length - max_gap)) > 0

    def mean(self, length, back=0, gaps=False):
        """Means of values and of their times, `back` seconds before; NaN after a gap unless `gaps`."""
        at = self.at - back
        count = _over(self.known, at, length)
        mean = _over(np.where(self.known, self.series - self.level, 0), at, length) / count + self.level
        time = _over(np.where(self.known, np.arange(len(self.series)), 0), at, length) / count
        return (mean if gaps else np.where(self.gap(at, length), np.nan, mean)), time

    def slope(self, length, ends):
        if ends:
            (now, time), (before, earlier) = self.mean(ends), self.mean(ends, length)
            return (now - before) / (time - earlier)
        where = self.at[:, None] + np.arange(1 - length, 1)
        known, (mean, time) = self.known[where], self.mean(length)
        dt = np.where(known, where - time[:, None], 0)
        return (dt * np.where(known, self.series[where] - mean[:, None], 0)).sum(axis=1) / (dt**2).sum(axis=1)


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
        self.inputs = [each["name"] for each in file["inputs"]]
        box = [(each["min"], each["max"]) for each in file["inputs"] if "min" in each]
        self.box = np.array(box, float).T if box else None
        self.sd, self.trust, self.prior, self.uncertainty = file.get("sd_deg_per_h", np.nan), None, None, None
        numbers = {}

        def array(name, value):
            numbers[name] = np.array(value, float)
            if not np.isfinite(numbers[name]).all():
                raise ValueError(f"{name}: found a number that is not finite, expected finite ones")
            return numbers[name]

        if self.kind in ("polynomial", "stepwise"):
            powers, factors = (array(name, [term[name] for term in file["terms"]]) for name in ("powers", "coefficient"))
            self.polynomial = lambda x: (x[:, None, :] ** powers).prod(axis=2) @ factors
            return
        if self.kind not in ("lssvm", "ir_lssvm", "sparse_lssvm", "svr", "composite"):
            raise ValueError(f"kind: found {self.kind}, expected a model of prism 0.4")
        norm, composite = file["normalisation"], self.kind == "composite"
        self.polynomial, self.target = None, (norm["target_shift"], norm["target_scale"])
        self.shift, self.scale = (array(name, norm[name]) for name in ("input_shift", "input_scale"))
        self.centres = array("centres", file["centres"]).reshape(-1, len(self.inputs))
        self.alpha, self.constant = array("alpha", file["alpha"]), file["beta" if composite else "b"]
        if not composite:
            self.variances = 1.0, np.full(len(self.inputs), file["sigma2"]), 0.0, 0.0
            self.uncertainty = file.get("uncertainty")
            if self.uncertainty:
                gram, self.c, jitter = self.uncertainty.get("gram"), file["c"], 0
                noise = lambda: np.diag(1 / (self.c * array("weight", file["weight"])))
                self._factorise(gram, jitter, noise)
            return
        v, self.c = file["variances"], 1.0
        self.variances = v["smooth"], array("length_squared", v["length_squared"]), v["linear"], v["quadratic"]
        self.trust = {"overlap": 1, "relevance": None} | file["trust"]
        if prior := file.get("prior"):
            self.prior = prior["scale"], [Model.__new__(Model) for _ in prior["models"]], prior["levels"]
            for model, part in zip(self.prior[1], prior["models"]):
                model._read(part)

        def noise():
            time, run = array("time_h", file["time_h"]), np.array(file["recording"])
            drift = v["nuisance"] * np.exp(-np.abs(time[:, None] - time) / v["nuisance_time_h"]) + v.get("offset", 0)
            warm = v.get("warm_up", 0) * np.outer(np.exp(-time), np.exp(-time))
            return (run[:, None] == run) * drift + warm + np.diag(v["noise"] / array("weight", file["weight"]) + 1e-8)

        self._factorise(file.get("gram"), 1e-8 * v["smooth"], noise)

    def _factorise(self, gram, jitter, noise):
        kernel = self._kernel(self.centres)
        self.factor = np.linalg.cholesky(kernel + (jitter * np.eye(len(kernel)) if gram else noise()))
        self.gram, n = None, len(kernel) + 1
        if gram:
            lower = np.zeros((n, n))
            lower[np.tril_indices(n)] = gram
            self.gram = np.linalg.cholesky(lower + np.tril(lower, -1).T)
        self.nu = np.linalg.solve(self.factor.T, np.linalg.solve(self.factor, np.ones(len(kernel))))

    def _kernel(self, x):
        smooth, length2, linear, quadratic = self.variances
        squares = ((x[:, None, :] - self.centres) ** 2 / length2).sum(axis=2)
        products = x @ self.centres.T
        return smooth * np.exp(-squares / 2) + linear * products + quadratic * products**2

    def _variance(self, x, k):
        smooth, _, linear, quadratic = self.variances
        half, square = np.linalg.solve(self.factor, k.T), (x**2).sum(axis=1)
        left = smooth + linear * square + quadratic * square**2 - (half**2).sum(axis=0)
        if self.gram is None:
            return np.maximum(0, left + (1 - k @ self.nu) ** 2 / self.nu.sum())
        phi = np.linalg.solve(self.gram, np.vstack([half, np.ones(half.shape[1])]))
        return np.maximum(0, left) + (phi**2).sum(axis=0) / self.c

    def _own(self, x):
        """Bias without the prior, and its variance in units of the normalised target (None: the model has none)."""
        if self.polynomial:
            return self.polynomial(x), None
        parts = []
        for n in np.array_split((x - self.shift) / self.scale, len(x) // 2048 + 1):
            k = self._kernel(n)
            bias = (k @ self.alpha + self.constant) * self.target[1] + self.target[0]
            parts.append((bias, self._variance(n, k) if self.trust or self.uncertainty else np.zeros(len(n))))
        bias, variance = (np.concatenate(series) for series in zip(*parts))
        return bias, variance if self.trust or self.uncertainty else None

    def bias(self, x):
        """The plain sum of the model, deg/h, of inputs of shape (rows, inputs)."""
        return self._own(x)[0] + self._drift(x)[0]

    def _nearest(self, x):
        return x if self.box is None else np.clip(x, *self.box)

    def _drift(self, x):
        """Of the population prior: its mean and variance, and where one of its gyros is outside its range."""
        if not self.prior:
            return 0.0, 0.0, np.ones(len(x), bool)
        scale, models, levels = self.prior
        drift = np.array([model.bias(model._nearest(x)) - level for model, level in zip(models, levels)])
        outside = np.any([(model._nearest(x) != x).any(axis=1) for model in models], axis=0)
        return scale * drift.mean(axis=0), scale**2 * drift.var(axis=0, ddof=1) * (1 + 1 / len(models)), outside

    def _beyond(self, x):
        """Distance of each input outside its range, in ranges."""
        if self.box is None:
            return np.zeros(x.shape)
        span = self.box[1] - self.box[0]
        return np.maximum(0, np.maximum(self.box[0] - x, x - self.box[1])) / np.where(span > 0, span, 1e-300)

    def predict_inputs(self, x, extrapolation="preset"):
        """Bias, sd and sd_mean (deg/h), and whether it extrapolates, of inputs of shape (rows, inputs)."""
        x = np.asarray(x, float).reshape(-1, len(self.inputs))
        bias, variance = self._own(x)
        beyond, none, composite, spread = self._beyond(x), np.zeros(len(x)), bool(self.trust), self.spread
        wide = [name in ("dTdt", "U") or name.startswith("lag") for name in self.inputs]
        outside = (beyond > (np.where(wide, 0.2, 0.02) if spread else 0)).any(axis=1)
        sd, sd_mean, lost, edge, excess = none + self.sd, none + np.nan, none, None, beyond.max(axis=1)
        skill, overlap, mean, target_variance = 1.0, 1.0, 0.0, 1.0
        if not self.polynomial:
            mean, target_variance = self.target[0], self.target[1] ** 2
        if composite:
            t, square = self.trust, self.target[1] ** 2
            drift, drift_variance, strange = self._drift(x)
            variance = np.maximum(0, variance - t["level"])
            outside = (outside | (variance > t["guard"])) & strange
            bias, mean, variance, target_variance = bias + drift, mean + drift, variance * square, square + drift_variance
            skill, overlap = t["skill"], t["overlap"]
            if t["relevance"]:
                excess = np.sqrt((beyond**2 * t["relevance"]).sum(axis=1))
                slopes = [name == "dTdt" or name.endswith("/dt") for name in self.inputs]
                own, own_variance = self._own(np.where(slopes, x, self._nearest(x)))
                edge = own + drift, np.maximum(0, own_variance - t["level"]) * square
        elif self.uncertainty:
            u, factor = self.uncertainty, self.uncertainty.get("sd_scale", 1)
            outside |= variance > u["guard_fraction"]
            variance = variance * u["prior_variance"] * target_variance
            sd = np.sqrt(variance) * factor
            if not spread and extrapolation == "shrink":
                noise = np.sqrt(u["prior_variance"] * target_variance / self.c)
                spread = dict(nuisance_deg_per_h=0, offset_deg_per_h=0, factor=factor, noise_deg_per_h=noise)
        if variance is not None and (extrapolation == "shrink" or (composite and extrapolation == "preset")):
            e, unknown = np.maximum(excess - 0.15, 0) ** 2, variance / target_variance
            g = np.clip((skill + 0.9 * (1 - overlap) - 0.1) / 0.5, 0, 1)
            if edge is None:
                w = g / (1 + unknown + 20 * e)
                lost = (1 - w) * (target_variance + (bias - mean) ** 2)
                bias = mean + w * (bias - mean)
            else:
                far = np.maximum(unknown - edge[1] / target_variance - 5, 0)
                wb, wf = g / (1 + edge[1] / target_variance + far + e / 2), g / (1 + unknown + 10 * e)
                to_edge, on = edge[0] - mean, bias - edge[0]
                lost = (1 - wb) * (target_variance + to_edge**2) + (1 - wf) * on**2 + 0.5 * excess * target_variance
                bias = mean + wb * to_edge + wf * on
        if spread:
            own = 1.25 * ((0 if variance is None else variance) + spread["nuisance_deg_per_h"] ** 2 + lost)
            whole = own + spread["offset_deg_per_h"] ** 2
            sd, sd_mean = (spread["factor"] * np.sqrt(whole + more) for more in (0, spread["noise_deg_per_h"] ** 2))
        if extrapolation == "clamp" and outside.any():
            inner, inner_sd, inner_mean, _ = self.predict_inputs(self._nearest(x), "flag")
            larger = outside & ~(sd > inner_sd)
            bias = np.where(outside, inner, bias)
            sd, sd_mean = np.where(larger, inner_sd, sd), np.where(larger, inner_mean, sd_mean)
        return bias, sd, sd_mean, outside

    def predict(self, frame, extrapolation="preset", slew_limit=True, max_bias_deg_per_h=100.0):
        """Columns of the log for one-second means; the settings are those of "correction".

        frame: a dict or DataFrame of equally long columns of a log, in order of time: time_s, rate_deg_per_h (deg/h),
        temperature_degc, uhfo_v (V) if the model uses it, NAME_degc … of its sensors; if present, also `quality` (the
        values of an implausible second are not used) and `partial`. NaN or None: unknown.
        Returns a dict of arrays of that length: mean_rate_deg_per_h, mean_temperature_degc, slope_degc_per_s,
        mean_uhfo_v, bias_deg_per_h, sd_deg_per_h, sd_mean_deg_per_h, corrected_deg_per_h, corrected_mean_deg_per_h
        (NaN: none) and quality.
        """
        f, second = self.features, np.rint(np.asarray(frame["time_s"], float)).astype(int)
        count, gap, length, empty = len(second), f["max_gap_s"], f["length_s"], np.full(len(second), np.nan)
        ends = f["end_mean_s"] if f["slope"] == "difference" else 0
        column = lambda name: np.asarray(frame[name], float) if name in frame else empty
        partial = column("partial") > 0
        bad = np.char.find(np.asarray(frame["quality"], str), "implausible") >= 0 if "quality" in frame else empty > 0
        names = {name: f"{name}_{unit.lower()}" for name, unit in f.get("sensors", {}).items()}
        names |= {"T": "temperature_degc", "U": "uhfo_v"}
        for name, key in names.items():
            if key not in frame and any(name in re.split(r"[-:/]|^d", each) for each in self.inputs + ["T"]):
                raise ValueError(f"frame: found no {key}, expected the column of the input {name}")
        values = {name: np.where(bad | partial, np.nan, column(key)) for name, key in names.items()}
        rate = np.where(bad, np.nan, column("rate_deg_per_h"))
        # The seconds of all runs on one axis, each run after as many unknown seconds as a window has.
        rows, history = np.flatnonzero(~partial), length + ends
        step = np.diff(second[rows], prepend=0)
        new = (np.diff(rows, prepend=-9) > 1) | (step <= 0) | (step > gap + 1)
        at = np.cumsum(np.where(new, history + 1, step)) + 1
        age = at - np.maximum.accumulate(np.where(new, at, 0))
        inside = np.ones(at[-1] + 1 if len(at) else 1, bool)
        for begin in at[new]:
            inside[begin - history : begin] = False

        def at_rows(found):
            out = empty.copy()
            out[rows] = found
            return out

        def windows(series):
            dense = np.full(len(inside), np.nan)
            dense[at] = series[rows]
            return _Windows(dense, inside, at, gap)

        with np.errstate(invalid="ignore", divide="ignore"):
            window = {name: windows(series) for name, series in values.items()}
            mean_rate = at_rows(windows(rate).mean(length, gaps=True)[0])
            known = {name: at_rows(each.mean(length)[0]) for name, each in window.items()}
            known["dTdt"] = at_rows(np.where(age + 1 >= history, window["T"].slope(length, ends), np.nan))
            known |= {f"d{name}/dt": at_rows(each.slope(length, ends)) for name, each in window.items() if name != "U"}
            lags, settling = self._lags(second, {name: each for name, each in values.items() if name != "U"}, partial)
            known |= lags
            known |= {name: known[a] - known[b] for name in self.inputs for a, _, b in [name.partition("-")] if b}
        x = np.array([known[name] for name in self.inputs]).T
        full = at_rows(age + 1) >= history
        usable = full & np.isfinite(x).all(axis=1)
        out, outside = [empty.copy() for _ in range(3)], np.zeros(count, bool)
        if usable.any():
            *found, outside[usable] = self.predict_inputs(x[usable], extrapolation)
            for series, part in zip(out, found):
                series[usable] = part
        over = usable & ~(np.abs(out[0]) <= max_bias_deg_per_h)
        for series in out:
            series[over] = np.nan
        limited = self._limit(out[0], second, max_bias_deg_per_h) if slew_limit else outside & False
        words = dict(warming=~full, input_missing=full & ~usable, extrapolating=outside & ~over, over_limit=over,
                     settling=full & settling, rate_invalid=~np.isfinite(column("rate_deg_per_h")), implausible=bad,
                     slew_limited=limited)
        quality = np.array(["+".join(word for word in words if words[word][row]) or "good" for row in range(count)])
        for row in np.flatnonzero(partial[1:]) + 1:  # the end of a session has the bias in use
            if not partial[row - 1] and 0 < second[row] - second[row - 1] <= gap + 1:
                for series in (*out, quality):
                    series[row] = series[row - 1]
        bias, sd, sd_mean = out
        return dict(mean_rate_deg_per_h=mean_rate, mean_temperature_degc=known["T"], slope_degc_per_s=known["dTdt"],
                    mean_uhfo_v=known["U"], bias_deg_per_h=bias, sd_deg_per_h=sd, sd_mean_deg_per_h=sd_mean,
                    corrected_deg_per_h=rate - bias, corrected_mean_deg_per_h=mean_rate - bias, quality=quality)

    def _lags(self, second, values, partial):
        """T − EMA(T) of each time constant and sensor, by the names of the inputs; and the rows before they settle."""
        constants = np.array(self.features.get("lag_time_constants_s", []), float)
        settling, lag = np.zeros(len(second), bool), {name: np.full((len(constants), len(second)), np.nan) for name in values}
        state, age, last = {}, 0, None
        for row in np.flatnonzero(~partial & np.isfinite(values["T"])) if len(constants) else []:
            step = 0 if last is None else second[row] - second[last]
            if not 0 < step <= max(self.features["max_gap_s"] + 1, constants.min() / 10) or partial[last + 1 : row].any():
                state, step = {}, 0
            age += step
            keep = np.exp(-step / constants)
            for name, series in values.items():
                if not np.isfinite(series[row]):
                    state.pop(name, None)
                    continue
                if name not in state:
                    state[name], age = series[row], 0
                state[name] = keep * state[name] + (1 - keep) * series[row]
                lag[name][:, row] = series[row] - state[name]
            settling[row], last = age < 3 * constants.max(), row
        named = {(f"lag{i + 1}" if name == "T" else f"lag{i + 1}:{name}"): series
                 for name, all_series in lag.items() for i, series in enumerate(all_series)}
        return named, settling

    def _limit(self, bias, second, max_bias):
        """Limits the change of the bias, in place; returns where."""
        span = 2 * max_bias
        if self.box is not None and len(self.inputs) <= 10:
            side = int(min(1024.5 ** (1 / len(self.inputs)), 65))
            axes = [np.linspace(low, high, side) for low, high in self.box.T]
            values = self.bias(np.array(np.meshgrid(*axes, indexing="ij")).reshape(len(axes), -1).T)
            span = min(span, np.ptp(values)) if np.isfinite(values).all() else span
        most, limited = max(1e-6, 4 * span / self.features["length_s"]), np.zeros(len(bias), bool)
        for row in range(1, len(bias)):
            room = most * (second[row] - second[row - 1])
            if abs(bias[row] - bias[row - 1]) > room > 0:  # after an unknown bias there is no limit
                bias[row], limited[row] = bias[row - 1] + np.sign(bias[row] - bias[row - 1]) * room, True
        return limited
