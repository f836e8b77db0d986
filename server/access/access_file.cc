// SPDX-License-Identifier: Apache-2.0
#include "server/access/access_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/files/yaml_reader.h"
#include "schema/model/ids.h"

namespace dsg::server {
namespace {

constexpr size_t kEntriesMax = 10'000;
constexpr size_t kNameBytesMax = 64;
constexpr size_t kDigestDigits = 64;

class AccessReader : private YamlReader {
 public:
  using YamlReader::Parse;
  using YamlReader::YamlReader;

  absl::StatusOr<AccessFile> Read(const YAML::Node& root) const {
    if (!root.IsMap()) return Wrong(root, "the file is no map; begin with \"callers:\"");
    DSG_RETURN_IF_ERROR(CheckKeys(root, {"callers"}));
    const YAML::Node list = root["callers"];
    if (!list.IsDefined() || !list.IsSequence() || list.size() == 0) {
      return Wrong(list.IsDefined() ? list : root,
                   "callers is no list of at least one caller; nobody could call the server");
    }
    if (list.size() > kEntriesMax) {
      return Wrong(list, absl::StrCat("callers has more than ", kEntriesMax, " entries"));
    }
    AccessFile file;
    for (const YAML::Node& item : list) DSG_RETURN_IF_ERROR(TakeCaller(item, &file));
    return file;
  }

 private:
  absl::Status TakeCaller(const YAML::Node& item, AccessFile* file) const {
    if (!item.IsMap()) return Wrong(item, "a caller is no map; begin with \"- name:\"");
    DSG_RETURN_IF_ERROR(
        CheckKeys(item, {"name", "token_sha256", "certificate", "uid", "role", "maps", "grants"}));
    DSG_ASSIGN_OR_RETURN(const std::string name, Name(item));
    DSG_ASSIGN_OR_RETURN(std::vector<Grant> grants, Grants(item));
    const auto caller = std::make_shared<const Caller>(name, std::move(grants));
    bool is_known = false;
    const auto take = [&](const std::string& key, const auto& shown, auto* by) -> absl::Status {
      const auto [found, is_new] = by->emplace(shown, caller);
      is_known = true;
      if (is_new) return absl::OkStatus();
      return Wrong(item[key], absl::StrCat("\"", found->second->name(), "\" and \"", name,
                                           "\" have the same ", key, "; give each its own"));
    };
    if (item["token_sha256"].IsDefined()) {
      DSG_ASSIGN_OR_RETURN(const std::string digest, Digest(item["token_sha256"]));
      DSG_RETURN_IF_ERROR(take("token_sha256", digest, &file->by_token_sha256));
    }
    if (item["certificate"].IsDefined()) {
      DSG_ASSIGN_OR_RETURN(const std::string its_name, Text(item["certificate"], "certificate"));
      DSG_RETURN_IF_ERROR(take("certificate", its_name, &file->by_certificate));
    }
    if (item["uid"].IsDefined()) {
      DSG_ASSIGN_OR_RETURN(const uid_t uid, Uid(item["uid"]));
      DSG_RETURN_IF_ERROR(take("uid", uid, &file->by_uid));
    }
    if (is_known) return absl::OkStatus();
    return Wrong(item, absl::StrCat("\"", name,
                                    "\" has nothing to show; give token_sha256, certificate or "
                                    "uid (docs/access.md)"));
  }

  // Stands in logs and errors.
  absl::StatusOr<std::string> Name(const YAML::Node& item) const {
    if (!item["name"].IsDefined()) return Wrong(item, "the caller has no name");
    DSG_ASSIGN_OR_RETURN(std::string name, Text(item["name"], "name"));
    const bool is_plain =
        name.size() <= kNameBytesMax && std::all_of(name.begin(), name.end(), [](char letter) {
          return absl::ascii_isalnum(static_cast<unsigned char>(letter)) ||
                 std::string_view("._-@").find(letter) != std::string_view::npos;
        });
    // What the log calls the user of the server.
    if (name == "keeper") return Wrong(item["name"], "the name \"keeper\" is taken; give another");
    if (is_plain) return name;
    return Wrong(item["name"], absl::StrCat("a caller's name has at most ", kNameBytesMax,
                                            " letters, digits, '.', '_', '-' and '@'"));
  }

