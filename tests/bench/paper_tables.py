#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables I to III and the room figures of Rosinol et al. (RSS 2020, section V) on simulated logs,
with the paper's numbers beside ours.

    ./dev tables [odometry|mesh|humans|objects|relations|rooms|pick|all] [--small]
        [--seeds 11 12 13] [--people 12 24 60] [--variants NAME...] [--drop] [--tables-only]
        [--out docs/results] [--log FOLDER --truth FOLDER]

Simulates each log that is not in --folder yet, makes maps of it, scores them with dsg-eval, and
prints mean, standard deviation and median over the seeds. The full form is a tour of the whole
office with 12, 24 and 60 people; it takes days, and 25 GB a log: --drop deletes each log that this
run simulated once it is scored. --small is 40 s of the apartment, about twenty minutes a seed on
two cores. Each score is kept in FOLDER/scores.json under the digest of the programs and their
arguments, so that a run which was stopped goes on where it was; --tables-only prints what is there.
With --log a recorded log's odometry is scored. Exits with 1 if a run fails, with 2 on bad usage.

Writes OUT/TABLE-FORM.md, .json, and .png if python3-matplotlib is there.
"""

import argparse
import dataclasses
import pathlib
import shlex
import sys

import table_report
from table_report import Column, Row, Table
from table_runs import TRUTH, Log, Runner, Variant, say, simulated

BUILT = pathlib.Path("build/release/bin")
CROWDS = (12, 24, 60)  # uH_01 to uH_03
CAD = ("--cad", TRUTH + "/cad")
# Tracks of people alone; the mesh is not asked for, its samples would only take time.
NO_LAYERS = ("--poses", "gt", "--no-layers")
NO_MESH = ("--mesh-samples", "1000")
FULL = {"world": "office", "seconds": 2400.0, "seeds": [11, 12, 13], "mesh_samples": None}
SMALL = {"world": "apartment", "seconds": 40.0, "seeds": [11], "mesh_samples": 200_000}

MAP = Variant("true poses, masked", ("--poses", "gt", "--masking", "carve", *CAD), (), True)
MAP_UNMASKED = Variant("true poses, unmasked", ("--poses", "gt", "--masking", "off", *CAD), (),
                       True)
OWN = Variant("own poses, masked",
              ("--poses", "vio", "--masking", "carve", "--odometry-masks", "on", *CAD),
              ("--align-map",), True)
OWN_UNMASKED = Variant("own poses, unmasked",
                       ("--poses", "vio", "--masking", "off", "--odometry-masks", "off", *CAD),
                       ("--align-map",), True)
PAPER_GRAPH = Variant("people, the paper's graph", (*NO_LAYERS, "--people", "paper"), NO_MESH)
NO_DEPTH = Variant("people without depth", (*NO_LAYERS, "--no-people-depth"), NO_MESH)


def odometry(method, masks):
    return Variant(f"{method}, masks {masks}",
                   ("--poses", "vio", "--no-layers", "--odometry", method, "--odometry-masks",
                    masks), ("--trajectory", "--align", "yaw"), is_of_people=masks == "on")


def by_crowd(*numbers):
    """The paper's numbers of uH_01 to uH_03 for the first column with such."""
    return {people: (number,) for people, number in zip(CROWDS, numbers)}


# EuRoC's columns of Table I, for --log.
EUROC = ("MH_01", "MH_02", "MH_03", "MH_04", "MH_05", "V1_01", "V1_02", "V1_03", "V2_01", "V2_02",
         "V2_03")
TABLE_1 = {
    "5pt": ((9.3, 10, 11, 42, 21, 6.7, 12, 17, 5, 8.1, 30), (92, 145, 160)),
    "2pt": ((9.0, 10, 10, 31, 16, 4.7, 7.5, 14, 5.8, 9, 20), (78, 79, 111)),
    "dvio": ((8.1, 9.8, 14, 23, 20, 4.3, 7.8, 17, 6.2, 11, 30), (59, 78, 88)),
}


def rpe_10(report):
    for row in report["tracks"]["causal"]["rpe"]:
        if row["length_m"] == 10:
            return row["translation_percent"]
    return None


