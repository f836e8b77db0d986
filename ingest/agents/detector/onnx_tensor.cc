// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/onnx_tensor.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/agents/detector/wire_reader.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

struct TensorFacts {
  std::string name;
  std::vector<uint64_t> dims;
  uint64_t data_type = 0;
  bool is_external = false;
  std::optional<uint64_t> raw_byte_count;
  // By field: float_data, int32_data, int64_data, double_data, uint64_data.
  uint64_t typed_count = 0;
};

// Repeated numbers stand one by one or packed in one field.
absl::Status CountVarints(const WireField& field, std::vector<uint64_t>* values, uint64_t* count) {
  if (!field.is_bytes) {
    if (values != nullptr) values->push_back(field.value);
    ++*count;
    return absl::OkStatus();
  }
  WireReader reader(field.bytes);
  while (!reader.AtEnd()) {
    const std::optional<uint64_t> value = reader.Varint();
    if (!value.has_value()) return BrokenMessage();
    if (values != nullptr) values->push_back(*value);
    ++*count;
  }
  return absl::OkStatus();
}

absl::Status ReadTensorField(const WireField& field, TensorFacts* facts) {
  uint64_t ignored = 0;
  switch (field.number) {
    case 1:
      return CountVarints(field, &facts->dims, &ignored);
    case 2:
      facts->data_type = field.value;
      break;
    case 4:
      facts->typed_count += field.bytes.size() / 4;
      break;
    case 5:
    case 7:
    case 11:
      return CountVarints(field, nullptr, &facts->typed_count);
    case 8:
      facts->name = std::string(field.bytes.substr(0, 80));
      break;
    case 9:
      facts->raw_byte_count = field.bytes.size();
      break;
    case 10:
      facts->typed_count += field.bytes.size() / 8;
      break;
    case 14:
      facts->is_external = field.value != 0;
      break;
    default:
      break;
  }
  return absl::OkStatus();
}

// 0 for types that OpenCV does not read, and says so itself.
uint64_t BytesPerNumber(uint64_t data_type) {
  switch (data_type) {
    case 1:  // float
    case 6:  // int32
      return 4;
    case 2:  // uint8
    case 3:  // int8
    case 9:  // bool
      return 1;
    case 10:  // float16
      return 2;
    case 7:   // int64
    case 11:  // double
      return 8;
    default:
      return 0;
  }
}

// Nothing when there are more than fit in a file that is read.
std::optional<uint64_t> NumberCount(const std::vector<uint64_t>& dims) {
  uint64_t count = 1;
  for (const uint64_t dim : dims) {
    if (dim == 0) return 0;
  }
  for (const uint64_t dim : dims) {
    constexpr uint64_t kNumberCountMax = uint64_t{1} << 30;
    if (dim > kNumberCountMax || count * dim > kNumberCountMax) return std::nullopt;
    count *= dim;
  }
  return count;
}

}  // namespace

absl::Status CheckOnnxTensor(std::string_view message) {
  TensorFacts facts;
  DSG_RETURN_IF_ERROR(ForEachField(
      message, [&](const WireField& field) { return ReadTensorField(field, &facts); }));
  if (facts.is_external) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat("keeps tensor \"", facts.name,
                                  "\" in another file; save the model as one file"));
  }
  const std::optional<uint64_t> count = NumberCount(facts.dims);
  const uint64_t number_bytes = BytesPerNumber(facts.data_type);
  if (count.has_value() && number_bytes == 0) return absl::OkStatus();
  const bool is_sound =
      count.has_value() &&
      (!facts.raw_byte_count.has_value() || *facts.raw_byte_count == *count * number_bytes ||
       (*facts.raw_byte_count == 0 && facts.typed_count == *count)) &&
      (facts.typed_count == *count || (facts.typed_count == 0 && facts.raw_byte_count.has_value()));
  if (is_sound) return absl::OkStatus();
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat("holds tensor \"", facts.name,
                                "\" with more or fewer numbers than its shape says; export it "
                                "again"));
}

}  // namespace dsg::ingest
