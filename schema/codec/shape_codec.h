// SPDX-License-Identifier: Apache-2.0
// Body shapes of one agent on one topology as one blob: a segment of the store.
// The store decides where a segment ends, and of which revision it is.
//
// Layout, little-endian (docs/storage_format.md):
//   header      u8 version, u8 codec, u8 1 with a topology or 0, 32 bytes of its SHA-256, varint
//               shape count, i64 first time [ns], varints of the later times minus the ones before
//   sizes       per shape: u8 1 if as the shape before, or u8 0 and four varints: pose
//               coefficients, shape coefficients, joint numbers, vertex numbers
//   body        varint length, then coefficients and joints of all shapes
//   vertices    the rest
// Quantised: whole steps, foretold from the shape before or the number before, and range-coded.
// Lossless: the bits of floats, XORed with those foretold, bytes shuffled, compressed with zstd.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/graph_delta.h"
#include "schema/model/layer.h"

namespace dsg {

/// Steps of the quantised codec. Half a step is the largest error.
inline constexpr double kShapeVertexStepM = 1e-3;
inline constexpr double kShapeJointStepM = 1e-3;
inline constexpr double kPoseCoefficientStep = 5e-4;
inline constexpr double kShapeCoefficientStep = 5e-4;

/// A segment holds no more, so that reading one shape decodes at most so many.
inline constexpr size_t kShapesPerSegmentMax = 32;

/// Shapes that were decoded.
struct DecodedShapes {
  std::optional<Sha256> topology;
  std::vector<BodyShape> shapes;
  /// One a shape, also where the vertices were left encoded.
  std::vector<uint32_t> vertex_counts;

  size_t memory_bytes() const;
};

/// Requires: at most kShapesPerSegmentMax shapes within the limits of CheckDelta, numbers finite.
std::string EncodeShapes(const ShapeAppend& shapes, TrajectoryCodec codec);

/// Only the times. False if the bytes are no encoded shapes.
bool DecodeShapeTimes(std::string_view bytes, std::vector<TimeNs>* times);
/// Only the topology; the first 35 bytes are enough. False if they are no encoded shapes.
bool DecodeShapeTopology(std::string_view bytes, std::optional<Sha256>* topology);
/// `with_vertices`: else only their count, which is much cheaper. False if the bytes are no encoded
/// shapes. Verify the checksum first: this finds bad structure, not bad numbers.
bool DecodeShapes(std::string_view bytes, bool with_vertices, DecodedShapes* shapes);

}  // namespace dsg
