// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/shape_codec.h"

#include <array>
#include <bit>
#include <cmath>

#include "schema/base/check.h"
#include "schema/codec/bit_stream.h"
#include "schema/codec/residual_coder.h"
#include "schema/codec/shuffle.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

constexpr uint8_t kShapeVersion = 1;

// One list of numbers of a body.
struct Part {
  std::vector<float> BodyShape::*numbers;
  double step;
  /// 3 for points.
  int axis_count;
  size_t count_max;
};

constexpr size_t kPartCount = 4;
constexpr size_t kVertexPart = 3;
constexpr std::array<Part, kPartCount> kParts = {
    Part{&BodyShape::pose_coefficients, kPoseCoefficientStep, 1, kShapeNumbersMax},
    Part{&BodyShape::shape_coefficients, kShapeCoefficientStep, 1, kShapeNumbersMax},
    Part{&BodyShape::joints, kShapeJointStepM, 3, kShapeNumbersMax},
    Part{&BodyShape::vertices, kShapeVertexStepM, 3, kShapeVertexNumbersMax}};

using Sizes = std::array<size_t, kPartCount>;

struct Header {
  TrajectoryCodec codec = TrajectoryCodec::kQuantized;
  std::optional<Sha256> topology;
  std::vector<TimeNs> times;
};

Sizes SizesOf(const BodyShape& shape) {
  Sizes sizes{};
  for (size_t part = 0; part < kPartCount; ++part) {
    sizes[part] = (shape.*kParts[part].numbers).size();
  }
  return sizes;
}

int64_t ToSteps(float number, double step) {
  return std::llround(static_cast<double>(number) / step);
}

float FromSteps(int64_t steps, double step) {
  return static_cast<float>(static_cast<double>(steps) * step);
}

// Codes parts [first, last) of all shapes of a segment, quantised.
class QuantizedParts {
 public:
  QuantizedParts(size_t first, size_t last) : first_(first), last_(last) {
    for (size_t part = first; part < last; ++part) {
      coders_.emplace_back(kParts[part].axis_count, /*uses_last_size=*/part == kVertexPart);
    }
  }

  std::string Encode(const std::vector<BodyShape>& shapes) {
    std::string bytes;
    RangeEncoder encoder(&bytes);
    std::vector<int64_t> column;
    for (const BodyShape& shape : shapes) {
      for (size_t part = first_; part < last_; ++part) {
        column.clear();
        for (const float number : shape.*kParts[part].numbers) {
          column.push_back(ToSteps(number, kParts[part].step));
        }
        coders_[part - first_].Encode(column, &encoder);
      }
    }
    encoder.Finish();
    return bytes;
  }

  bool Decode(std::string_view bytes, const std::vector<Sizes>& sizes,
              std::vector<BodyShape>* shapes) {
    RangeDecoder decoder(bytes);
    std::vector<int64_t> column;
    for (size_t i = 0; i < sizes.size(); ++i) {
      for (size_t part = first_; part < last_; ++part) {
        if (!coders_[part - first_].Decode(sizes[i][part], &decoder, &column)) return false;
        std::vector<float>& numbers = (*shapes)[i].*kParts[part].numbers;
        numbers.reserve(column.size());
        for (const int64_t steps : column) numbers.push_back(FromSteps(steps, kParts[part].step));
      }
    }
    return true;
  }

 private:
  const size_t first_;
  const size_t last_;
  std::vector<ResidualCoder> coders_;
};

// The number that is foretold: the same one of the shape before, else the one before it.
uint32_t ForetoldBits(const std::vector<float>& numbers, const std::vector<float>* before, size_t i,
                      size_t axis_count) {
  if (before != nullptr && before->size() > i) return std::bit_cast<uint32_t>((*before)[i]);
  return i >= axis_count ? std::bit_cast<uint32_t>(numbers[i - axis_count]) : 0;
}

