// SPDX-License-Identifier: Apache-2.0
// The nearest point of a model's surface: exactly, or at once from a table.
// Refuses to change; made once for each model of the catalogue.
#pragma once

#include <memory>
#include <vector>

#include "ingest/objects/shapes/surface.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Threads: safe from many threads.
class ModelIndex {
 public:
  /// `patch_m`: edge of a patch. Requires: at least one point.
  ModelIndex(Surface surface, double patch_m);
  ~ModelIndex();
  ModelIndex(ModelIndex&&) noexcept;
  ModelIndex& operator=(ModelIndex&&) noexcept;

  const Surface& surface() const { return surface_; }
  const Box3d& box() const { return box_; }

  /// Index of the nearest surface point. Cost: about a microsecond.
  int Nearest(const Eigen::Vector3d& point_model) const;
  /// The same for the middle of the point's table cell, a few centimetres off; -1 far from the
  /// model. Cost: one look-up.
  int NearestQuickly(const Eigen::Vector3d& point_model) const;

  /// The patch that a surface point belongs to.
  int patch(int index) const { return patches_[static_cast<size_t>(index)]; }
  int patch_count() const { return patch_count_; }

 private:
  struct Tree;

  void FillTable();
  void FillPatches(double patch_m);

  Surface surface_;
  Box3d box_;
  std::unique_ptr<Tree> tree_;
  double cell_m_ = 0.0;
  Eigen::Vector3d table_min_ = Eigen::Vector3d::Zero();
  std::array<int64_t, 3> table_size_{};
  std::vector<int32_t> table_;
  std::vector<int32_t> patches_;
  int patch_count_ = 0;
};

}  // namespace dsg::ingest
