// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/onnx_check.h"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/agents/detector/onnx_tensor.h"
#include "ingest/agents/detector/wire_reader.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Graphs lie in graphs as branches of conditions; real networks nest once or twice.
constexpr int kDepthMax = 16;

// Tensors that may be read at a place of a graph: true when they depend on the image.
using Names = std::map<std::string_view, bool>;

absl::Status Malformed(const std::string& what) { return MakeError(Reason::kFileMalformed, what); }

// The last bytes of a field, as protocol buffers take it.
std::string_view FindBytes(std::string_view message, uint64_t number) {
  std::string_view bytes;
  WireReader reader(message);
  while (!reader.AtEnd()) {
    const std::optional<WireField> field = reader.Next();
    if (!field.has_value()) break;
    if (field->number == number && field->is_bytes) bytes = field->bytes;
  }
  return bytes;
}

absl::Status CheckGraph(std::string_view message, Names names, int depth);

absl::Status CheckAttribute(std::string_view message, const Names& names, int depth) {
  return ForEachField(message, [&](const WireField& field) -> absl::Status {
    if (!field.is_bytes) return absl::OkStatus();
    if (field.number == 5 || field.number == 10) return CheckOnnxTensor(field.bytes);
    if (field.number == 6 || field.number == 11) return CheckGraph(field.bytes, names, depth + 1);
    return absl::OkStatus();
  });
}

struct Step {
  std::string_view type;
  std::vector<std::string_view> inputs;
  std::vector<std::string_view> outputs;
};

std::string Quoted(std::string_view name) {
  return absl::StrCat("\"", std::string(name.substr(0, 80)), "\"");
}

// OpenCV's search for patterns follows names without asking whether they lead anywhere.
absl::Status CheckInputs(const Step& step, const Names& names) {
  for (const std::string_view name : step.inputs) {
    if (name.empty() || names.contains(name)) continue;
    return Malformed(absl::StrCat("has a step ", Quoted(step.type), " that needs tensor ",
                                  Quoted(name),
                                  ", which nothing before it makes; export it again"));
  }
  return absl::OkStatus();
}

bool DependsOnImage(std::string_view name, const Names& names) {
  const auto entry = names.find(name);
  return entry != names.end() && entry->second;
}

// OpenCV 4.6 ends the process on these instead of throwing.
absl::Status CheckFatalSteps(const Step& step, const Names& names) {
  constexpr std::string_view kNeedImage[] = {"ArgMax", "ArgMin", "Equal", "Greater", "Less"};
  const auto depends = [&](std::string_view name) { return DependsOnImage(name, names); };
  const bool needs_image = std::ranges::find(kNeedImage, step.type) != std::end(kNeedImage);
  if (needs_image && std::ranges::none_of(step.inputs, depends)) {
    return Malformed(absl::StrCat("has a step ", Quoted(step.type),
                                  " of constants only, which OpenCV cannot read; simplify the "
                                  "model (fold its constants)"));
  }
  if (step.type == "CumSum" && step.inputs.size() > 1 && depends(step.inputs[1])) {
    return Malformed(
        "has a step \"CumSum\" along an axis that the image decides, which OpenCV "
        "cannot read; export it with a constant axis");
  }
  return absl::OkStatus();
}

absl::Status CheckNode(std::string_view message, int depth, Names* names) {
  Step step;
  DSG_RETURN_IF_ERROR(ForEachField(message, [&](const WireField& field) -> absl::Status {
    if (!field.is_bytes) return absl::OkStatus();
    if (field.number == 1) step.inputs.push_back(field.bytes);
    if (field.number == 2) step.outputs.push_back(field.bytes);
    if (field.number == 4) step.type = field.bytes;
    if (field.number == 5) return CheckAttribute(field.bytes, *names, depth);
    return absl::OkStatus();
  }));
  DSG_RETURN_IF_ERROR(CheckInputs(step, *names));
  DSG_RETURN_IF_ERROR(CheckFatalSteps(step, *names));
  // OpenCV knows all sizes before it runs, so that a shape is a constant to it.
  const bool depends =
      step.type != "Shape" && std::ranges::any_of(step.inputs, [&](std::string_view name) {
        return DependsOnImage(name, *names);
      });
  for (const std::string_view name : step.outputs) (*names)[name] = depends;
  return absl::OkStatus();
}

absl::Status CheckGraph(std::string_view message, Names names, int depth) {
  if (depth > kDepthMax) return Malformed("nests graphs too deep for a network");
  DSG_RETURN_IF_ERROR(ForEachField(message, [&](const WireField& field) -> absl::Status {
    if (!field.is_bytes) return absl::OkStatus();
    // Old files list constants among the inputs too.
    if (field.number == 11) names.try_emplace(FindBytes(field.bytes, 1), true);
    if (field.number != 5) return absl::OkStatus();
    names[FindBytes(field.bytes, 8)] = false;
    return CheckOnnxTensor(field.bytes);
  }));
  return ForEachField(message, [&](const WireField& field) {
    const bool is_node = field.number == 1 && field.is_bytes;
    return is_node ? CheckNode(field.bytes, depth, &names) : absl::OkStatus();
  });
}

}  // namespace

absl::Status CheckOnnx(std::string_view bytes) {
  bool has_graph = false;
  DSG_RETURN_IF_ERROR(ForEachField(bytes, [&](const WireField& field) -> absl::Status {
    if (field.number != 7 || !field.is_bytes) return absl::OkStatus();
    has_graph = true;
    return CheckGraph(field.bytes, {}, 0);
  }));
  return has_graph ? absl::OkStatus() : BrokenMessage();
}

}  // namespace dsg::ingest
