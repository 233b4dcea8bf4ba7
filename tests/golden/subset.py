#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Makes the reference numbers of this folder from the full set that stands beside the project (README.md says what is
# kept). usage: tests/golden/subset.py ../shared/golden
import csv
import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
EVERY = {"sinc150": 2, "gyro924": 14}  # one row in so many of the results; the training data are whole
WEIGHTS = ["huber", "hampel", "logistic", "myriad"]
ROW_RESULTS = ["i", "alpha", "resid", "loo_resid_orig", "cv_pred_orig", "hampel0_alpha1"] + [
    weight + end for weight in WEIGHTS for end in ("_v1", "_alpha1", "_v", "_alpha", "_rcv_pred_orig")
]
TUNE = {"cost", "c", "sigma2", "delta"}


def shortest(text):
    """The same double in as few digits as hold it."""
    try:
        return str(int(text))
    except ValueError:
        return repr(float(text))


def rows_of(path):
    with open(path, newline="", encoding="ascii") as file:
        return list(csv.DictReader(file))


def write_rows(path, rows, names):
    with open(path, "w", newline="", encoding="ascii") as file:
        file.write(",".join(names) + "\n")
        file.writelines(",".join(shortest(row[name]) for name in names) + "\n" for row in rows)


def write_json(path, value):
    with open(path, "w", encoding="ascii") as file:
        file.write(json.dumps(value).replace('}, "', '},\n "') + "\n")


def scalars(full):
    kept = {name: full[name] for name in ("case", "id", "hyperparameters", "accuracy")}
    kept["unweighted"] = {name: value for name, value in full["unweighted"].items() if name != "fold_mse"}
    kept["robust"] = {
        weight: {
            stage: {name: value for name, value in numbers.items() if not name.startswith(("fold_", "norms_"))}
            for stage, numbers in full["robust"][weight].items()
        }
        for weight in WEIGHTS
    }
    return kept


def subset(full, name):
    here, there, every = os.path.join(HERE, name), os.path.join(full, name), EVERY[name]
    os.makedirs(here, exist_ok=True)
    read = lambda file: json.load(open(os.path.join(there, file), encoding="ascii"))
    about = read("case.json")
    write_json(os.path.join(here, "case.json"), about)
    write_rows(os.path.join(here, "train.csv"), rows_of(os.path.join(there, "train.csv")), about["inputs"] + ["y", "fold"])
    write_rows(os.path.join(here, "test.csv"), rows_of(os.path.join(there, "test.csv"))[::every], about["inputs"])
    for case in (hyper["id"] for hyper in about["hyperparameters"]):
        write_json(os.path.join(here, case + ".json"), scalars(read(case + ".json")))
        write_rows(os.path.join(here, case + "_train.csv"), rows_of(os.path.join(there, case + "_train.csv"))[::every], ROW_RESULTS)
        tests = rows_of(os.path.join(there, case + "_test.csv"))[::every]
        write_rows(os.path.join(here, case + "_test.csv"), tests, list(tests[0]))
    if name == "gyro924":
        tune = {weight: {k: v for k, v in numbers.items() if k in TUNE} for weight, numbers in read("tune_reference.json").items()}
        write_json(os.path.join(here, "tune_reference.json"), tune)
        linear = read("linear_models.json")
        write_json(os.path.join(here, "linear_models.json"), {name: linear[name] for name in ("units", "cubic", "stepwise")})


def main(arguments):
    if len(arguments) != 1:
        print("usage: subset.py FOLDER-OF-THE-FULL-SET", file=sys.stderr)
        return 64
    for name in EVERY:
        subset(arguments[0], name)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
