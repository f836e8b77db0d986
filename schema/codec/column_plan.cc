// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/column_plan.h"

#include <algorithm>
#include <bit>
#include <cstdlib>

namespace dsg {
namespace {

// A line's slope must not overflow when it is scaled; wider columns are stored as differences.
constexpr int64_t kLineSpanMax = int64_t{1} << 40;

int64_t SlopeOf(int64_t last_minus_first, size_t count) {
  return count < 2 ? 0 : last_minus_first * 65536 / static_cast<int64_t>(count - 1);
}

uint64_t Subtract(int64_t a, int64_t b) {
  return static_cast<uint64_t>(a) - static_cast<uint64_t>(b);
}

// Bits that hold every number from `low` to `high` as a distance from `low`.
int WidthOf(int64_t low, int64_t high) {
  return static_cast<int>(std::bit_width(Subtract(high, low)));
}

ColumnPlan PlanDeltas(const int64_t* values, size_t count) {
  int64_t low = values[1] - values[0];
  int64_t high = low;
  for (size_t i = 2; i < count; ++i) {
    low = std::min(low, values[i] - values[i - 1]);
    high = std::max(high, values[i] - values[i - 1]);
  }
  ColumnPlan plan;
  plan.delta = true;
  plan.first = values[0];
  plan.width = WidthOf(low, high);
  plan.residual_min = low;
  return plan;
}

}  // namespace

ColumnPlan PlanColumn(const int64_t* values, size_t count) {
  ColumnPlan plan;
  plan.first = values[0];
  if (count == 1) return plan;
  plan.last_minus_first = values[count - 1] - values[0];
  const ColumnPlan deltas = PlanDeltas(values, count);
  if (std::abs(plan.last_minus_first) >= kLineSpanMax) return deltas;
  plan.slope = SlopeOf(plan.last_minus_first, count);
  int64_t high = 0;
  for (size_t i = 1; i < count; ++i) {
    const int64_t residual = values[i] - plan.Line(i);
    plan.residual_min = std::min(plan.residual_min, residual);
    high = std::max(high, residual);
  }
  plan.width = WidthOf(plan.residual_min, high);
  return deltas.width < plan.width ? deltas : plan;
}

size_t ColumnBytes(const ColumnPlan& plan, size_t count) {
  const int header = 1 + VarintSize(ZigZag(plan.first)) + VarintSize(ZigZag(plan.residual_min)) +
                     (plan.delta ? 0 : VarintSize(ZigZag(plan.last_minus_first)));
  return static_cast<size_t>(header) + plan.ResidualBytes(count);
}

void AppendPlan(const ColumnPlan& plan, std::string* out) {
  out->push_back(static_cast<char>(plan.width << 1 | (plan.delta ? 1 : 0)));
  AppendVarint(ZigZag(plan.first), out);
  AppendVarint(ZigZag(plan.residual_min), out);
  if (!plan.delta) AppendVarint(ZigZag(plan.last_minus_first), out);
}

void AppendResiduals(const ColumnPlan& plan, const int64_t* values, size_t count,
                     std::string* out) {
  BitWriter bits(out);
  for (size_t i = 0; i < count; ++i) {
    // The first row of a delta column is the base itself; its field is zero.
    int64_t residual = plan.residual_min;
    if (!plan.delta) {
      residual = values[i] - plan.Line(i);
    } else if (i > 0) {
      residual = values[i] - values[i - 1];
    }
    bits.Append(Subtract(residual, plan.residual_min), plan.width);
  }
  bits.Flush();
}

bool ReadPlan(size_t count, ByteReader* in, ColumnPlan* plan) {
  const auto tag = in->Fixed<uint8_t>();
  plan->delta = (tag & 1) != 0;
  plan->width = tag >> 1;
  plan->first = UnZigZag(in->Varint());
  plan->residual_min = UnZigZag(in->Varint());
  plan->last_minus_first = plan->delta ? 0 : UnZigZag(in->Varint());
  if (plan->width > 64 || std::abs(plan->last_minus_first) >= kLineSpanMax) return false;
  plan->slope = SlopeOf(plan->last_minus_first, count);
  return true;
}

}  // namespace dsg
