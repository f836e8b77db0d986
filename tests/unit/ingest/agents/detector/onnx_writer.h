// SPDX-License-Identifier: Apache-2.0
// Writes small ONNX files, so that tests need neither a trained network nor ONNX's own library.
// Refuses whatever the tests do not need: float and int64 tensors, one graph.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dsg::ingest {

/// A message in the wire format of protocol buffers.
class WireMessage {
 public:
  WireMessage& Number(int field, uint64_t value);
  WireMessage& Bytes(int field, std::string_view bytes);
  WireMessage& Message(int field, const WireMessage& message);

  const std::string& bytes() const { return bytes_; }

 private:
  void Varint(uint64_t value);

  std::string bytes_;
};

/// Field numbers as in onnx.proto.
class OnnxWriter {
 public:
  void AddInput(const std::string& name, const std::vector<int64_t>& shape);
  void AddOutput(const std::string& name, const std::vector<int64_t>& shape);
  void AddFloats(const std::string& name, const std::vector<int64_t>& shape,
                 const std::vector<float>& values);
  void AddInts(const std::string& name, const std::vector<int64_t>& values);

  struct Attribute {
    std::string name;
    std::vector<int64_t> values;
    bool is_list = true;
  };
  void AddNode(const std::string& type, const std::vector<std::string>& inputs,
               const std::string& output, const std::vector<Attribute>& attributes = {});

  /// The file.
  std::string Bytes() const;

 private:
  WireMessage graph_;
};

/// float tensor whose data may be of another size than its shape says.
WireMessage FloatTensor(const std::string& name, const std::vector<int64_t>& shape,
                        const std::vector<float>& values);

}  // namespace dsg::ingest
