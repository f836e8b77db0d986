// SPDX-License-Identifier: Apache-2.0
// Columns of whole numbers that resemble the number before, or the column before.
// The shape codec gives them their meaning.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "schema/codec/range_coder.h"

namespace dsg {

/// Codes one part of the bodies of one segment, column after column.
///
/// Source: the classes are Elias gamma codes (Elias, 1975) with adaptive bits, as in image coding.
class ResidualCoder {
 public:
  /// `axis_count`: 3 for points, whose x, y and z behave differently; 1 otherwise.
  /// `uses_last_size`: whether the size of the last residual foretells that of the next; says more
  /// than it costs to learn only in long columns.
  ResidualCoder(int axis_count, bool uses_last_size);

  void Encode(const std::vector<int64_t>& column, RangeEncoder* out);
  /// False when the bytes cannot have been written by Encode. Every bound on `count` is the
  /// caller's.
  bool Decode(size_t count, RangeDecoder* in, std::vector<int64_t>* column);

 private:
  static constexpr int kClassBits = 6;
  static constexpr int kContextCount = 16;
  /// Bits below the leading one that are learnt; what is left is noise.
  static constexpr int kLearntBits = 3;
  /// One context: how large residuals are.
  using Sizes = std::array<BitModel, 1 << kClassBits>;
  struct Context {
    Sizes sizes;
    std::array<BitModel, 1 << kClassBits> signs;
    std::array<std::array<BitModel, 1 << kLearntBits>, 1 << kClassBits> leading_bits;
  };
  struct Axis {
    std::array<Context, kContextCount> contexts;
    int last_size = 0;
  };

  /// How a column is foretold; the cheapest is chosen for each.
  enum class Prediction : uint8_t { kMean, kNeighbour, kBefore, kBeforeAndNeighbour };
  static constexpr int kPredictionBits = 2;

  class Predictor;

  int ChooseFor(const std::vector<int64_t>& column) const;
  /// Return the size class of the residual.
  static int EncodeOne(int64_t residual, Context* context, RangeEncoder* out);
  static int DecodeOne(Context* context, RangeDecoder* in, int64_t* residual);
  /// What the next residual of an axis hangs on.
  Context* ContextOf(Prediction kind, size_t axis);

  const size_t axis_count_;
  const bool uses_last_size_;
  std::vector<Axis> axes_;
  std::vector<int64_t> before_;
};

}  // namespace dsg
