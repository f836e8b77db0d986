// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "schema/base/random.h"

namespace dsg::evaluation {
namespace {

// Samples looked at for the nearest triangle. More help only where triangles are far smaller than
// the distance between samples.
constexpr size_t kNeighbourCount = 6;

Eigen::Vector3d Corner(const MeshBlock& mesh, uint32_t face, size_t corner) {
  return mesh.positions_map[mesh.faces[face][corner]].cast<double>();
}

std::vector<Eigen::Vector3f> PointsOf(const std::vector<SurfaceSample>& samples) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(samples.size());
  for (const SurfaceSample& sample : samples) points.push_back(sample.point_map);
  return points;
}

// Vertices, each with one face that has it, so that corners are never missed.
void AppendVertices(const MeshBlock& mesh, std::vector<SurfaceSample>* samples) {
  std::vector<uint32_t> face_of(mesh.positions_map.size(), kNoFace);
  for (uint32_t face = 0; face < mesh.faces.size(); ++face) {
    for (const uint32_t corner : mesh.faces[face]) face_of[corner] = face;
  }
  for (size_t i = 0; i < face_of.size(); ++i) {
    if (face_of[i] != kNoFace || mesh.faces.empty()) {
      samples->push_back({mesh.positions_map[i], face_of[i]});
    }
  }
}

}  // namespace

double AreaOf(const MeshBlock& mesh, uint32_t face) {
  const Eigen::Vector3d a = Corner(mesh, face, 0);
  return 0.5 * (Corner(mesh, face, 1) - a).cross(Corner(mesh, face, 2) - a).norm();
}

double AreaOf(const MeshBlock& mesh) {
  double area = 0.0;
  for (uint32_t face = 0; face < mesh.faces.size(); ++face) area += AreaOf(mesh, face);
  return area;
}

std::vector<SurfaceSample> SampleSurface(const MeshBlock& mesh, size_t count, uint64_t seed) {
  const double area = AreaOf(mesh);
  std::vector<SurfaceSample> samples;
  if (!(area > 0.0)) return samples;
  samples.reserve(count);
  Random random(seed, 0);
  const double share = area / static_cast<double>(count);
  double next = share * random.Uniform();
  double passed = 0.0;
  for (uint32_t face = 0; face < mesh.faces.size(); ++face) {
    const double face_area = AreaOf(mesh, face);
    const Eigen::Vector3d a = Corner(mesh, face, 0);
    const Eigen::Vector3d ab = Corner(mesh, face, 1) - a;
    const Eigen::Vector3d ac = Corner(mesh, face, 2) - a;
    while (samples.size() < count && next < passed + face_area) {
      // The square folded onto a triangle.
      double u = random.Uniform();
      double v = random.Uniform();
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      samples.push_back({(a + u * ab + v * ac).cast<float>(), face});
      next = share * (static_cast<double>(samples.size()) + random.Uniform());
    }
    passed += face_area;
  }
  return samples;
}

Eigen::Vector3d ClosestOnTriangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  // Inside the prism over the triangle, or on one of its sides.
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  if (squared > 0.0) {
    const double wa = (c - b).cross(point - b).dot(normal) / squared;
    const double wb = (a - c).cross(point - c).dot(normal) / squared;
    const double wc = 1.0 - wa - wb;
    if (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) return wa * a + wb * b + wc * c;
  }
  const auto on_side = [&point](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const Eigen::Vector3d step = to - from;
    const double length = step.squaredNorm();
    const double along =
        length > 0.0 ? std::clamp((point - from).dot(step) / length, 0.0, 1.0) : 0.0;
    return Eigen::Vector3d(from + along * step);
  };
  Eigen::Vector3d best = on_side(a, b);
  for (const Eigen::Vector3d& other : {on_side(b, c), on_side(c, a)}) {
    if ((other - point).squaredNorm() < (best - point).squaredNorm()) best = other;
  }
  return best;
}

Surface::Surface(const MeshBlock* mesh, size_t sample_count, uint64_t seed)
    : mesh_(mesh),
      area_m2_(AreaOf(*mesh)),
      samples_(SampleSurface(*mesh, sample_count, seed)),
      even_sample_count_(samples_.size()),
      index_({}) {
  AppendVertices(*mesh, &samples_);
  index_ = PointIndex(PointsOf(samples_));
}

SurfacePoint Surface::Nearest(const Eigen::Vector3d& point) const {
  SurfacePoint best;
  best.distance_m = std::numeric_limits<double>::infinity();
  for (const Neighbour& neighbour : index_.Nearest(point, kNeighbourCount)) {
    const SurfaceSample& sample = samples_[neighbour.index];
    const Eigen::Vector3d closest =
        sample.face == kNoFace
            ? Eigen::Vector3d(sample.point_map.cast<double>())
            : ClosestOnTriangle(point, Corner(*mesh_, sample.face, 0),
                                Corner(*mesh_, sample.face, 1), Corner(*mesh_, sample.face, 2));
    const double distance = (closest - point).norm();
    if (distance < best.distance_m) best = {closest, distance, sample.face};
  }
  return best;
}

double Surface::DistanceToSamples(const Eigen::Vector3d& point) const {
  const std::vector<Neighbour> nearest = index_.Nearest(point, 1);
  return nearest.empty() ? std::numeric_limits<double>::infinity() : nearest[0].distance_m;
}

uint32_t Surface::LabelAt(const SurfacePoint& place) const {
  if (mesh_->labels.empty() || place.face == kNoFace) return 0;
  uint32_t label = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (const uint32_t corner : mesh_->faces[place.face]) {
    const double distance = (mesh_->positions_map[corner].cast<double>() - place.point_map).norm();
    if (distance < nearest) {
      nearest = distance;
      label = mesh_->labels[corner];
    }
  }
  return label;
}

uint32_t Surface::LabelAt(const SurfaceSample& sample) const {
  return LabelAt({sample.point_map.cast<double>(), 0.0, sample.face});
}

}  // namespace dsg::evaluation
