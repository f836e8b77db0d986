// SPDX-License-Identifier: Apache-2.0
// The true bodies of people as the cameras saw them: one mesh a detection, in truth/bodies.bin.
// A long log's fill gigabytes, so they are written and read one by one.
//
// Layout, little-endian: "DSGBODY1", u32 vertex count; per body i64 id of its detection, then
// three i16 a vertex: minus the pelvis, axes of the map, tenths of a millimetre.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/files/output_file.h"

namespace dsg::truth {

class BodyFileWriter {
 public:
  /// `folder`: that of the truth. Errors: of OutputFile.
  static absl::StatusOr<BodyFileWriter> Create(const std::string& folder, size_t vertex_count);
  /// Metres, against the pelvis. Requires: as many vertices as Create was told.
  absl::Status Add(int64_t detection_id, const std::vector<Eigen::Vector3f>& vertices_root_map);
  absl::Status Commit() { return file_.Commit(); }

 private:
  explicit BodyFileWriter(ingest::OutputFile file, size_t vertex_count)
      : file_(std::move(file)), vertex_count_(vertex_count) {}

  ingest::OutputFile file_;
  size_t vertex_count_;
};

/// Threads: one caller at a time.
class BodyFile {
 public:
  /// nullopt if the truth has no bodies. Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the file.
  static absl::StatusOr<std::optional<BodyFile>> Open(const std::string& folder);

  size_t vertex_count() const { return vertex_count_; }
  size_t body_count() const { return offset_of_.size(); }
  /// Metres, against the pelvis, axes of the map; nullopt for a detection without a body.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED if the file shrank meanwhile.
  absl::StatusOr<std::optional<std::vector<Eigen::Vector3f>>> Read(int64_t detection_id);

 private:
  std::string path_;
  std::ifstream file_;
  size_t vertex_count_ = 0;
  std::map<int64_t, std::streamoff> offset_of_;
};

}  // namespace dsg::truth