def odometry_row(method, masks, is_small):
    # The paper's odometry knows no masks; its numbers stand beside the rows that have none.
    euroc, crowds = TABLE_1[method]
    paper = {**by_crowd(*crowds), **{name: (number,) for name, number in zip(EUROC, euroc)}}
    causal = "tracks.causal."
    return Row(f"{method}, masks {masks}", odometry(method, masks),
               (causal + "ate.rmse_m", causal + "coverage", rpe_10, causal + "nees.position",
                causal + "nees.yaw", causal + "path_m", "ingest_s"),
               paper if masks == "off" else {}, is_small)


ODOMETRY = Table(
    "odometry", "Table I: absolute trajectory error of odometry", "method",
    (Column("ATE, cm", 1, 100.0, True, "fewer than three poses with a truth"),
     Column("of the log, %", 1, 100.0, why="no poses"),
     Column("RPE over 10 m, %", 2, why="the way is shorter than 10 m"),
     Column("position, squared error over covariance (3 is right)", 2, why="no covariances"),
     Column("heading, the same (1 is right)", 2, why="no covariances"),
     Column("way, m", 1), Column("dsg-ingest, s", 0)),
    tuple(odometry_row(method, masks, masks == "off" or method == "dvio")
          for method in TABLE_1 for masks in ("off", "on")),
    ("RMSE of causal poses over all poses, without a gate, aligned by heading and translation. "
     "Without masks as in the paper; masks leave out features on people, and say nothing where "
     "there are none. Of five logs whose covariances are right the mean of squared errors over "
     "covariance is from 1.25 to 5.50 for positions and from 0.17 to 2.57 for headings in 95 of "
     "100 tables (chi-square; errors of one log go together). EuRoC's columns of the "
     "paper's table need its recordings: `--log FOLDER --truth FOLDER`. Times are those of the "
     "clock, whatever else the machine did.",),
    "not in the paper (its odometry has no masks)")


def mesh_row(variant, *paper):
    is_own = "--align-map" in variant.evaluate
    cells = tuple("mesh." + name for name in
                  ("rmse_m", "icp_inlier_share", "rmse_no_icp_m", "completeness", "stray_m2"))
    return Row(variant.name, variant,
               (*cells, "trajectory.ate_4dof_m" if is_own else None), by_crowd(*paper))


MESH = Table(
    "mesh", "Table II: mesh error with and without dynamic masking", "poses, masking",
    (Column("RMSE after ICP, gate 1.5 m, cm", 1, 100.0, True, "no mesh"),
     Column("within the gate, %", 2, 100.0, why="no mesh"),
     Column("RMSE without ICP and gate, cm", 1, 100.0, why="no mesh"),
     Column("surface found, %", 1, 100.0, why="no mesh"),
     Column("surface where nothing is, m²", 2, why="no mesh"),
     Column("ATE of the poses, cm", 1, 100.0, why="fewer than three poses with a truth")),
    (mesh_row(MAP_UNMASKED, 8.9, 13.3, 19.2), mesh_row(MAP, 6.0, 6.1, 6.1),
     mesh_row(OWN_UNMASKED, 22.7, 34.7, 35.1), mesh_row(OWN, 22.7, 30.1, 33.5)),
    ("Masked: pixels of people carve free space (`--masking carve`), and own poses leave out "
     "features on people (`--odometry-masks on`); unmasked: neither. Own poses are those of "
     "`--poses vio`, their map is moved by heading and translation first (`--align-map`).",))

DETECTIONS = "humans.detection_count"
POSES = "humans.scored_pose_count"
TRACKS = ("humans.tracked_m", POSES, "humans.idf1", "humans.mota", "humans.id_switches",
          "humans.tracks_per_human")
