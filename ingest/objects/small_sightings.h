// SPDX-License-Identifier: Apache-2.0
// Things of one labelled depth picture that may be small: where they are, and how much is seen.
// Refuses to say whether a thing was seen before, or whether its class is one of small things.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ingest/objects/small_options.h"
#include "ingest/sensor/depth_frame.h"
#include "schema/model/geometry.h"
#include "schema/model/node.h"

namespace dsg::ingest {

struct SmallSighting {
  int32_t class_id = -1;
  /// From its seen side to its far one, along the floor: things about as high as wide are taken to
  /// be as deep as they are wide, others to be flat and seen as a whole.
  Eigen::Vector3d hidden_map = Eigen::Vector3d::Zero();
  /// Middle of the thing, half of what is hidden included, and how far off that may be.
  Eigen::Vector3d center_map = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  /// Of what is seen of it, and its diagonal.
  Box3d box_map;
  double span_m = 0.0;
  /// Along the optical axis, metres.
  double depth_m = 0.0;
  /// Nothing cuts it: the picture's border, something nearer, a person.
  bool is_whole = false;
  /// It touches a person who is about as far away.
  bool is_held = false;
  /// Some of its surface, none of things larger than SmallOptions::span_m.
  std::vector<Eigen::Vector3f> points_map;
  Color color{};
};

/// Of the classes among `class_ids` (ascending). Readings of what is before or behind a thing,
/// where its label bled, are left out: the depth that most of its pixels share counts. Empty for
/// pictures without labels. Order: ascending by first pixel.
std::vector<SmallSighting> FindSmallSightings(const DepthFrame& frame,
                                              const std::vector<int32_t>& class_ids,
                                              const SmallOptions& options = {});

}  // namespace dsg::ingest
