// SPDX-License-Identifier: Apache-2.0
// One column of a block of a trajectory: whole numbers as a prediction plus bit-packed residuals.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "schema/codec/bit_stream.h"

namespace dsg {

/// How a column is predicted: by the line through its two ends, or by the value before.
struct ColumnPlan {
  bool delta = false;
  /// Bits of a residual.
  int width = 0;
  int64_t first = 0;
  int64_t last_minus_first = 0;
  int64_t residual_min = 0;
  /// Of the line, in 1/65536 a row.
  int64_t slope = 0;

  int64_t Line(size_t row) const {
    return first + ((slope * static_cast<int64_t>(row) + 0x8000) >> 16);
  }
  /// Of a row, from what AppendResiduals wrote.
  int64_t Residual(const char* bits, size_t row) const {
    return static_cast<int64_t>(ReadBits(bits, row, width)) + residual_min;
  }
  size_t ResidualBytes(size_t count) const { return (static_cast<size_t>(width) * count + 7) / 8; }
};

/// The plan of the fewest bits; at equal width the line, any row of which can be read without those
/// before. Requires: count > 0.
ColumnPlan PlanColumn(const int64_t* values, size_t count);

/// Bytes that AppendPlan and AppendResiduals add together.
size_t ColumnBytes(const ColumnPlan& plan, size_t count);
void AppendPlan(const ColumnPlan& plan, std::string* out);
void AppendResiduals(const ColumnPlan& plan, const int64_t* values, size_t count, std::string* out);

/// False for a plan that AppendPlan cannot have written; `in` remembers a read past its end.
bool ReadPlan(size_t count, ByteReader* in, ColumnPlan* plan);

}  // namespace dsg
