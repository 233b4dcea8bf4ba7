# SPDX-License-Identifier: MIT
"""Predictions of a model file, computed as prismd computes them (docs/formats.md, docs/compensation.md). Needs numpy."""

import json
import re

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

KERNELS = ("lssvm", "ir_lssvm", "sparse_lssvm", "svr")


def _triangle(numbers):
    n = int(round((np.sqrt(8 * len(numbers) + 1) - 1) / 2))
    full = np.zeros((n, n))
    full[np.tril_indices(n)] = numbers
    return full + np.tril(full, -1).T


def _in_runs(values, runs, function):
    """The function of a dense series of each run (rows first to end; `dense` second of each row), at its rows."""
    out = np.full(len(values), np.nan)
    for first, end, dense in runs:
        series = np.full(dense[-1] + 1, np.nan)
        series[dense] = values[first:end]
        out[first:end] = function(series)[dense]
    return out


def _windows(series, length):
    """Windows that end at each second, with NaN before the begin; and the number of seconds of each that exist."""
    padded = np.concatenate([np.full(length - 1, np.nan), series])
    return sliding_window_view(padded, length), np.minimum(np.arange(len(series)) + 1, length)


def _longest_gap(missing, existing, limit):
    """Whether more than `limit` consecutive of the existing seconds of a window are missing."""
    exists = np.arange(missing.shape[1]) >= missing.shape[1] - existing[:, None]
    run, longest = np.zeros(len(missing), int), np.zeros(len(missing), int)
    for column in (missing & exists).T:
        run = np.where(column, run + 1, 0)
        longest = np.maximum(longest, run)
    return longest > limit


def _mean(length, gap):
    def function(series):
        view, existing = _windows(series, length)
        known = np.isfinite(view)
        count = known.sum(axis=1)
        mean = np.where(known, view, 0).sum(axis=1) / np.where(count, count, np.nan)
        return mean if gap is None else np.where(_longest_gap(~known, existing, gap), np.nan, mean)
    return function


def _mean_time(length):
    def function(series):
        known = np.isfinite(_windows(series, length)[0])
        count = known.sum(axis=1)
        return (known * np.arange(1 - length, 1)).sum(axis=1) / np.where(count, count, np.nan)
    return function