// Parts [first, last) of all shapes, bit for bit.
std::string EncodeLosslessShapes(size_t first, size_t last, const std::vector<BodyShape>& shapes) {
  std::string bits;
  for (size_t s = 0; s < shapes.size(); ++s) {
    for (size_t part = first; part < last; ++part) {
      const auto axis_count = static_cast<size_t>(kParts[part].axis_count);
      const std::vector<float>& numbers = shapes[s].*kParts[part].numbers;
      const auto* before = s == 0 ? nullptr : &(shapes[s - 1].*kParts[part].numbers);
      for (size_t i = 0; i < numbers.size(); ++i) {
        AppendFixed(
            std::bit_cast<uint32_t>(numbers[i]) ^ ForetoldBits(numbers, before, i, axis_count),
            &bits);
      }
    }
  }
  return CompressShuffled(bits, sizeof(uint32_t));
}

bool DecodeLossless(size_t first, size_t last, std::string_view bytes,
                    const std::vector<Sizes>& sizes, std::vector<BodyShape>* shapes) {
  size_t count = 0;
  for (const Sizes& of_shape : sizes) {
    for (size_t part = first; part < last; ++part) count += of_shape[part];
  }
  std::string bits;
  if (!DecompressShuffled(bytes, sizeof(uint32_t), count * sizeof(uint32_t), &bits)) return false;
  ByteReader reader(bits);
  for (size_t s = 0; s < sizes.size(); ++s) {
    for (size_t part = first; part < last; ++part) {
      const auto axis_count = static_cast<size_t>(kParts[part].axis_count);
      std::vector<float>& numbers = (*shapes)[s].*kParts[part].numbers;
      const auto* before = s == 0 ? nullptr : &((*shapes)[s - 1].*kParts[part].numbers);
      numbers.reserve(sizes[s][part]);
      for (size_t i = 0; i < sizes[s][part]; ++i) {
        const uint32_t foretold = ForetoldBits(numbers, before, i, axis_count);
        numbers.push_back(std::bit_cast<float>(reader.Fixed<uint32_t>() ^ foretold));
      }
    }
  }
  return reader.ok();
}

std::string EncodeParts(size_t first, size_t last, const std::vector<BodyShape>& shapes,
                        TrajectoryCodec codec) {
  return codec == TrajectoryCodec::kLossless ? EncodeLosslessShapes(first, last, shapes)
                                             : QuantizedParts(first, last).Encode(shapes);
}

bool DecodeParts(size_t first, size_t last, std::string_view bytes, TrajectoryCodec codec,
                 const std::vector<Sizes>& sizes, std::vector<BodyShape>* shapes) {
  return codec == TrajectoryCodec::kLossless
             ? DecodeLossless(first, last, bytes, sizes, shapes)
             : QuantizedParts(first, last).Decode(bytes, sizes, shapes);
}

void AppendHeader(const ShapeAppend& item, TrajectoryCodec codec, std::string* out) {
  out->push_back(static_cast<char>(kShapeVersion));
  out->push_back(static_cast<char>(codec));
  out->push_back(item.topology.has_value() ? 1 : 0);
  if (item.topology.has_value()) {
    out->append(reinterpret_cast<const char*>(item.topology->data()), item.topology->size());
  }
  AppendVarint(item.shapes.size(), out);
  TimeNs last_ns = 0;
  for (size_t i = 0; i < item.shapes.size(); ++i) {
    const TimeNs time_ns = item.shapes[i].time_ns;
    if (i == 0) {
      AppendFixed(time_ns, out);
    } else {
      AppendVarint(static_cast<uint64_t>(time_ns) - static_cast<uint64_t>(last_ns), out);
    }
    last_ns = time_ns;
  }
}

bool ReadHeader(ByteReader* reader, Header* header) {
  if (reader->Fixed<uint8_t>() != kShapeVersion) return false;
  const auto codec = reader->Fixed<uint8_t>();
  if (codec != static_cast<uint8_t>(TrajectoryCodec::kQuantized) &&
      codec != static_cast<uint8_t>(TrajectoryCodec::kLossless)) {
    return false;
  }
  header->codec = static_cast<TrajectoryCodec>(codec);
  const auto has_topology = reader->Fixed<uint8_t>();
  if (has_topology > 1) return false;
  if (has_topology == 1) header->topology = reader->Fixed<Sha256>();
  const uint64_t count = reader->Varint();
  if (!reader->ok() || count > kShapesPerSegmentMax) return false;
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t time = i == 0 ? static_cast<uint64_t>(reader->Fixed<TimeNs>())
                                 : static_cast<uint64_t>(header->times.back()) + reader->Varint();
    header->times.push_back(static_cast<TimeNs>(time));
    if (i > 0 && header->times[i] <= header->times[i - 1]) return false;
  }
  return reader->ok();
}