TRACKED = by_crowd(0.65, 0.61, 0.63)
HUMANS = Table(
    "humans", "Table III, people: error of the torso", "stage",
    (Column("mean error, m", 2, 1.0, True, "no poses of people"),
     Column("over so many poses", 0, why="dsg-eval does not count them"),
     Column("IDF1, %", 1, 100.0, why="no poses of people"),
     Column("MOTA, %", 1, 100.0, why="no poses of people"),
     Column("id switches", 1, why="no poses of people"),
     Column("tracks a person", 2, why="no poses of people")),
    (Row("single image", NO_DEPTH, ("humans.raw_m", DETECTIONS, None, None, None, None),
         by_crowd(1.07, 1.09, 1.20)),
     Row("single image, filtered", NO_DEPTH,
         ("humans.filtered_m", "humans.filtered_count", None, None, None, None),
         by_crowd(0.88, 0.78, 0.97)),
     Row("tracked, the paper's graph, without depth", PAPER_GRAPH, TRACKS, TRACKED),
     Row("tracked, without depth", NO_DEPTH, TRACKS, TRACKED),
     Row("tracked, with depth", MAP, TRACKS, TRACKED),
     Row("tracked, with depth, own poses", OWN, TRACKS, TRACKED)),
    ("True poses of the robot, but for the last row. The mean over people of the mean over each "
     "one's poses, without a gate on the error: a pose belongs to the person whose detection made "
     "it. Filtered are the detections that tracks without depth are made of. Without depth the "
     "floor is taken to be at 0 m, where it is. The paper's graph (`--people paper`) drops more "
     "detections than ours: read errors together with the poses they are over.",))


def shape_row(kind, variant, poses, paper):
    cells = tuple(f"objects.{kind}.{name}" for name in
                  ("mean_error_m", "found_ratio", "truth_count", "mean_ungated_m",
                   "found_ratio_ungated", "precision", "f1"))
    yaw = ("objects.known.mean_yaw_deg",) if kind == "known" else (None,)
    return Row(f"{kind} shape, {poses} poses", variant, cells + yaw, by_crowd(*paper))


UNKNOWN = (1.31, 1.70, 1.51)
KNOWN = (0.20, 0.35, 0.38)
OBJECTS = Table(
    "objects", "Table III, objects: error of the position", "kind",
    (Column("mean error of those found, gate 1 m, m", 3, 1.0, True, "none was found"),
     Column("found, %", 1, 100.0, why="none was there to be found"),
     Column("of so many", 1),
     Column("mean error without a gate, m", 3, why="none was found"),
     Column("found without a gate, %", 1, 100.0, why="none was there to be found"),
     Column("precision, %", 1, 100.0, why="none was in the map"),
     Column("F1, %", 1, 100.0, why="none was in the map"),
     Column("yaw, degrees", 2, why="none was found")),
    (shape_row("unknown", MAP, "true", UNKNOWN), shape_row("unknown", OWN, "own", UNKNOWN),
     shape_row("known", MAP, "true", KNOWN), shape_row("known", OWN, "own", KNOWN)),
    ("Known are couches, by their CAD model (`--cad`), as in the paper. A mean over objects within "
     "1 m cannot exceed 1 m: read it together with the share found. Without a gate there are as "
     "many pairs of a class as there can be, however far apart.",))

SCORED_RELATIONS = ("ON", "NEAR", "LARGER_THAN", "ATTACHED_TO")
RELATION_CELLS = tuple(f"relations.{relation}.{name}" for relation in SCORED_RELATIONS
                       for name in ("precision", "recall", "truth_count"))
RELATIONS = Table(
    "relations", "Relations between things", "poses",
    tuple(column for relation in SCORED_RELATIONS for column in (
        Column(f"{relation}, precision, %", 1, 100.0, why="the map says none"),
        Column(f"{relation}, recall, %", 1, 100.0, why="there is none to be seen"),
        Column(f"{relation}, so many", 1, why="the map says nothing of how things lie"))),
    (Row("true poses", MAP, RELATION_CELLS), Row("own poses", OWN, RELATION_CELLS)),
    ("The paper has no figures. Definitions: docs/relations.md, docs/evaluation.md. Recall is of "
     "all that is so between things that were seen; what the map does not have, it cannot tell.",))

ROOMS_CELLS = tuple("rooms." + name for name in (
    "precision", "recall", "precision_outside_doors", "recall_outside_doors",
    "precision_one_to_one", "recall_one_to_one", "count", "count_truth", "adjacency_f1"))
