#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes allan_reference.txt: twenty series and their Allan coefficients by the reference, a program of 150 lines in numpy that
does not share a line with prism. usage: allan_reference.py FOLDER_OF_allan_simple.py >allan_reference.txt"""
import sys

# values, seed, strengths per sample of Q, N, B, K, and slope
SERIES = [(32, 1, 0, 1, 0, 0, 0), (64, 2, 0, 1, 0, 0, 0), (100, 3, 0, 1, 0, .01, 0), (300, 4, 1, .3, 0, 0, 0), (1000, 5, 0, 1, 0, 0, 0),
          (1000, 6, .3, 1, 0, 0, 0), (1000, 7, 0, 1, .1, 0, 0), (1000, 8, 0, 1, 0, .003, 0), (1000, 9, 0, 1, 0, 0, .004),
          (1000, 10, 0, 0, 1, 0, 0), (1000, 11, 0, 0, 0, 1, 0), (1000, 12, 1, 0, 0, 0, 0), (1000, 13, 0, 0, 0, .01, 1),
          (3000, 14, 0, 9, 1, .001, 0), (5000, 15, 3, 1, .02, 3e-5, 0), (8000, 16, 0, 1, .01, 1e-4, 0), (8000, 17, 0, 1, 0, 1e-6, 1e-4),
          (8000, 18, 0, 1e-8, 1e-9, 0, 0), (20000, 19, .3, 1, .01, 1e-6, 3e-5), (30000, 20, 0, 1, .03, 0, 0)]


class Normal:
    """The generator of NIST SP 1065; twelve numbers make a normal one: only sums, the same everywhere."""
    def __init__(self, seed):
        self.n = 1234567890 + seed

    def __call__(self):
        total = 0
        for _ in range(12):
            self.n = 16807*self.n % 2147483647
            total += self.n
        return total/2147483647 - 6


def rates(values, seed, q, s, b, k, slope):
    """As in allan_test.cpp. Flicker noise is about that: a sum of six processes with time constants of 1 to 1 000 samples."""
    normal, y, walk, before, processes = Normal(seed), [], 0, 0, [0]*6
    for i in range(values):
        error = normal()
        rate = q**.5*(error - before) + s**.5*normal() + slope*i
        before = error
        walk += k**.5*normal()
        for p in range(6):
            rest = .5/4**p
            processes[p] = (1 - rest)*processes[p] + (b*rest)**.5*normal()
        y.append(rate + walk + sum(processes))
    return y


def main():
    sys.path.insert(0, sys.argv[1])
    import allan_simple
    import numpy
    print("# Written by allan_reference.py. A series: values, seed, strengths of Q, N, B, K, slope; then for Q, N, B, K, R: strength, or -")
    print("# if there is only a bound, and both ends.")
    for series in SERIES:
        found = allan_simple.analyse(numpy.array(rates(*series)))
        found = [found[name] for name in "QNBKR"]
        print(*series, *[f"{'-' if value is None else format(value, '.6g')} {low:.6g} {high:.6g}" for value, low, high in found])


main()