def _later(series, seconds):
    return np.concatenate([np.full(seconds, np.nan), series[:-seconds]]) if seconds < len(series) else np.full(len(series), np.nan)


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
        self.file, self.kind, self.features = file, file["kind"], file["features"]
        self.inputs = [each["name"] for each in file["inputs"]]
        box = [(each["min"], each["max"]) for each in file["inputs"] if "min" in each]
        self.box = np.array(box, float).T if box else None
        self.spread = file.get("spread")
        if self.kind in ("polynomial", "stepwise"):
            self.powers = np.array([term["powers"] for term in file["terms"]], int)
            self.coefficients = np.array([term["coefficient"] for term in file["terms"]], float)
            return self._check(self.powers, self.coefficients)
        if self.kind not in KERNELS + ("composite",):
            raise ValueError(f"kind: found {self.kind}, expected a model of prism 0.4")
        norm = file["normalisation"]
        self.shift, self.scale = np.array(norm["input_shift"], float), np.array(norm["input_scale"], float)
        self.target = norm["target_shift"], norm["target_scale"]
        self.centres = np.array(file["centres"], float).reshape(-1, len(self.inputs))
        self.alpha = np.array(file["alpha"], float)
        self._check(self.shift, self.scale, self.centres, self.alpha)
        self.prior, self.constant = None, file["beta" if self.kind == "composite" else "b"]
        if self.kind != "composite":
            self.uncertainty = file.get("uncertainty")
            if self.uncertainty:
                self._factorise(self.uncertainty.get("gram"), file["c"], 0, lambda: np.diag(1 / (file["c"] * np.array(file["weight"]))))
            return None
        v, trust = file["variances"], file["trust"]
        self.trust = {"overlap": 1, "relevance": None} | trust
        if prior := file.get("prior"):
            self.prior = prior["scale"], [Model.__new__(Model) for _ in prior["models"]], prior["levels"]
            for model, part in zip(self.prior[1], prior["models"]):
                model._read(part)
        def rest():
            time, run = np.array(file["time_h"], float), np.array(file["recording"])
            gaps = np.abs(time[:, None] - time[None, :])
            same = run[:, None] == run[None, :]
            warm = np.exp(-time)
            return (same * (v["nuisance"] * np.exp(-gaps / v["nuisance_time_h"]) + v.get("offset", 0))
                    + v.get("warm_up", 0) * np.outer(warm, warm) + np.diag(v["noise"] / np.array(file["weight"], float) + 1e-8))
        self._factorise(file.get("gram"), 1, 1e-8 * v["smooth"], rest)

    @staticmethod
    def _check(*parts):
        for part in parts:
            if not np.isfinite(part).all():
                raise ValueError("found a number that is not finite, expected finite ones")

    def _factorise(self, gram, c, jitter, noise):
        kernel = self._kernel(self.centres, self.centres)
        self.c, self.gram = c, None
        if gram:
            self.factor = np.linalg.cholesky(kernel + jitter * np.eye(len(kernel)))
            self.gram = np.linalg.cholesky(_triangle(gram))
            return
        self.factor = np.linalg.cholesky(kernel + noise())
        self.nu = np.linalg.solve(self.factor.T, np.linalg.solve(self.factor, np.ones(len(kernel))))

    def _kernel(self, a, b):
        if self.kind != "composite":
            squares = ((a[:, None, :] - b[None, :, :]) ** 2).sum(axis=2)
            return np.exp(-squares / (2 * self.file["sigma2"]))
        v = self.file["variances"]
        squares = ((a[:, None, :] - b[None, :, :]) ** 2 / np.array(v["length_squared"])).sum(axis=2)
        products = a @ b.T
        return v["smooth"] * np.exp(-squares / 2) + v["linear"] * products + v["quadratic"] * products**2

    def _variance(self, k, prior):
        half = np.linalg.solve(self.factor, k.T)
        if self.gram is None:
            return np.maximum(0, prior - (half**2).sum(axis=0) + (1 - k @ self.nu) ** 2 / self.nu.sum())
        phi = np.linalg.solve(self.gram, np.vstack([half, np.ones(half.shape[1])]))
        return np.maximum(0, prior - (half**2).sum(axis=0)) + (phi**2).sum(axis=0) / self.c

    def _own(self, x):
        """Bias and, if the model has one, its variance in units of the normalised target."""
        if self.kind in ("polynomial", "stepwise"):
            return (x[:, None, :] ** self.powers).prod(axis=2) @ self.coefficients, None
        n = (x - self.shift) / self.scale
        bias, variance = np.empty(len(n)), np.empty(len(n))
        composite = self.kind == "composite"
        has_variance = composite or self.uncertainty
        for at in range(0, len(n), 2048):
            part = slice(at, at + 2048)
            k = self._kernel(n[part], self.centres)
            bias[part] = (k @ self.alpha + self.constant) * self.target[1] + self.target[0]
            if has_variance:
                v, square = self.file.get("variances"), (n[part] ** 2).sum(axis=1)
                prior = v["smooth"] + v["linear"] * square + v["quadratic"] * square**2 if composite else 1
                variance[part] = self._variance(k, prior)
        return bias, variance if has_variance else None

    def bias(self, x):
        """The plain sum of the model, deg/h, of inputs of shape (rows, inputs)."""
        own = self._own(x)[0]
        return own + self._prior(x)[0] if self.kind == "composite" and self.prior else own

    def _nearest(self, x):
        return x if self.box is None else np.clip(x, *self.box)

    def _prior(self, x):
        if not self.prior:
            return 0.0, 0.0, np.ones(len(x), bool)
        scale, models, levels = self.prior
        drift = np.array([model.bias(model._nearest(x)) - level for model, level in zip(models, levels)])
        outside = np.any([(model._nearest(x) != x).any(axis=1) for model in models], axis=0)
        return scale * drift.mean(axis=0), scale**2 * drift.var(axis=0, ddof=1) * (1 + 1 / len(models)), outside

    def _outside(self, x):
        if self.box is None:
            return np.zeros(len(x), bool)
        wide = [name in ("dTdt", "U") or name.startswith("lag") for name in self.inputs]
        room = (np.where(wide, 0.2, 0.02) if self.spread else 0) * (self.box[1] - self.box[0])
        return ((x < self.box[0] - room) | (x > self.box[1] + room)).any(axis=1)

    def _excess(self, x, shares=None):
        if self.box is None:
            return np.zeros(len(x))
        span = self.box[1] - self.box[0]
        out = np.maximum(0, np.maximum(self.box[0] - x, x - self.box[1])) / np.where(span > 0, span, np.inf)
        return out.max(axis=1) if not shares else np.sqrt((out**2 * shares).sum(axis=1))

    def predict_inputs(self, x, extrapolation="preset"):
        """Bias, its two standard deviations (deg/h), and whether it extrapolates, of inputs of shape (rows, inputs)."""
        x = np.asarray(x, float).reshape(-1, len(self.inputs))
        bias, variance = self._own(x)
        outside, composite, none = self._outside(x), self.kind == "composite", np.zeros(len(x))
        spread, known, edge, skill, overlap = self.spread, variance is not None, None, 1.0, 1.0
        sd, mean, target_variance, excess = np.full(len(x), self.file.get("sd_deg_per_h", np.nan)), 0.0, 1.0, none
        if composite:
            t, square = self.trust, self.target[1] ** 2
            prior, prior_variance, strange = self._prior(x)
            fraction = np.maximum(0, variance - t["level"])
            bias, mean, variance = bias + prior, self.target[0] + prior, fraction * square
            outside, target_variance = (outside | (fraction > t["guard"])) & strange, square + prior_variance
            skill, overlap, excess = t["skill"], t["overlap"], self._excess(x, t["relevance"])
            if t["relevance"]:
                at = np.where([name == "dTdt" or name.endswith("/dt") for name in self.inputs], x, self._nearest(x))
                own, own_variance = self._own(at)
                edge = own + prior, np.maximum(0, own_variance - t["level"]) * square
        elif known:
            u, square = self.uncertainty, self.target[1] ** 2
            outside |= variance > u["guard_fraction"]
            sd_scale, prior_variance = u.get("sd_scale", 1), u["prior_variance"] * square
            sd = np.sqrt(prior_variance * variance) * sd_scale
            variance, mean, target_variance, excess = variance * prior_variance, self.target[0], square, self._excess(x)
            if not spread and extrapolation == "shrink":
                spread = {"nuisance_deg_per_h": 0, "offset_deg_per_h": 0, "factor": sd_scale,
                          "noise_deg_per_h": np.sqrt(prior_variance / self.file["c"])}
        lost, sd_mean = none, np.full(len(x), np.nan)
        if known and (extrapolation == "shrink" or (composite and extrapolation == "preset")):
            e = np.maximum(excess - 0.15, 0) ** 2
            g = np.clip((skill + 0.9 * (1 - overlap) - 0.1) / 0.5, 0, 1)
            unknown = variance / target_variance
            if edge is None:
                w = g / (1 + unknown + 20 * e)
                lost = (1 - w) * (target_variance + (bias - mean) ** 2)
                bias = mean + w * (bias - mean)
            else:
                far = np.maximum(unknown - edge[1] / target_variance - 5, 0)
                wb, wf = g / (1 + edge[1] / target_variance + far + e / 2), g / (1 + unknown + 10 * e)
                to_edge, beyond = edge[0] - mean, bias - edge[0]
                bias = mean + wb * to_edge + wf * beyond
                lost = (1 - wb) * (target_variance + to_edge**2) + (1 - wf) * beyond**2 + 0.5 * excess * target_variance
        if spread:
            whole = 1.25 * ((variance if known else 0) + spread["nuisance_deg_per_h"] ** 2 + lost) + spread["offset_deg_per_h"] ** 2
            sd, sd_mean = (spread["factor"] * np.sqrt(whole + more) for more in (none, spread["noise_deg_per_h"] ** 2))
        if extrapolation == "clamp" and outside.any():
            inner, inner_sd, inner_mean, _ = self.predict_inputs(self._nearest(x), "flag")
            larger = outside & ~(sd > inner_sd)
            bias = np.where(outside, inner, bias)
            sd, sd_mean = np.where(larger, inner_sd, sd), np.where(larger, inner_mean, sd_mean)
        return bias, sd, sd_mean, outside

    def predict(self, frame, extrapolation="preset", slew_limit=True, max_bias_deg_per_h=100.0):
        """Columns of the log for one-second means.

        frame: a dict or DataFrame of equally long columns of a log, in order of time: time_s, rate_deg_per_h (deg/h),
        temperature_degc, uhfo_v (V) if the model uses it, NAME_degc … of its sensors; if present, also `quality` (the values of
        an implausible second are not used) and `partial`. NaN or None: unknown. The settings are those of "correction".
        Returns a dict of arrays of the same length: mean_rate_deg_per_h, mean_temperature_degc, slope_degc_per_s, mean_uhfo_v,
        bias_deg_per_h, sd_deg_per_h, sd_mean_deg_per_h, corrected_deg_per_h, corrected_mean_deg_per_h (NaN: none) and quality.
        """
        column = lambda name: np.asarray(frame[name], float)
        f, second = self.features, np.asarray(frame["time_s"]).astype(float).round().astype(int)
        quality = np.asarray(frame["quality"], str) if "quality" in frame else np.full(len(second), "")
        partial = column("partial") > 0 if "partial" in frame else np.zeros(len(second), bool)
        bad = np.char.find(quality, "implausible") >= 0
        quantities = {"T": "temperature_degc", "U": "uhfo_v"} | {name: f"{name}_{unit.lower()}" for name, unit in f.get("sensors", {}).items()}
        values = {name: np.where(bad, np.nan, column(key)) for name, key in quantities.items() if name != "U" or key in frame}
        rate = np.where(bad, np.nan, column("rate_deg_per_h"))
        gap, length, ends = f["max_gap_s"], f["length_s"], f["end_mean_s"]
        history = length + (ends if f["slope"] == "difference" else 0)
        runs, rows = [], np.flatnonzero(~partial)
        cut = np.flatnonzero((np.diff(rows) > 1) | (np.diff(second[rows]) <= 0) | (np.diff(second[rows]) > gap + 1)) + 1
        for run in np.split(rows, cut) if len(rows) else []:
            runs.append((run[0], run[-1] + 1, second[run] - second[run[0]]))
        warm = np.zeros(len(second), int)
        for first, end, dense in runs:
            warm[first:end] = np.minimum(dense + 1, history)
        full = warm >= history
        mean_rate = _in_runs(rate, runs, _mean(length, None))
        mean = {name: _in_runs(series, runs, _mean(length, gap)) for name, series in values.items()}

        def slope_of(series):
            if f["slope"] == "difference":
                short, when = _mean(ends, gap), _mean_time(ends)
                return (short(series) - _later(short(series), length)) / (length + when(series) - _later(when(series), length))
            view, existing = _windows(series, length)
            known, time = np.isfinite(view), np.arange(1 - length, 1.0)
            count = known.sum(axis=1)[:, None]
            dt = np.where(known, time - (known * time).sum(axis=1)[:, None] / count, 0)
            level = np.where(known, view, 0).sum(axis=1)[:, None] / count
            found = (dt * np.where(known, view - level, 0)).sum(axis=1) / (dt**2).sum(axis=1)
            return np.where(_longest_gap(~known, existing, gap), np.nan, found)
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = {name: np.where(full, _in_runs(values[name], runs, slope_of), np.nan) for name in values if name != "U"}
            lag, settling = self._lags(second, values, partial)
            x = np.array([self._input(name, mean, slope, lag) for name in self.inputs]).T.reshape(len(second), len(self.inputs))
        usable = full & np.isfinite(x).all(axis=1) & ~partial
        out = [np.full(len(second), np.nan) for _ in range(3)]
        outside = np.zeros(len(second), bool)
        if usable.any():
            *found, outside[usable] = self.predict_inputs(x[usable], extrapolation)
            for series, part in zip(out, found):
                series[usable] = part
        bias, sd, sd_mean = out
        over = usable & ~(np.abs(bias) <= max_bias_deg_per_h)
        for series in out:
            series[over] = np.nan
        limited = self._limit(bias, second, max_bias_deg_per_h) if slew_limit else np.zeros(len(second), bool)
        words = [("warming", ~full), ("input_missing", full & ~usable), ("extrapolating", usable & outside & ~over), ("over_limit", over),
                 ("settling", full & settling), ("rate_invalid", ~np.isfinite(column("rate_deg_per_h"))), ("implausible", bad),
                 ("slew_limited", limited)]
        texts = np.array(["+".join(word for word, set_in in words if set_in[row]) or "good" for row in range(len(second))])
        for row in np.flatnonzero(partial[1:]) + 1:  # the end of a session has the bias in use
            if not partial[row - 1] and 0 < second[row] - second[row - 1] <= gap + 1:
                for series in (*out, texts):
                    series[row] = series[row - 1]
        return {"mean_rate_deg_per_h": mean_rate, "mean_temperature_degc": mean["T"], "slope_degc_per_s": slope["T"],
                "mean_uhfo_v": mean.get("U", np.full(len(second), np.nan)), "bias_deg_per_h": bias, "sd_deg_per_h": sd,
                "sd_mean_deg_per_h": sd_mean, "corrected_deg_per_h": rate - bias, "corrected_mean_deg_per_h": mean_rate - bias, "quality": texts}

    def _input(self, name, mean, slope, lag):
        if name == "dTdt":
            return slope["T"]
        if match := re.fullmatch(r"d(.+)/dt", name):
            return slope[match[1]]
        if match := re.fullmatch(r"lag(\d+)(?::(.+))?", name):
            return lag[match[2] or "T"][int(match[1]) - 1]
        if name in mean:
            return mean[name]
        first, _, other = name.partition("-")
        if first not in mean or other not in mean:
            raise ValueError(f"frame: found no column for the input {name}")
        return mean[first] - mean[other]

    def _lags(self, second, values, partial):
        constants = np.array(self.features.get("lag_time_constants_s", []), float)
        settling, lag = np.zeros(len(second), bool), {name: np.full((len(constants), len(second)), np.nan) for name in values}
        if not len(constants):
            return lag, settling
        bridge = max(self.features["max_gap_s"] + 1, constants.min() / 10)
        state, age, last = {}, 0, None
        for row in np.flatnonzero(~partial & np.isfinite(values["T"])):
            step = 0 if last is None else second[row] - second[last]
            if last is None or step <= 0 or step > bridge or partial[last + 1:row].any():
                state, age = {"T": np.full(len(constants), values["T"][row])}, 0
            else:
                age += step
            keep = np.exp(-max(step, 0) / constants)
            for name in values:
                if name == "U":
                    continue
                value = values[name][row]
                if not np.isfinite(value):
                    state.pop(name, None)
                    continue
                if name not in state:
                    state[name], age = np.full(len(constants), value), 0
                if age or name != "T":
                    state[name] = keep * state[name] + (1 - keep) * value
                lag[name][:, row] = value - state[name]
            settling[row], last = age < 3 * constants.max(), row
        return lag, settling

    def _limit(self, bias, second, max_bias):
        """Limits the change of the bias, in place; returns where."""
        span = 2 * max_bias
        if self.box is not None and len(self.inputs) <= 10:
            side = int(min((1024.5) ** (1 / len(self.inputs)), 65))
            axes = [np.linspace(low, high, side) for low, high in self.box.T]
            grid = np.array(np.meshgrid(*axes, indexing="ij")).reshape(len(axes), -1).T
            values = self.bias(grid)
            span = min(span, np.ptp(values)) if np.isfinite(values).all() else span
        most, limited = max(1e-6, 4 * span / self.features["length_s"]), np.zeros(len(bias), bool)
        for row in range(1, len(bias)):
            room = most * (second[row] - second[row - 1])
            if abs(bias[row] - bias[row - 1]) > room > 0:  # after an unknown bias there is no limit
                bias[row], limited[row] = bias[row - 1] + np.sign(bias[row] - bias[row - 1]) * room, True
        return limited