void AppendSizes(const std::vector<BodyShape>& shapes, std::string* out) {
  Sizes last{};
  for (const BodyShape& shape : shapes) {
    const Sizes sizes = SizesOf(shape);
    out->push_back(sizes == last ? 1 : 0);
    if (sizes == last) continue;
    for (const size_t size : sizes) AppendVarint(size, out);
    last = sizes;
  }
}

bool ReadSizes(ByteReader* reader, size_t count, std::vector<Sizes>* sizes) {
  Sizes last{};
  for (size_t i = 0; i < count; ++i) {
    const auto is_same = reader->Fixed<uint8_t>();
    for (size_t part = 0; is_same == 0 && part < kPartCount; ++part) {
      last[part] = reader->Varint();
      const auto axis_count = static_cast<size_t>(kParts[part].axis_count);
      if (last[part] > kParts[part].count_max || last[part] % axis_count != 0) return false;
    }
    if (!reader->ok() || is_same > 1) return false;
    sizes->push_back(last);
  }
  return true;
}

}  // namespace

size_t DecodedShapes::memory_bytes() const {
  size_t bytes = sizeof(*this) + vertex_counts.capacity() * sizeof(uint32_t);
  for (const BodyShape& shape : shapes) {
    bytes += sizeof(shape);
    for (const Part& part : kParts) bytes += (shape.*part.numbers).capacity() * sizeof(float);
  }
  return bytes;
}

std::string EncodeShapes(const ShapeAppend& shapes, TrajectoryCodec codec) {
  DSG_CHECK(shapes.shapes.size() <= kShapesPerSegmentMax);
  std::string bytes;
  AppendHeader(shapes, codec, &bytes);
  AppendSizes(shapes.shapes, &bytes);
  const std::string body = EncodeParts(0, kVertexPart, shapes.shapes, codec);
  AppendVarint(body.size(), &bytes);
  return bytes + body + EncodeParts(kVertexPart, kPartCount, shapes.shapes, codec);
}

bool DecodeShapeTimes(std::string_view bytes, std::vector<TimeNs>* times) {
  ByteReader reader(bytes);
  Header header;
  if (!ReadHeader(&reader, &header)) return false;
  *times = std::move(header.times);
  return true;
}

bool DecodeShapeTopology(std::string_view bytes, std::optional<Sha256>* topology) {
  ByteReader reader(bytes);
  if (reader.Fixed<uint8_t>() != kShapeVersion) return false;
  reader.Fixed<uint8_t>();
  const auto has_topology = reader.Fixed<uint8_t>();
  if (has_topology > 1) return false;
  topology->reset();
  if (has_topology == 1) *topology = reader.Fixed<Sha256>();
  return reader.ok();
}

bool DecodeShapes(std::string_view bytes, bool with_vertices, DecodedShapes* shapes) {
  ByteReader reader(bytes);
  Header header;
  std::vector<Sizes> sizes;
  if (!ReadHeader(&reader, &header) || !ReadSizes(&reader, header.times.size(), &sizes)) {
    return false;
  }
  const uint64_t body_size = reader.Varint();
  if (!reader.ok() || body_size > reader.remaining()) return false;
  shapes->topology = header.topology;
  shapes->shapes.assign(header.times.size(), BodyShape());
  shapes->vertex_counts.clear();
  for (size_t i = 0; i < sizes.size(); ++i) {
    shapes->shapes[i].time_ns = header.times[i];
    shapes->vertex_counts.push_back(static_cast<uint32_t>(sizes[i][kVertexPart] / 3));
  }
  const std::string_view body = bytes.substr(reader.position(), body_size);
  const std::string_view vertices = bytes.substr(reader.position() + body_size);
  if (!DecodeParts(0, kVertexPart, body, header.codec, sizes, &shapes->shapes)) return false;
  return !with_vertices ||
         DecodeParts(kVertexPart, kPartCount, vertices, header.codec, sizes, &shapes->shapes);
}

}  // namespace dsg
