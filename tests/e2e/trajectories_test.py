#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dsg-eval on trajectories: against another computation, on made and on recorded ones."""

import json
import math
import os
import random
import unittest

import reference_tracks as reference
import support

DATA = os.environ.get("DSG_DATA") or os.path.join(support.ROOT, "..", "shared", "data")
RECORDED = os.path.join(DATA, "trajectories")
NEAR = 1e-9
FIRST_NS = 1_600_000_000 * support.NS_PER_S


def quaternion(v):
    """x y z w of a rotation vector."""
    t = reference.norm(v)
    scale = 0.5 if t == 0 else math.sin(t / 2) / t
    return [scale * x for x in v] + [math.cos(t / 2)]


def stamp(time_ns):
    return f"{time_ns // support.NS_PER_S}.{time_ns % support.NS_PER_S:09d}"


class Made:
    """A winding path of 60 s and 40 m, and an estimate of it in a map of another scale."""

    def __init__(self, seed=1):
        rng = random.Random(seed)
        self.truth, self.estimate = [], []
        for i in range(1201):
            t = 0.05 * i
            position = [6 * math.sin(0.2 * t), 4 * math.sin(0.37 * t), 1 + 0.3 * math.cos(t)]
            self.truth.append((FIRST_NS + 50_000_000 * i, [0.1 * math.sin(t), 0.2, 0.3 * t - 9],
                               position))
        turn = reference.exp([0.3, -0.5, 1.9])
        for i in range(5, 1190, 3):
            time_ns, vector, position = self.truth[i]
            wrong = [x + rng.gauss(0, 0.02) for x in position]
            self.estimate.append((time_ns + rng.randrange(-20_000_000, 20_000_000),
                                  [x + rng.gauss(0, 0.01) for x in vector],
                                  [0.45 * x for x in reference.turned(turn, wrong)]))

    @staticmethod
    def tum(rows):
        return "# made\n" + "".join(
            " ".join([stamp(t)] + [repr(x) for x in p + quaternion(v)]) + "\n"
            for t, v, p in rows)

    @staticmethod
    def euroc(rows):
        head = "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z\n"
        return head + "".join(
            ",".join([str(t)] + [repr(x) for x in p + [quaternion(v)[3]] + quaternion(v)[:3]]) +
            "\n" for t, v, p in rows)

    @staticmethod
    def kitti(rows):
        out = ""
        for _, v, p in rows:
            r = reference.exp(v)
            out += " ".join(repr(x) for i in range(3) for x in r[i] + [p[i]]) + "\n"
        return out


class Tracks(support.ProgramsTest):
    def write(self, name, text):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "w", encoding="utf-8") as out:
            out.write(text)
        return self.path(name)

    def evaluate(self, *arguments):
        return json.loads(self.ok("dsg-eval", "--json", *arguments))

    def file_score(self, estimate, truth, *arguments):
        report = self.evaluate("--estimate", estimate, "--truth", truth, *arguments)
        return report["tracks"]["file"]

    def assert_near(self, expected, found, what):
        if isinstance(expected, dict):
            for key, value in expected.items():
                self.assert_near(value, found[key], f"{what}.{key}")
        elif isinstance(expected, list):
            self.assertEqual(len(expected), len(found), what)
            for i, value in enumerate(expected):
                self.assert_near(value, found[i], f"{what}[{i}]")
        elif expected is None:
            self.assertIsNone(found, what)
        else:
            self.assertLessEqual(abs(expected - found), NEAR * max(1.0, abs(expected)),
                                 f"{what}: {expected} is due, {found} was found")

    def check(self, pairs, score, kind, **options):
        expected = reference.errors(pairs, kind, **options)
        scale = expected.pop("scale")
        self.assert_near(expected, score, kind)
        self.assert_near(scale, score["truth_T_estimate"]["scale"], "scale")
        self.assertEqual(len(pairs), score["pair_count"])


