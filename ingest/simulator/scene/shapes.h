// SPDX-License-Identifier: Apache-2.0
// Boxes, turned bodies and leaves, from which models are put together.
// Refuses to share vertices between faces that meet at an edge, so that edges stay sharp in light.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

/// Corners counter-clockwise seen from outside.
void AddQuad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
             const Eigen::Vector3f& d, TriangleMesh* mesh);
void AddTriangle(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
                 TriangleMesh* mesh);

void AddBox(const Eigen::Vector3f& min, const Eigen::Vector3f& max, TriangleMesh* mesh);
/// A box whose edges are cut off by `cut` metres; less where the box is too thin for it.
void AddCutBox(const Eigen::Vector3f& min, const Eigen::Vector3f& max, float cut,
               TriangleMesh* mesh);

/// An upright box over a rectangle of the floor.
void AddBlock(const Rect& rect, double low_m, double high_m, TriangleMesh* mesh);
/// Upright rectangle over a line on the floor, seen from the side to which `normal` points.
void AddUpright(const Point& from, const Point& to, double low_m, double high_m,
                const Point& normal, TriangleMesh* mesh);
/// Level rectangle, seen from above or from below.
void AddLevel(const Rect& rect, double z_m, bool faces_up, TriangleMesh* mesh);

/// Turns a profile of (radius, height) about the vertical through `base`, counter-clockwise seen
/// from above. A profile that goes up is seen from outside, one that goes down from inside.
/// `stretch` scales the circle along x and y.
void AddTurned(const std::vector<Eigen::Vector2f>& profile, const Eigen::Vector3f& base,
               const Eigen::Vector2f& stretch, int side_count, TriangleMesh* mesh);
/// A closed upright cylinder.
void AddCylinder(const Eigen::Vector3f& base, float radius, float height, int side_count,
                 TriangleMesh* mesh);

/// A blade that starts at `from`, rises, bends down at its tip; thin.
void AddLeaf(const Eigen::Vector3f& from, float yaw, float reach, float rise, float width,
             TriangleMesh* mesh);

void Transform(const Eigen::Affine3f& transform, TriangleMesh* mesh);

/// Halves edges longer than `length_max` at their middle until there are none. Edges that two
/// triangles share stay shared.
void Subdivide(float length_max, TriangleMesh* mesh);

Eigen::AlignedBox3f BoundsOf(const TriangleMesh& mesh);

}  // namespace dsg::simulator
