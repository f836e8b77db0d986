// SPDX-License-Identifier: Apache-2.0
// A triangle mesh as a surface: samples on it, and the distance to it.
// Refuses to tell inside from outside; scanned meshes have holes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ingest/evaluation/point_index.h"
#include "schema/model/mesh.h"

namespace dsg::evaluation {

inline constexpr uint32_t kNoFace = UINT32_MAX;

struct SurfaceSample {
  Eigen::Vector3f point_map = Eigen::Vector3f::Zero();
  uint32_t face = kNoFace;
};

/// `count` points spread over the faces by area: one at a random place in each of `count` equal
/// shares of the area. Empty when there is no area.
std::vector<SurfaceSample> SampleSurface(const MeshBlock& mesh, size_t count, uint64_t seed);

double AreaOf(const MeshBlock& mesh, uint32_t face);
double AreaOf(const MeshBlock& mesh);

/// The point of a triangle nearest to a point.
Eigen::Vector3d ClosestOnTriangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// A place on a surface.
struct SurfacePoint {
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  double distance_m = 0.0;
  uint32_t face = kNoFace;
};

/// Nearest points on a mesh, found through samples: the exact distance to the triangles of the
/// nearest few samples, so never too small and too large only where the surface is very uneven.
/// A mesh without faces is taken as its vertices.
///
/// Threads: safe from many threads once built.
class Surface {
 public:
  /// `mesh` must outlive this. Each vertex of a face counts as a sample too.
  Surface(const MeshBlock* mesh, size_t sample_count, uint64_t seed);

  bool empty() const { return samples_.empty(); }
  const MeshBlock& mesh() const { return *mesh_; }
  /// Spread evenly; each stands for an equal share of area_m2().
  const std::vector<SurfaceSample>& samples() const { return samples_; }
  size_t even_sample_count() const { return even_sample_count_; }
  double area_m2() const { return area_m2_; }
  /// Requires: not empty.
  SurfacePoint Nearest(const Eigen::Vector3d& point) const;
  /// To the nearest evenly spread sample or vertex alone: what the paper's protocol measures.
  double DistanceToSamples(const Eigen::Vector3d& point) const;
  /// Label of the vertex nearest to a place on a face; 0 when the mesh has no labels.
  uint32_t LabelAt(const SurfacePoint& place) const;
  uint32_t LabelAt(const SurfaceSample& sample) const;

 private:
  const MeshBlock* mesh_;
  double area_m2_ = 0.0;
  std::vector<SurfaceSample> samples_;
  size_t even_sample_count_ = 0;
  PointIndex index_;
};

}  // namespace dsg::evaluation
