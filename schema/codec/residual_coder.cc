// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/residual_coder.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>

namespace dsg {
namespace {

// Sums and differences wrap: bytes from elsewhere may decode to numbers of any size.
int64_t Plus(int64_t a, int64_t b) {
  return static_cast<int64_t>(static_cast<uint64_t>(a) + static_cast<uint64_t>(b));
}
int64_t Minus(int64_t a, int64_t b) {
  return static_cast<int64_t>(static_cast<uint64_t>(a) - static_cast<uint64_t>(b));
}

uint64_t SizeOf(int64_t residual) {
  const auto bits = static_cast<uint64_t>(residual);
  return residual < 0 ? ~bits + 1 : bits;
}

}  // namespace

// Foretells number i of a column from those before it, in the same way on both sides.
class ResidualCoder::Predictor {
 public:
  Predictor(Prediction kind, size_t axis_count, const std::vector<int64_t>& before)
      : kind_(kind), axis_count_(axis_count), before_(before) {}

  /// Requires: column[0] to column[i - 1] are known, and all were asked for in order.
  int64_t At(size_t i, const std::vector<int64_t>& column) {
    const size_t axis = i % axis_count_;
    const bool has_neighbour = i >= axis_count_;
    const int64_t neighbour = has_neighbour ? column[i - axis_count_] : 0;
    switch (kind_) {
      case Prediction::kMean:
        if (!has_neighbour) return 0;
        sums_[axis] = Plus(sums_[axis], neighbour);
        return sums_[axis] / static_cast<int64_t>(i / axis_count_);
      case Prediction::kNeighbour:
        return neighbour;
      case Prediction::kBefore:
        return i < before_.size() ? before_[i] : 0;
      case Prediction::kBeforeAndNeighbour:
        if (i >= before_.size()) return neighbour;
        return has_neighbour ? Plus(before_[i], Minus(neighbour, before_[i - axis_count_]))
                             : before_[i];
    }
    return 0;
  }

 private:
  const Prediction kind_;
  const size_t axis_count_;
  const std::vector<int64_t>& before_;
  std::array<int64_t, 3> sums_{};
};

ResidualCoder::ResidualCoder(int axis_count, bool uses_last_size)
    : axis_count_(static_cast<size_t>(axis_count)),
      uses_last_size_(uses_last_size),
      axes_(axis_count_) {}

int ResidualCoder::ChooseFor(const std::vector<int64_t>& column) const {
  int best = 0;
  uint64_t best_cost = std::numeric_limits<uint64_t>::max();
  const int kind_count = before_.empty() ? 2 : 4;
  for (int kind = 0; kind < kind_count; ++kind) {
    Predictor predictor(static_cast<Prediction>(kind), axis_count_, before_);
    uint64_t cost = 0;
    for (size_t i = 0; i < column.size(); ++i) {
      const int64_t residual = Minus(column[i], predictor.At(i, column));
      cost += static_cast<uint64_t>(std::bit_width(SizeOf(residual)));
    }
    if (cost < best_cost) {
      best = kind;
      best_cost = cost;
    }
  }
  return best;
}

// Neighbours resemble each other in how far they are from what was foretold. Around the mean they
// say nothing; but where x is far from it is an arm, whose y and z are like those of other arms.
ResidualCoder::Context* ResidualCoder::ContextOf(Prediction kind, size_t axis) {
  int size = 0;
  if (uses_last_size_ && kind != Prediction::kMean) size = axes_[axis].last_size;
  if (uses_last_size_ && kind == Prediction::kMean && axis > 0) size = axes_[0].last_size;
  return &axes_[axis].contexts[static_cast<size_t>(std::min(size, kContextCount - 1))];
}

int ResidualCoder::EncodeOne(int64_t residual, Context* context, RangeEncoder* out) {
  const uint64_t size = SizeOf(residual);
  // 2^63 alone would need a class of its own; it cannot come from sums of steps.
  const int width = std::min(static_cast<int>(std::bit_width(size)), 63);
  Sizes& sizes = context->sizes;
  for (int bit = kClassBits - 1, node = 1; bit >= 0; --bit) {
    const bool one = ((width >> bit) & 1) != 0;
    out->Encode(one, &sizes[static_cast<size_t>(node)]);
    node = node * 2 + (one ? 1 : 0);
  }
  if (width == 0) return 0;
  out->Encode(residual < 0, &context->signs[static_cast<size_t>(width)]);
  const int learnt = std::min(width - 1, kLearntBits);
  for (int i = 0, node = 1; i < learnt; ++i) {
    const bool one = ((size >> (width - 2 - i)) & 1) != 0;
    out->Encode(one, &context->leading_bits[static_cast<size_t>(width)][static_cast<size_t>(node)]);
    node = node * 2 + (one ? 1 : 0);
  }
  out->EncodeRaw(size, width - 1 - learnt);
  return width;
}

int ResidualCoder::DecodeOne(Context* context, RangeDecoder* in, int64_t* residual) {
  Sizes& sizes = context->sizes;
  size_t node = 1;
  for (int bit = 0; bit < kClassBits; ++bit) {
    node = node * 2 + (in->Decode(&sizes[node]) ? 1 : 0);
  }
  const int width = static_cast<int>(node) - (1 << kClassBits);
  *residual = 0;
  if (width == 0) return 0;
  const bool negative = in->Decode(&context->signs[static_cast<size_t>(width)]);
  const int learnt = std::min(width - 1, kLearntBits);
  uint64_t size = 1;
  for (int i = 0; i < learnt; ++i) {
    // The bits so far, the leading one included, are the node of the tree.
    BitModel* model = &context->leading_bits[static_cast<size_t>(width)][size];
    size = size * 2 + (in->Decode(model) ? 1 : 0);
  }
  const int raw = width - 1 - learnt;
  size = (size << raw) | in->DecodeRaw(raw);
  *residual = static_cast<int64_t>(negative ? ~size + 1 : size);
  return width;
}

void ResidualCoder::Encode(const std::vector<int64_t>& column, RangeEncoder* out) {
  if (column.empty()) return;
  const int kind = ChooseFor(column);
  out->EncodeRaw(static_cast<uint64_t>(kind), kPredictionBits);
  Predictor predictor(static_cast<Prediction>(kind), axis_count_, before_);
  for (size_t i = 0; i < column.size(); ++i) {
    const int64_t residual = Minus(column[i], predictor.At(i, column));
    const size_t axis = i % axis_count_;
    axes_[axis].last_size =
        EncodeOne(residual, ContextOf(static_cast<Prediction>(kind), axis), out);
  }
  before_ = column;
}

bool ResidualCoder::Decode(size_t count, RangeDecoder* in, std::vector<int64_t>* column) {
  column->clear();
  if (count == 0) return true;
  const auto kind = static_cast<Prediction>(in->DecodeRaw(kPredictionBits));
  Predictor predictor(kind, axis_count_, before_);
  for (size_t i = 0; i < count && in->ok(); ++i) {
    const int64_t predicted = predictor.At(i, *column);
    const size_t axis = i % axis_count_;
    int64_t residual = 0;
    axes_[axis].last_size = DecodeOne(ContextOf(kind, axis), in, &residual);
    column->push_back(Plus(predicted, residual));
  }
  before_ = *column;
  return in->ok();
}

}  // namespace dsg
