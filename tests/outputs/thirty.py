# SPDX-License-Identifier: MIT
# Writes thirty recordings of one gyro, day01.csv to day30.csv, as loggers and people leave them: sixteen are good. A row each 10 s.
import math
import random

ROWS = 2160  # 6 h


def day(seed, span=60, noise=0.02):
    """Rows of time, rate with the Earth rate 8.4651872 deg/h, temperature, and voltage: two cycles; the bias follows temperature and slope."""
    chance, rows, body = random.Random(seed), [], 20.0
    turn_on, phase, voltage = chance.gauss(0, 0.003), chance.uniform(0, 2), chance.gauss(5.2, 0.02)
    for i in range(ROWS):
        air = 20 + span / 2 * math.sin(2 * math.pi * (10 * i / 10800) + phase)
        slope = (air - body) / 900
        body += 10 * slope
        bias = turn_on + 0.0007 * (body - 20) + 0.00002 * (body - 20) ** 2 + 6 * slope + 0.006 * math.sin(body / 6)
        rows.append([10 * (i + 1), 8.4651872 + bias + chance.gauss(0, noise), body + chance.gauss(0, 0.002), voltage + 0.0005 * body + chance.gauss(0, 0.0005)])
    return rows


def spikes(rows):
    for i in random.Random(1).sample(range(ROWS), 200):
        rows[i][1] += 1000


def stuck(rows):
    for row in rows[180:]:
        row[2] = rows[180][2]


def moved(rows):
    for row in rows[1000:]:
        row[1] += 0.9


def other_unit(rows):
    for row in rows:
        row[1] /= 3600


def other_sign(rows):
    for row in rows:
        row[1] *= -1


FAULTS = {3: spikes, 5: stuck, 8: moved, 11: other_unit, 14: other_sign, 17: lambda rows: rows.__delitem__(slice(100, None)), 20: spikes, 23: stuck,
          26: other_unit, 29: moved}
for number in range(1, 31):
    still = number in (6, 12)  # no cycle: the chamber was off
    table = day(number, 0.2 if still else 60)
    FAULTS.get(number, lambda rows: None)(table)
    names = "time [s],rate [deg/h],temperature [degC],uhfo [V]"
    if number == 18:
        names = names.replace(",rate [deg/h]", ",note")
    lines = [names] + [f"{t},{'ok' if number == 18 else f'{rate:.5f}'},{degc:.3f},{volt:.4f}" for t, rate, degc, volt in table]
    with open(f"day{number:02}.csv", "w", encoding="utf-8") as file:
        file.write("" if number == 24 else "\n".join(lines) + "\n")