class MadeTracks(Tracks):
    def setUp(self):
        made = Made()
        self.truth = self.write("made/truth.txt", made.tum(made.truth))
        self.estimate = self.write("made/estimate.txt", made.tum(made.estimate))
        self.euroc = self.write("made/euroc/mav0/state_groundtruth_estimate0/data.csv",
                                made.euroc(made.truth))
        self.made = made

    def test_agrees_with_another_computation(self):
        estimate = reference.read_tum(self.estimate)
        truth = reference.read_tum(self.truth)
        pairs = reference.associated(estimate, truth, support.NS_PER_S // 10)
        for kind in ("se3", "yaw", "sim3", "none"):
            score = self.file_score(self.estimate, self.truth, "--align", kind, "--rpe-seconds",
                                    "1,7")
            self.check(pairs, score, kind, seconds=(1, 7))
            self.assert_near(reference.coverage(estimate, truth, support.NS_PER_S // 10),
                             score["coverage"], "coverage")
        by_scale = self.file_score(self.estimate, self.truth, "--align", "sim3")
        self.assertAlmostEqual(1 / 0.45, by_scale["truth_T_estimate"]["scale"], delta=0.01)
        self.assertLess(by_scale["ate"]["rmse_m"], 0.05)

    def test_says_the_same_of_all_forms_of_a_truth(self):
        by_tum = self.file_score(self.estimate, self.truth)
        for euroc in (self.euroc, self.path("made/euroc"), self.path("made/euroc/mav0")):
            self.assert_near(by_tum, self.file_score(self.estimate, euroc), "euroc")
        made = self.made
        same = self.file_score(self.write("made/same.txt", made.tum(made.truth[::3])), self.truth,
                               "--associate", "nearest", "--tolerance", "0.001")
        self.assertLess(same["ate"]["max_m"], NEAR)
        self.assertEqual(401, same["pair_count"])

    def test_rows_need_no_times(self):
        made = self.made
        truth = self.write("made/truth.kitti", made.kitti(made.truth[5:1190:3]))
        estimate = self.write("made/estimate.kitti", made.kitti(made.estimate))
        pairs = [(0, e, g) for e, g in zip(reference.read_kitti(estimate),
                                           reference.read_kitti(truth))]
        for kind in ("se3", "sim3"):
            self.check(pairs, self.file_score(estimate, truth, "--align", kind), kind)
        self.refused(2, ["395 poses", "1201"], "dsg-eval", "--estimate", estimate, "--truth",
                     self.write("made/long.kitti", made.kitti(made.truth)))
        self.refused(2, ["no times", "--associate rows"], "dsg-eval", "--estimate", estimate,
                     "--truth", truth, "--associate", "nearest")

    def test_a_trajectory_is_right_about_itself_wherever_it_lies(self):
        self.assertLess(self.file_score(self.truth, self.truth, "--align", "none")["ate"]["max_m"],
                        NEAR)
        turn, shift = [0.4, 1.0, -0.7], [100.0, -20.0, 3.0]
        moved = []
        for line in self.made.tum(self.made.estimate).splitlines()[1:]:
            fields = line.split()
            x, y, z, qx, qy, qz, qw = (float(f) for f in fields[1:])
            p = reference.added(reference.turned(reference.exp(turn), [x, y, z]), shift)
            ax, ay, az, aw = quaternion(turn)
            q = [aw * qx + ax * qw + ay * qz - az * qy, aw * qy - ax * qz + ay * qw + az * qx,
                 aw * qz + ax * qy - ay * qx + az * qw, aw * qw - ax * qx - ay * qy - az * qz]
            moved.append(" ".join([fields[0]] + [repr(v) for v in p + q]))
        moved = self.write("made/moved.txt", "\n".join(moved) + "\n")
        for kind in ("se3", "sim3"):
            here = self.file_score(self.estimate, self.truth, "--align", kind)
            there = self.file_score(moved, self.truth, "--align", kind)
            del here["truth_T_estimate"], there["truth_T_estimate"]
            self.assert_near(here, there, kind)

    def test_leaves_out_where_the_truth_has_a_gap(self):
        made = self.made
        gap = self.write("made/gap.txt", made.tum(made.truth[:400] + made.truth[500:]))
        begin, end = made.truth[399][0], made.truth[500][0]
        inside = sum(begin < row[0] < end for row in made.estimate)
        whole = self.file_score(self.estimate, self.truth)["pair_count"]
        self.assertGreater(inside, 20)
        self.assertEqual(whole - inside, self.file_score(self.estimate, gap)["pair_count"])
        self.assertEqual(whole, self.file_score(self.estimate, gap, "--tolerance", "10")
                         ["pair_count"])
        late = self.write("made/late.txt", made.tum(
            [(t + 3600 * support.NS_PER_S, v, p) for t, v, p in made.estimate]))
        report = self.evaluate("--estimate", late, "--truth", self.truth)
        self.assertIsNone(report["tracks"]["file"]["ate"])
        self.assertIn("of another log", report["notes"][0])

    def test_scores_the_robot_of_a_map(self):
        self.ok("dsg-ingest", "--store", "store", "--map", "office", self.estimate)
        by_file = self.file_score(self.estimate, self.truth)
        report = self.evaluate("--store", "store", "--map", "office", "--truth", self.truth)
        for name in ("causal", "corrected"):
            score = report["tracks"][name]
            self.assertEqual(by_file["pair_count"], score["pair_count"])
            for key, value in by_file["ate"].items():
                # Maps keep positions to a tenth of a millimetre.
                self.assertAlmostEqual(value, score["ate"][key], delta=1e-3)
        self.assertIsNone(report["loops"])
        by_euroc = self.evaluate("--store", "store", "--map", "office", "--truth",
                                 self.path("made/euroc"))
        self.assert_near(report["tracks"], by_euroc["tracks"], "euroc")
        self.refused(1, ["no robot \"nobody\"", "body"], "dsg-eval", "--store", "store", "--map",
                     "office", "--truth", self.truth, "--robot", "nobody")

    def test_scores_loop_closures(self):
        made = self.made
        laps = [(FIRST_NS + 50_000_000 * i, [0, 0, 0.05 * i],
                 [5 * math.sin(0.05 * i), -5 * math.cos(0.05 * i), 0]) for i in range(251)]
        truth = self.write("made/laps.txt", made.tum(laps))
        # A lap takes 6.28 s, less than the revisits that are looked for by default.
        lines = []
        for i, sideways in ((0, 0.0), (50, 0.3), (100, 0.7)):
            a, b = laps[i], laps[i + 126]
            back = reference.transposed(reference.exp(a[1]))
            t = reference.turned(back, reference.added(b[2], a[2], -1.0))
            lines.append(json.dumps({
                "from_ns": a[0], "to_ns": b[0], "translation": [t[0], t[1] + sideways, t[2]],
                "rotation": quaternion([0, 0, 0.05 * 126]), "sigma_m": 0.1, "sigma_rad": 0.01}))
        loops = self.write("made/loops.jsonl", "\n".join(lines) + "\n")
        report = self.evaluate("--estimate", truth, "--truth", truth, "--loops", loops,
                               "--revisit-seconds", "5")
        self.assertAlmostEqual(2 / 3, report["loops"]["precision"])
        self.assertEqual((3, 2), (report["loops"]["believed"]["judged_count"],
                                  report["loops"]["believed"]["right_count"]))
        self.assertEqual(1.0, report["loops"]["recall"])
        strict = self.evaluate("--estimate", truth, "--truth", truth, "--loops", loops,
                               "--loop-right", "0.2")
        self.assertAlmostEqual(1 / 3, strict["loops"]["precision"])

    def test_refuses_what_changes_nothing(self):
        both = ["--estimate", self.estimate, "--truth", self.truth]
        self.refused(2, ["--store"], "dsg-eval", "--truth", self.truth)
        self.refused(2, ["leave --store and --map out"], "dsg-eval", *both, "--store", "store")
        self.refused(2, ["--revision"], "dsg-eval", *both, "--revision", "1")
        self.refused(2, ["--mesh-samples"], "dsg-eval", *both, "--mesh-samples", "2000")
        self.refused(2, ["--align"], "dsg-eval", *both, "--align", "sim2")
        self.refused(2, ["--tolerance", "nan"], "dsg-eval", *both, "--tolerance", "nan")
        self.refused(2, ["--rpe-lengths"], "dsg-eval", *both, "--rpe-lengths", "5,0")
        self.refused(1, ["holds no trajectory"], "dsg-eval", "--estimate", self.estimate,
                     "--truth", self.folder)
        text = self.ok("dsg-eval", *both)
        self.assertIn("aligned by SE(3); truth interpolated over at most 0.1 s", text)
        self.assertIn("RPE over 20 m (%)", text)


@unittest.skipUnless(os.path.isdir(RECORDED), "no recorded trajectories; set DSG_DATA")
class RecordedTracks(Tracks):
    def check_tum(self, name, kinds):
        estimate_file = os.path.join(RECORDED, name)
        truth_file = os.path.join(RECORDED, "fr2_desk_groundtruth.txt")
        estimate = reference.read_tum(estimate_file)
        truth = reference.read_tum(truth_file)
        pairs = reference.associated(estimate, truth, support.NS_PER_S // 10)
        self.assertGreater(len(pairs), 100)
        for kind in kinds:
            score = self.file_score(estimate_file, truth_file, "--align", kind)
            self.check(pairs, score, kind, seconds=(1,))
            self.assert_near(reference.coverage(estimate, truth, support.NS_PER_S // 10),
                             score["coverage"], "coverage")

    def test_rgbd_slam(self):
        self.check_tum("fr2_desk_ORB.txt", ("se3", "yaw", "sim3", "none"))

    def test_keyframes_of_a_single_camera(self):
        self.check_tum("fr2_desk_ORB_kf_mono.txt", ("sim3", "se3"))

    def test_kitti_row_by_row(self):
        truth_file = os.path.join(RECORDED, "KITTI_00_gt.txt")
        truth = reference.read_kitti(truth_file)
        for name in ("ORB", "SPTAM"):
            estimate_file = os.path.join(RECORDED, f"KITTI_00_{name}.txt")
            pairs = [(0, e, g) for e, g in zip(reference.read_kitti(estimate_file), truth)]
            for kind in ("se3", "sim3", "none"):
                score = self.file_score(estimate_file, truth_file, "--align", kind,
                                        "--rpe-lengths", "1,100,800")
                self.check(pairs, score, kind, lengths_m=(1, 100, 800))

    def test_a_file_is_right_about_itself(self):
        for name in ("fr2_desk_ORB.txt", "KITTI_00_gt.txt"):
            path = os.path.join(RECORDED, name)
            for kind in ("none", "se3", "sim3"):
                score = self.file_score(path, path, "--align", kind)
                self.assertLess(score["ate"]["max_m"], 1e-9)
                self.assertLess(score["rpe"][0]["translation_percent"], 1e-9)


if __name__ == "__main__":
    unittest.main()
