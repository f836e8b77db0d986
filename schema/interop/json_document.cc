// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/json_document.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/file_error.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// The library's own tree builder keeps the last of two equal keys and has no limits; this one
// refuses both. Returning false from a callback stops the parser.
class TreeBuilder final : public nlohmann::json_sax<Json> {
 public:
  TreeBuilder(Json* root, std::string file) : root_(root), file_(std::move(file)) {}

  const absl::Status& status() const { return status_; }

  bool null() override { return Add(nullptr) != nullptr; }
  bool boolean(bool value) override { return Add(value) != nullptr; }
  bool number_integer(number_integer_t value) override { return Add(value) != nullptr; }
  bool number_unsigned(number_unsigned_t value) override { return Add(value) != nullptr; }
  bool number_float(number_float_t value, const string_t&) override {
    return Add(value) != nullptr;
  }
  bool string(string_t& value) override { return Add(std::move(value)) != nullptr; }
  bool binary(binary_t&) override { return Fail("the text", "binary data is not JSON text"); }
  bool start_object(std::size_t) override { return Open(Json::object()); }
  bool start_array(std::size_t) override { return Open(Json::array()); }
  bool end_object() override { return Close(); }
  bool end_array() override { return Close(); }

  bool key(string_t& name) override {
    if (open_.back()->contains(name)) {
      return Fail(absl::StrCat("key \"", name.substr(0, 64), "\""),
                  "appears twice in one object; remove one of the two");
    }
    slot_ = &(*open_.back())[name];
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    return Fail(absl::StrCat("byte ", position),
                absl::StrCat("malformed or cut JSON (", error.what(), ")"));
  }

 private:
  bool Fail(const std::string& where, const std::string& what) {
    status_ = FileError(file_, where, what);
    return false;
  }

  Json* Add(Json value) {
    if (++value_count_ > kJsonValueCountMax) {
      Fail("the text", absl::StrCat("holds more than ", kJsonValueCountMax,
                                    " values; save the graph in the binary form"));
      return nullptr;
    }
    if (open_.empty()) {
      *root_ = std::move(value);
      return root_;
    }
    Json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    *slot_ = std::move(value);
    return slot_;
  }

  bool Open(Json container) {
    if (open_.size() >= kJsonDepthMax) {
      return Fail("the text", absl::StrCat("is nested deeper than ", kJsonDepthMax, " levels"));
    }
    Json* added = Add(std::move(container));
    if (added == nullptr) return false;
    open_.push_back(added);
    return true;
  }

  bool Close() {
    open_.pop_back();
    return true;
  }

  Json* root_;
  std::string file_;
  absl::Status status_;
  // Containers still open, outermost first. A pointer stays good: nothing is added to a parent
  // while its last child is open.
  std::vector<Json*> open_;
  Json* slot_ = nullptr;
  size_t value_count_ = 0;
};

}  // namespace

absl::StatusOr<Json> ParseJson(std::string_view bytes, const std::string& file) {
  Json root;
  TreeBuilder builder(&root, file);
  if (!Json::sax_parse(bytes.begin(), bytes.end(), &builder)) return builder.status();
  return root;
}

}  // namespace dsg