  absl::StatusOr<std::string> Digest(const YAML::Node& node) const {
    DSG_ASSIGN_OR_RETURN(const std::string digest, Text(node, "token_sha256"));
    constexpr std::string_view kDigits = "0123456789abcdef";
    if (digest == Sha256OfToken("")) return Wrong(node, "token_sha256 is that of no token at all");
    if (digest.size() == kDigestDigits && digest.find_first_not_of(kDigits) == std::string::npos) {
      return digest;
    }
    return Wrong(node,
                 "token_sha256 is no SHA-256 in 64 small hexadecimal digits; dsg-server "
                 "--new-token makes a token and the line for it");
  }

  absl::StatusOr<uid_t> Uid(const YAML::Node& node) const {
    DSG_ASSIGN_OR_RETURN(const std::string text, Text(node, "uid"));
    uint32_t uid = 0;
    if (absl::SimpleAtoi(text, &uid) && uid != static_cast<uid_t>(-1)) return uid;
    return Wrong(node, absl::StrCat("uid is \"", text,
                                    "\", which is no number of a user; `id -u` "
                                    "tells it"));
  }

  // Of one role and its maps, or of several.
  absl::StatusOr<std::vector<Grant>> Grants(const YAML::Node& item) const {
    const YAML::Node list = item["grants"];
    std::vector<Grant> grants;
    if (!list.IsDefined()) {
      DSG_ASSIGN_OR_RETURN(grants.emplace_back(), OneGrant(item));
      return grants;
    }
    if (item["role"].IsDefined() || item["maps"].IsDefined()) {
      return Wrong(list, "grants stands beside role or maps; write all of them as grants");
    }
    if (!list.IsSequence() || list.size() == 0) return Wrong(list, "grants is no list");
    for (const YAML::Node& one : list) {
      if (!one.IsMap()) return Wrong(one, "a grant is no map; begin with \"- role:\"");
      DSG_RETURN_IF_ERROR(CheckKeys(one, {"role", "maps"}));
      DSG_ASSIGN_OR_RETURN(grants.emplace_back(), OneGrant(one));
    }
    return grants;
  }

  absl::StatusOr<Grant> OneGrant(const YAML::Node& node) const {
    if (!node["role"].IsDefined()) return Wrong(node, "there is no role");
    DSG_ASSIGN_OR_RETURN(const std::string word, Text(node["role"], "role"));
    const std::optional<query::Role> role = RoleOfName(word);
    if (!role.has_value()) {
      return Wrong(node["role"], absl::StrCat("role is \"", word,
                                              "\"; give reader, writer, maintainer or admin"));
    }
    Grant grant{*role, {"*"}};
    const YAML::Node maps = node["maps"];
    if (!maps.IsDefined()) return grant;
    DSG_ASSIGN_OR_RETURN(grant.maps, Words(maps, "maps"));
    if (grant.maps.empty()) return Wrong(maps, "maps is empty; name some, or leave it out for all");
    for (const std::string& pattern : grant.maps) {
      const std::string fixed = pattern.substr(0, pattern.size() - (pattern.back() == '*'));
      if (fixed.empty() || CheckMapName(fixed).ok()) continue;
      return Wrong(maps, absl::StrCat("\"", pattern,
                                      "\" is no name of a map, and no beginning of one with a * "
                                      "behind it"));
    }
    return grant;
  }
};

// Who can change the file can do everything.
absl::Status CheckOwner(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) return absl::OkStatus();
  const bool is_ours = found.st_uid == geteuid() || found.st_uid == 0;
  if (is_ours && (found.st_mode & (S_IWGRP | S_IWOTH)) == 0) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("access file ", path, " can be changed by others, who could let in anybody; ",
                   is_ours ? "chmod go-w " : "make it yours: chown USER ", path),
      {{"field", "access"}, {"value", path}});
}

}  // namespace

absl::StatusOr<AccessFile> ReadAccessFile(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const std::string text, ReadYamlText("access file", path));
  DSG_RETURN_IF_ERROR(CheckOwner(path));
  const AccessReader reader(path);
  DSG_ASSIGN_OR_RETURN(const YAML::Node root, reader.Parse(text));
  return reader.Read(root);
}

std::string Sha256OfToken(std::string_view token) { return ToHex(ComputeSha256(token)); }

}  // namespace dsg::server
