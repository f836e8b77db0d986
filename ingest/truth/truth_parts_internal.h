// SPDX-License-Identifier: Apache-2.0
// The files of a truth folder one by one, as bytes.
// Refuses to touch the disk; truth_files.cc alone does.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "ingest/truth/truth.h"

namespace dsg::truth {

/// Rows of the other files, kept in world.json so that a file cut at a line's end is noticed.
struct RowCounts {
  uint64_t robot = 0;
  uint64_t human_states = 0;
  uint64_t detections = 0;
  uint64_t vertices = 0;
  uint64_t faces = 0;
};

/// INVALID_ARGUMENT/FILE_MALFORMED: "file: what".
absl::Status Malformed(const std::string& file, const std::string& what);

/// What world.json says: everything but the rows of the other files. Units and names as in Truth.
std::string TruthToJson(const Truth& truth);
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file and field.
absl::Status TruthFromJson(std::string_view bytes, const std::string& file, Truth* truth,
                           RowCounts* counts);

/// Rows append to `out`; the caller may empty it between calls. Doubles are written so that they
/// read back as the same bits, joints to the micrometre (a log of a crowd has millions of them).
void AppendRobotHeader(std::string* out);
void AppendRobotRow(const RobotState& state, std::string* out);
void AppendHumanHeader(std::string* out);
void AppendHumanRow(const HumanState& state, std::string* out);
void AppendDetectionHeader(std::string* out);
void AppendDetectionRow(const DetectionTruth& detection, std::string* out);

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line and field.
absl::Status ReadRobotTable(std::string_view bytes, const std::string& file, Truth* truth);
absl::Status ReadHumanTable(std::string_view bytes, const std::string& file, Truth* truth);
absl::Status ReadDetectionTable(std::string_view bytes, const std::string& file, Truth* truth);

/// Binary little-endian PLY: vertices float x y z, ushort label (class << 8 | instance); faces
/// list uchar int vertex_indices, uchar observed.
std::string MeshToPly(const MeshBlock& mesh, const std::vector<uint8_t>& face_observed);
absl::Status MeshFromPly(std::string_view bytes, const std::string& file, Truth* truth);

/// An 8-bit grey picture, the top row at the highest y, each pixel 36 times the cell's bits, so
/// that people see something.
absl::StatusOr<std::string> GridToPng(const FreeGrid& grid);
/// Reads the cells of a grid whose size is known. Errors: FILE_MALFORMED.
absl::Status GridFromPng(std::string_view bytes, const std::string& file, FreeGrid* grid);

/// Ranges, finite numbers, unit quaternions, lengths that agree, indices that exist.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the first thing that is wrong.
absl::Status CheckTruth(const Truth& truth);

}  // namespace dsg::truth
