// SPDX-License-Identifier: Apache-2.0
// One mesh block with what the other map adds to it.
// Refuses faces of which all corners lie on a surface that is known.
#pragma once

#include <memory>
#include <vector>

#include "schema/merge/mesh_join.h"
#include "schema/merge/surface_index.h"

namespace dsg::merge {

class BlockPatch {
 public:
  /// The first points of `surface` are the vertices of `known`. All must outlive this.
  BlockPatch(MeshBlock known, double block_size_m, const MeshIds& ids, const SurfaceIndex& surface);

  /// Takes from `sources`, blocks of the other map in the frame of this one, the faces that begin
  /// in this block, and vertices in it that belong to no face. To be called once.
  void Add(const std::vector<std::shared_ptr<const MeshBlock>>& sources);

  bool is_changed() const { return is_changed_; }
  int64_t face_count() const { return face_count_; }
  int64_t dropped_face_count() const { return dropped_face_count_; }
  MeshBlock Take() && { return std::move(block_); }

 private:
  struct Source {
    const MeshBlock& block;
    std::vector<Eigen::Vector3f> normals;
    /// By vertex: not looked at, on no surface, or the point of the surface that it lies on.
    std::vector<int> on;
    /// By vertex: its index here, -1 while it has none.
    std::vector<int> copied;
  };

  /// Marks our vertices that an earlier merge copied from there: what the other map saw there they
  /// have, and what is near them is not news.
  void NoteCopies(Source* source);
  void AddFaces(Source* source);
  bool IsInside(const Eigen::Vector3f& position) const;
  bool IsOnSurface(size_t vertex, Source* source) const;
  uint32_t Copy(size_t vertex, Source* source);
  void MarkSeen(size_t vertex, const Source& source);
  void MatchChannels(const MeshBlock& source);

  MeshBlock block_;
  size_t known_count_;
  double block_size_m_;
  const MeshIds& ids_;
  const SurfaceIndex& surface_;
  std::vector<char> is_copy_;
  bool is_changed_ = false;
  int64_t face_count_ = 0;
  int64_t dropped_face_count_ = 0;
};

}  // namespace dsg::merge
