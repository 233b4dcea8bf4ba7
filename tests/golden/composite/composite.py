#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Composite-kernel regression with a nuisance in time: a slow, obvious reference, the origin of golden.json. Run, it
computes those numbers again and prints the largest relative difference (needs python3-numpy).

  y = beta + f(x) + n(t) + e,   f ~ GP(0, k),   n ~ GP(0, q),   e ~ N(0, s_n^2 / v)
  k(x, x') = s1^2 exp(-sum_i (x_i - x'_i)^2 / (2 l_i^2)) + s2^2 x.x' + s3^2 (x.x')^2      (x: z-scores of the training inputs)
  q(t, t') = s4^2 exp(-|t - t'| / tau)                                                     (training only)

Parameters theta, all logarithms: [s1^2, l_1^2 .. l_d^2, s2^2, s3^2, s4^2, tau in hours, s_n^2]; y is scaled by its mean and sd (divisor N).
objective = REML (beta integrated out) + 0.005 |theta|^2, with its gradient. v: robust weights (ones here).
"""
import csv
import json
import os

import numpy as np


class Composite:
    def __init__(self, x, y, t_s, theta, v=None):
        self.mu, self.sd = x.mean(0), x.std(0)
        self.y_mean, self.y_sd = y.mean(), y.std()
        self.z, self.u, self.t_h = (x - self.mu) / self.sd, (y - self.y_mean) / self.y_sd, t_s / 3600.0
        self.v = np.ones(len(y)) if v is None else v
        self.set(np.asarray(theta, float))

    def kernel(self, a, b):
        d = a.shape[1]
        s1, l2, s2, s3 = np.exp(self.theta[0]), np.exp(self.theta[1:1 + d]), np.exp(self.theta[1 + d]), np.exp(self.theta[2 + d])
        dist = ((a[:, None, :] - b[None, :, :]) ** 2 / (2 * l2)).sum(-1)
        dot = a @ b.T
        return s1 * np.exp(-dist), s2 * dot, s3 * dot ** 2

    def set(self, theta):
        self.theta = theta
        n, d = self.z.shape
        self.s4, self.tau_h, self.sn = np.exp(theta[3 + d]), np.exp(theta[4 + d]), np.exp(theta[5 + d])
        self.parts = self.kernel(self.z, self.z)
        self.q = self.s4 * np.exp(-np.abs(self.t_h[:, None] - self.t_h[None]) / self.tau_h)
        h = sum(self.parts) + self.q + np.diag(self.sn / self.v + 1e-8)
        self.chol = np.linalg.cholesky(h)
        self.inv = np.linalg.inv(h)
        one = np.ones(n)
        self.inv_one, self.ones = self.inv @ one, one @ self.inv @ one
        self.beta = self.inv_one @ self.u / self.ones
        self.alpha = self.inv @ (self.u - self.beta)

    def objective(self):
        """REML up to a constant, and its gradient by theta."""
        n, d = self.z.shape
        f = np.log(np.diag(self.chol)).sum() + 0.5 * np.log(self.ones) + 0.5 * self.u @ self.alpha
        r = self.inv - np.outer(self.inv_one, self.inv_one) / self.ones
        w = r - np.outer(self.alpha, self.alpha)
        rbf, lin, quad = self.parts
        g = np.zeros_like(self.theta)
        g[0] = 0.5 * (w * rbf).sum()
        for i in range(d):
            g[1 + i] = 0.5 * (w * rbf * (self.z[:, i][:, None] - self.z[:, i][None]) ** 2).sum() / (2 * np.exp(self.theta[1 + i]))
        g[1 + d], g[2 + d] = 0.5 * (w * lin).sum(), 0.5 * (w * quad).sum()
        g[3 + d] = 0.5 * (w * self.q).sum()
        g[4 + d] = 0.5 * (w * self.q * np.abs(self.t_h[:, None] - self.t_h[None])).sum() / self.tau_h
        g[5 + d] = 0.5 * (np.diag(w) * self.sn / self.v).sum()
        return f + 0.005 * (self.theta ** 2).sum(), g + 0.01 * self.theta

    def predict(self, x):
        """Mean, model variance (without nuisance and noise), both in the target's unit."""
        z = (x - self.mu) / self.sd
        d = z.shape[1]
        k = sum(self.kernel(z, self.z))
        zz = (z * z).sum(1)
        prior = np.exp(self.theta[0]) + np.exp(self.theta[1 + d]) * zz + np.exp(self.theta[2 + d]) * zz ** 2
        var = prior - ((k @ self.inv) * k).sum(1) + (1 - k @ self.inv_one) ** 2 / self.ones
        return (k @ self.alpha + self.beta) * self.y_sd + self.y_mean, np.maximum(var, 0) * self.y_sd ** 2


def column(path, *names):
    with open(path, newline="", encoding="ascii") as file:
        return np.array([[float(row[name]) for name in names] for row in csv.DictReader(file)])


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    train = os.path.join(here, "..", "gyro924", "train.csv")
    x, y, test = column(train, "T", "R", "U"), column(train, "y")[:, 0], column(os.path.join(here, "test.csv"), "T", "R", "U")
    with open(os.path.join(here, "golden.json"), encoding="ascii") as file:
        golden = json.load(file)
    low = np.ones(len(y))
    low[np.array(golden["low_weight_rows"]) - 1] = 0.1
    for name, expected in golden["cases"].items():
        model = Composite(x, y, 100.0 * np.arange(len(y)), expected["theta"], low if name == "weighted" else None)
        objective, gradient = model.objective()
        mean, variance = model.predict(test)
        found = {"objective": objective, "gradient": gradient, "beta": model.beta, "mean": mean, "model_variance": variance}
        print(name, {key: float(np.max(np.abs(value - expected[key])) / np.max(np.abs(expected[key]))) for key, value in found.items()})


if __name__ == "__main__":
    main()
