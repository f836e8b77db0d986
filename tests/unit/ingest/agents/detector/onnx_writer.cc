// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/agents/detector/onnx_writer.h"

namespace dsg::ingest {
namespace {

constexpr int kTypeFloat = 1;
constexpr int kTypeInt64 = 7;

template <typename Value>
std::string_view RawBytes(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

WireMessage Tensor(const std::string& name, int type, const std::vector<int64_t>& shape,
                   std::string_view raw) {
  WireMessage tensor;
  for (const int64_t size : shape) tensor.Number(1, static_cast<uint64_t>(size));
  return tensor.Number(2, static_cast<uint64_t>(type)).Bytes(8, name).Bytes(9, raw);
}

WireMessage ValueInfo(const std::string& name, const std::vector<int64_t>& shape) {
  WireMessage dims;
  for (const int64_t size : shape) {
    dims.Message(1, WireMessage().Number(1, static_cast<uint64_t>(size)));
  }
  const WireMessage tensor_type = WireMessage().Number(1, kTypeFloat).Message(2, dims);
  return WireMessage().Bytes(1, name).Message(2, WireMessage().Message(1, tensor_type));
}

}  // namespace

void WireMessage::Varint(uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<char>(value | 0x80));
  bytes_.push_back(static_cast<char>(value));
}

WireMessage& WireMessage::Number(int field, uint64_t value) {
  Varint(static_cast<uint64_t>(field) << 3);
  Varint(value);
  return *this;
}

WireMessage& WireMessage::Bytes(int field, std::string_view bytes) {
  Varint(static_cast<uint64_t>(field) << 3 | 2);
  Varint(bytes.size());
  bytes_.append(bytes);
  return *this;
}

WireMessage& WireMessage::Message(int field, const WireMessage& message) {
  return Bytes(field, message.bytes());
}

WireMessage FloatTensor(const std::string& name, const std::vector<int64_t>& shape,
                        const std::vector<float>& values) {
  return Tensor(name, kTypeFloat, shape, RawBytes(values));
}

void OnnxWriter::AddInput(const std::string& name, const std::vector<int64_t>& shape) {
  graph_.Message(11, ValueInfo(name, shape));
}

void OnnxWriter::AddOutput(const std::string& name, const std::vector<int64_t>& shape) {
  graph_.Message(12, ValueInfo(name, shape));
}

void OnnxWriter::AddFloats(const std::string& name, const std::vector<int64_t>& shape,
                           const std::vector<float>& values) {
  graph_.Message(5, FloatTensor(name, shape, values));
}

void OnnxWriter::AddInts(const std::string& name, const std::vector<int64_t>& values) {
  const auto count = static_cast<int64_t>(values.size());
  graph_.Message(5, Tensor(name, kTypeInt64, {count}, RawBytes(values)));
}

void OnnxWriter::AddNode(const std::string& type, const std::vector<std::string>& inputs,
                         const std::string& output, const std::vector<Attribute>& attributes) {
  WireMessage node;
  for (const std::string& input : inputs) node.Bytes(1, input);
  node.Bytes(2, output).Bytes(3, "make_" + output).Bytes(4, type);
  for (const Attribute& attribute : attributes) {
    WireMessage message;
    message.Bytes(1, attribute.name);
    for (const int64_t value : attribute.values) {
      message.Number(attribute.is_list ? 8 : 3, static_cast<uint64_t>(value));
    }
    node.Message(5, message.Number(20, attribute.is_list ? 7 : 2));
  }
  graph_.Message(1, node);
}

std::string OnnxWriter::Bytes() const {
  constexpr int kIrVersion = 8;
  constexpr int kOpset = 13;
  WireMessage graph = graph_;
  graph.Bytes(2, "tiny");
  return WireMessage()
      .Number(1, kIrVersion)
      .Message(7, graph)
      .Message(8, WireMessage().Bytes(1, "").Number(2, kOpset))
      .bytes();
}

}  // namespace dsg::ingest
