// SPDX-License-Identifier: Apache-2.0
// How well an estimated mesh agrees with the true one: accuracy, completeness, ghosts, classes.
// Refuses to forgive a shift silently: what an alignment hides is reported beside it.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "schema/model/mesh.h"

namespace dsg::evaluation {

struct MeshOptions {
  /// On the true mesh, and on the estimate as many.
  size_t sample_count = 1'000'000;
  uint64_t seed = 1;
  /// Pairs further apart are no inliers of the ICP. Source: Kimera-VIO-Evaluation.
  double icp_gate_m = 1.5;
  int icp_rounds_max = 30;
  double complete_m = 0.1;
  double ghost_m = 0.2;
  double label_m = 0.2;
};

/// Units: metres, square metres; shares from 0 to 1.
struct MeshResult {
  /// Estimated vertices to the true surface after point-to-point ICP, inliers of the gate only.
  std::optional<double> rmse_m;
  /// The same to the nearest sample of the surface instead of the surface: the paper's protocol to
  /// the letter. It cannot fall below about half the distance between samples.
  std::optional<double> rmse_samples_m;
  double icp_inlier_share = 0.0;
  /// All vertices, no ICP, no gate.
  std::optional<double> rmse_no_icp_m;
  /// Share of the true surface that some depth image showed within `complete_m` of the estimate.
  std::optional<double> completeness;
  /// Estimated surface inside the building and further than `ghost_m` from any true one.
  std::optional<double> ghost_m2;
  /// The same wherever it is.
  std::optional<double> stray_m2;
  /// Mean over the classes of the observed true surface of TP / (TP + FP + FN), by area. True
  /// surface counts as TP when the estimate's nearest surface within `label_m` has its class, else
  /// as FN; estimated surface counts as FP when the nearest true surface within `label_m` has
  /// another class or there is none. Class 0 is "unknown" and has no IoU of its own.
  std::optional<double> miou;
  /// TP / (TP + FP + FN) of each of these classes, and how much true surface it has.
  struct ClassIou {
    double iou = 0.0;
    double truth_m2 = 0.0;
  };
  std::map<uint32_t, ClassIou> class_iou;
  double area_m2 = 0.0;
};

/// `face_observed`: for each true face, whether it can be asked for. `rooms_map`: what "inside the
/// building" means; empty = the box of the true mesh.
/// Source: after Rosinol et al. 2020, Table II.
/// Cost:   some k-d tree look-ups per sample and vertex; 1e6 samples take tens of seconds.
MeshResult EvaluateMesh(const MeshBlock& estimate, const MeshBlock& truth,
                        const std::vector<uint8_t>& face_observed,
                        const std::vector<Polygon2d>& rooms_map, const MeshOptions& options);

}  // namespace dsg::evaluation