ROOMS = Table(
    "rooms", "Rooms: places classified into rooms", "poses",
    (Column("precision, %", 2, 100.0, True, "no rooms"),
     Column("recall, %", 2, 100.0, True, "no rooms"),
     Column("precision outside doors, %", 2, 100.0, why="no rooms"),
     Column("recall outside doors, %", 2, 100.0, why="no rooms"),
     Column("precision one to one, %", 2, 100.0, why="no rooms"),
     Column("recall one to one, %", 2, 100.0, why="no rooms"),
     Column("rooms", 1, why="no rooms"), Column("rooms there", 1),
     Column("adjacency F1, %", 1, 100.0, why="no neighbouring rooms in the map")),
    (Row("true poses", MAP, ROOMS_CELLS, {12: (99.89, 99.84)}),
     Row("own poses", OWN, ROOMS_CELLS, {12: (99.89, 99.84)})),
    ("Rooms of which less than half was seen are not evaluated.",),
    "the paper gives uH_01 alone", is_log=False)


PICK_CELLS = ("picks.truth_count", "picks.mapped_count", "picks.noticed_count",
              "picks.prediction_count", "picks.right_count", "picks.precision", "picks.recall",
              "picks.brier")
PICK = Table(
    "pick", "Who picked what", "poses",
    (Column("picks to be seen", 1), Column("objects in the map", 1),
     Column("noticed to be gone", 1), Column("told", 1), Column("named right", 1),
     Column("precision of those above 0.6, %", 1, 100.0, why="nothing was told above 0.6"),
     Column("recall, %", 1, 100.0, why="nothing was told, or no pick was to be seen"),
     Column("Brier score", 3, why="nothing was told")),
    (Row("true poses", MAP, PICK_CELLS), Row("own poses", OWN, PICK_CELLS)),
    ("The paper asks the question (section VI) and has no figures. Picks to be seen are those that "
     "a camera saw; told are edges HELD_BY of the map, named right those above 0.6 that are.",))

TABLES = {table.name: table for table in (ODOMETRY, MESH, HUMANS, OBJECTS, RELATIONS, ROOMS,
                                         PICK)}
PREFACE = (
    "Tables I to III and the room figures of Rosinol et al. (RSS 2020, section V), made by "
    "`./dev tables` on simulated logs. The protocol is the paper's, the data are not: the paper's "
    "numbers (uH_01 to uH_03, 12, 24 and 60 people) tell the size of the errors, and no more. "
    "What the figures mean is in {evaluation}. Several seeds: "
    "mean ± standard deviation (median).")
RECORDED = (
    "Odometry on a recorded log, by `./dev tables`, with the numbers of Rosinol et al. (RSS 2020, "
    "Table I) beside; the paper's are of whole recordings. What the figures mean is in "
    "{evaluation}.")


def variants_of(tables, arguments):
    """The variants that the tables need, each once, with what the form adds."""
    rows = [row for table in tables for row in table.rows if row.is_small or not arguments.small]
    return list(dict.fromkeys(row.variant for row in rows))


def parse(words):
    parser = argparse.ArgumentParser(prog="./dev tables", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", choices=[*TABLES, "all"])
    parser.add_argument("--small", action="store_true", help="the apartment, 40 s")
    parser.add_argument("--world", help="default: office, with --small apartment")
    parser.add_argument("--seconds", type=float, help="default: 2400, with --small 40")
    parser.add_argument("--people", type=int, nargs="+", default=list(CROWDS))
    parser.add_argument("--seeds", type=int, nargs="+",
                        help="default: 11 12 13, with --small 11; 1 to 5 are of development")
    parser.add_argument("--variants", nargs="+", metavar="NAME",
                        help="rows of these variants alone, as 'own poses, masked' or 'dvio'")
    parser.add_argument("--mesh-samples", type=int,
                        help="of dsg-eval; default: its own, with --small 200000")
    parser.add_argument("--simulate", type=shlex.split, default=[], metavar="OPTIONS",
                        help="more for dsg-simulate, as --simulate='--imu-noise 2'")
    parser.add_argument("--ingest", type=shlex.split, default=[], metavar="OPTIONS",
                        help="more for dsg-ingest, as --ingest='--voxel 0.1'")
    parser.add_argument("--first", type=float, nargs="+", metavar="SECONDS", default=[],
                        help="odometry: tables of the first SECONDS of each log, too")
    parser.add_argument("--log", type=pathlib.Path, help="a recorded log (odometry alone)")
    parser.add_argument("--truth", type=pathlib.Path, help="its true trajectory")
    parser.add_argument("--drop", action="store_true", help="delete simulated logs once scored")
    parser.add_argument("--tables-only", action="store_true", help="run nothing")
    parser.add_argument("--bin", type=pathlib.Path, default=BUILT)
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("build/tables-data"))
    parser.add_argument("--out", type=pathlib.Path, default=table_report.ROOT / "docs/results")
    arguments = parser.parse_args(words)
    if (arguments.log is None) != (arguments.truth is None):
        parser.error("--log and --truth go together")
    if arguments.log is not None and arguments.table != "odometry":
        parser.error("a recorded log has a true trajectory alone: ./dev tables odometry --log ...")
    if arguments.first and arguments.table != "odometry":
        parser.error("--first is of odometry alone: ./dev tables odometry --first 120")
    for program in ("dsg-simulate", "dsg-ingest", "dsg-eval"):
        if not (arguments.bin / program).exists():
            parser.error(f"there is no {program} in {arguments.bin}; ./dev build release makes it")
    form = SMALL if arguments.small else FULL
    for name, default in form.items():
        if getattr(arguments, name) is None:
            setattr(arguments, name, default)
    return arguments


