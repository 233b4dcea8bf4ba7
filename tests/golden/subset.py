#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Makes the reference numbers of this folder from the full set that is stored beside the project (README.md describes what
# is kept). usage: tests/golden/subset.py ../shared
import csv
import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
EVERY = {"sinc150": 2, "gyro924": 14, "gyro924_T": 14, "gyro924_U": 14}  # one row in so many of the results; the training data are whole
WEIGHTS = ["huber", "hampel", "logistic", "myriad"]
ROW_RESULTS = ["i", "alpha", "resid", "loo_resid_orig", "cv_pred_orig", "hampel0_alpha1"] + [
    weight + end for weight in WEIGHTS for end in ("_v1", "_alpha1", "_v", "_alpha", "_rcv_pred_orig")
]
TUNE = {"cost", "c", "sigma2", "delta"}
STEPWISE = ["id", "candidates", "initial", "final_terms", "intercept", "coef", "se", "sse", "df"]
STEP = ["action", "term", "terms", "p", "t"]
COMPOSITE_ROWS = 40  # of gyro924/test.csv: those that science/golden.json predicts


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


def read_json(folder, file):
    with open(os.path.join(folder, file), encoding="ascii") as text:
        return json.load(text)


def make_folder(name):
    folder = os.path.join(HERE, name)
    os.makedirs(folder, exist_ok=True)
    return folder


def subset(full, name):
    here, there, every = make_folder(name), os.path.join(full, name), EVERY[name]
    read = lambda file: read_json(there, file)
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


def stepwise(full):
    here, there = make_folder("stepwise"), os.path.join(full, "stepwise")
    problems = read_json(there, "golden.json")
    kept = [{name: problem[name] for name in STEPWISE} for problem in problems]
    for problem, full_problem in zip(kept, problems):
        problem["path"] = [{name: step[name] for name in STEP if name in step} for step in full_problem["path"]]
        rows = rows_of(os.path.join(there, problem["id"] + ".csv"))
        write_rows(os.path.join(here, problem["id"] + ".csv"), rows, list(rows[0]))
    write_json(os.path.join(here, "golden.json"), kept)


def composite(shared):
    here = make_folder("composite")
    write_json(os.path.join(here, "golden.json"), read_json(os.path.join(shared, "science"), "golden.json"))
    rows = rows_of(os.path.join(shared, "golden", "gyro924", "test.csv"))[:COMPOSITE_ROWS]
    write_rows(os.path.join(here, "test.csv"), rows, ["T", "R", "U"])


def main(arguments):
    if len(arguments) != 1:
        print("usage: subset.py FOLDER-OF-THE-FULL-SET", file=sys.stderr)
        return 64
    full = os.path.join(arguments[0], "golden")
    for name in EVERY:
        subset(full, name)
    stepwise(full)
    composite(arguments[0])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