def logs_of(arguments):
    """Seed by seed: a run that was stopped has fewer seeds, and whole crowds."""
    if arguments.log is not None:
        name = arguments.log.resolve().name
        # By its name, "MH_01_easy" or "mh01", it has a column of the paper's table.
        plain = name.lower().replace("_", "")
        sequence = next((one for one in EUROC if one.lower().replace("_", "") in plain), name)
        return [Log(name, sequence, None, log=arguments.log, truth=arguments.truth)]
    return [simulated(arguments.world, arguments.seconds, people, seed, arguments.simulate)
            for seed in arguments.seeds for people in arguments.people]


def first_part(table, seconds):
    """The table of the first so many seconds of each log: causal poses know no more."""
    rows = tuple(dataclasses.replace(row, paper={}, variant=dataclasses.replace(
        row.variant, name=f"{row.variant.name}, {seconds:g} s",
        evaluate=(*row.variant.evaluate, "--until", f"{seconds:g}"))) for row in table.rows)
    return dataclasses.replace(table, title=f"{table.title}, the first {seconds:g} s", rows=rows,
                               notes=())


def tables_of(arguments):
    tables = list(TABLES.values()) if arguments.table == "all" else [TABLES[arguments.table]]
    tables += [first_part(ODOMETRY, seconds) for seconds in arguments.first]
    if not arguments.variants:
        return tables
    chosen = [table_report.narrowed(table, arguments.variants) for table in tables]
    return [table for table in chosen if table.rows]


def command_of(words):
    """The command without the folders of this machine."""
    words = list(words)
    for option in ("--bin", "--folder", "--out"):
        while option in words:
            at = words.index(option)
            del words[at:at + 2]
    shown = [pathlib.Path(word).name if pathlib.Path(word).is_absolute() else word
             for word in words if word != "--tables-only"]
    return " ".join(["./dev tables", *(f"'{word}'" if " " in word else word for word in shown)])


def form_of(arguments):
    if arguments.log is not None:
        return arguments.log.resolve().name
    return "small" if arguments.small else "full"


def main(words):
    arguments = parse(words)
    tables = tables_of(arguments)
    if not tables:
        say("no table has such a variant")
        return 2
    logs = logs_of(arguments)
    variants = variants_of(tables, arguments)
    runner = Runner(arguments.bin, arguments.folder, arguments.ingest, arguments.drop,
                    arguments.mesh_samples)
    status = 0
    try:
        if not arguments.tables_only:
            runner.score_all(logs, variants)
        status = 1 if runner.failed else 0
    except KeyboardInterrupt:
        say("stopped; the same command goes on from here")
        status = 130
    filled = [(table, table_report.fill(table, logs, runner, arguments.small)) for table in tables]
    for table, lines in filled:
        print(table_report.markdown_of(table, lines))
    title, preface = f"{arguments.world}, {arguments.seconds:g} s", PREFACE
    if arguments.log is not None:
        title, preface = arguments.log.resolve().name, RECORDED
    origin = table_report.provenance(command_of(words), logs, runner, variants,
                                     arguments.bin == BUILT)
    table_report.publish(arguments.out / f"{arguments.table}-{form_of(arguments)}",
                         f"Tables of the paper: {title}", preface, origin, filled)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
