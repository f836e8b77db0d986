// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/policy_file.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/files/yaml_reader.h"

namespace dsg {
namespace {

constexpr size_t kPolicyCountMax = 100;
constexpr TimeNs kEveryMin = kNsPerSecond;

class PolicyReader : private YamlReader {
 public:
  using YamlReader::Parse;
  using YamlReader::YamlReader;

  absl::StatusOr<PolicyFile> Read(const YAML::Node& root) const {
    PolicyFile file;
    file.every_ns = kNsPerDay;
    if (!root.IsMap()) return Wrong(root, "the file is no map; begin with \"policies:\"");
    DSG_RETURN_IF_ERROR(CheckKeys(root, {"every", "share_max", "policies"}));
    if (root["every"].IsDefined()) {
      DSG_ASSIGN_OR_RETURN(file.every_ns, Age(root["every"], "every"));
      if (file.every_ns < kEveryMin) return Wrong(root["every"], "every is below 1s");
    }
    if (root["share_max"].IsDefined()) {
      DSG_ASSIGN_OR_RETURN(file.share_max, Number(root["share_max"], "share_max"));
      if (!(*file.share_max > 0.0 && *file.share_max <= 1.0)) {
        return Wrong(root["share_max"], "share_max is not above 0 and at most 1");
      }
    }
    const YAML::Node list = root["policies"];
    if (!list.IsDefined() || !list.IsSequence() || list.size() == 0) {
      return Wrong(list.IsDefined() ? list : root, "policies is no list of at least one policy");
    }
    if (list.size() > kPolicyCountMax) {
      return Wrong(list, absl::StrCat("policies has more than ", kPolicyCountMax, " entries"));
    }
    std::set<std::string> names;
    for (const YAML::Node& item : list) {
      DSG_ASSIGN_OR_RETURN(PrunePolicy policy, Policy(item));
      if (!names.insert(policy.name).second) {
        return Wrong(item, absl::StrCat("two policies are named \"", policy.name, "\""));
      }
      file.policies.push_back(std::move(policy));
    }
    return file;
  }

 private:
  using Take = std::function<absl::Status(const YAML::Node&, PrunePolicy*)>;

  absl::StatusOr<TimeNs> Age(const YAML::Node& node, const std::string& key) const {
    DSG_ASSIGN_OR_RETURN(const std::string text, Text(node, key));
    const auto age_ns = ParseAge(text);
    if (!age_ns.ok()) return Wrong(node, absl::StrCat(key, ": ", age_ns.status().message()));
    return *age_ns;
  }

  absl::StatusOr<double> Number(const YAML::Node& node, const std::string& key) const {
    DSG_ASSIGN_OR_RETURN(const std::string text, Text(node, key));
    double number = 0.0;
    if (absl::SimpleAtod(text, &number) && std::isfinite(number)) return number;
    return Wrong(node, absl::StrCat(key, " is \"", text, "\", which is no number"));
  }

  absl::StatusOr<int64_t> Whole(const YAML::Node& node, const std::string& key) const {
    DSG_ASSIGN_OR_RETURN(const std::string text, Text(node, key));
    int64_t number = 0;
    if (absl::SimpleAtoi(text, &number)) return number;
    return Wrong(node, absl::StrCat(key, " is \"", text, "\", which is no whole number"));
  }

  // Nanoseconds or RFC 3339. A file serves many maps, so times relative to an epoch are not
  // allowed.
  absl::StatusOr<TimeNs> Instant(const YAML::Node& node, const std::string& key) const {
    DSG_ASSIGN_OR_RETURN(const std::string text, Text(node, key));
    if (text.starts_with("+") || text.starts_with("-")) {
      return Wrong(node, key + " must be RFC 3339 or nanoseconds; for ages take older_than");
    }
    const auto time_ns = ParseTime(text, 0);
    if (!time_ns.ok()) return Wrong(node, absl::StrCat(key, ": ", time_ns.status().message()));
    return *time_ns;
  }

  absl::StatusOr<Box3d> Box(const YAML::Node& node, const std::string& key) const {
    if (!node.IsSequence() || node.size() != 6) {
      return Wrong(node, key + " is no list of 6 numbers: [x0, y0, z0, x1, y1, z1]");
    }
    Eigen::Matrix<double, 6, 1> numbers;
    for (size_t i = 0; i < 6; ++i) {
      DSG_ASSIGN_OR_RETURN(numbers[static_cast<Eigen::Index>(i)], Number(node[i], key));
    }
    return Box3d(numbers.head<3>(), numbers.tail<3>());
  }

  // The keys of which a policy has exactly one.
  std::map<std::string, Take> Whats() const {
    using P = PrunePolicy;
    const auto age = [this](const std::string& key, auto make) -> Take {
      return [this, key, make](const YAML::Node& node, P* policy) -> absl::Status {
        DSG_ASSIGN_OR_RETURN(const TimeNs age_ns, Age(node, key));
        policy->what = make(age_ns);
        return absl::OkStatus();
      };
    };
    const auto instant = [this](const std::string& key, auto make) -> Take {
      return [this, key, make](const YAML::Node& node, P* policy) -> absl::Status {
        DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, Instant(node, key));
        policy->what = make(at_ns);
        return absl::OkStatus();
      };
    };
    const auto text = [this](const std::string& key, auto make) -> Take {
      return [this, key, make](const YAML::Node& node, P* policy) -> absl::Status {
        DSG_ASSIGN_OR_RETURN(const std::string word, Text(node, key));
        policy->what = make(word);
        return absl::OkStatus();
      };
    };
    return {
        {"branch", text("branch", [](const std::string& id) { return P::Branch{id}; })},
        {"layer", text("layer", [](const std::string& name) { return P::WholeLayer{name}; })},
        {"before", instant("before", [](TimeNs t) { return P::Before{t}; })},
        {"unseen_since", instant("unseen_since", [](TimeNs t) { return P::UnseenSince{t}; })},
        {"older_than", age("older_than", [](TimeNs age_ns) { return P::OlderThan{age_ns}; })},
        {"unseen_for", age("unseen_for", [](TimeNs age_ns) { return P::UnseenFor{age_ns}; })},
        {"history_older_than",
         age("history_older_than", [](TimeNs age_ns) { return P::HistoryOlderThan{age_ns}; })},
        {"history_before_revision",
         [this](const YAML::Node& node, P* policy) -> absl::Status {
           DSG_ASSIGN_OR_RETURN(const int64_t number, Whole(node, "history_before_revision"));
           policy->what = P::HistoryBefore{number};
           return absl::OkStatus();
         }},
        {"region",
         [this](const YAML::Node& node, P* policy) -> absl::Status {
           DSG_ASSIGN_OR_RETURN(const Box3d box, Box(node, "region"));
           policy->what = P::Region{box};
           return absl::OkStatus();
         }},
    };
  }

  absl::Status TakeWhat(const YAML::Node& item, PrunePolicy* policy) const {
    std::string taken;
    for (const auto& [key, take] : Whats()) {
      const YAML::Node value = item[key];
      if (!value.IsDefined()) continue;
      if (!taken.empty()) {
        return Wrong(value,
                     absl::StrCat("the policy has ", taken, " and ", key, "; write two policies"));
      }
      taken = key;
      DSG_RETURN_IF_ERROR(take(value, policy));
    }
    return absl::OkStatus();
  }

  absl::Status TakeRest(const YAML::Node& item, PrunePolicy* policy) const {
    if (item["layers"].IsDefined()) {
      DSG_ASSIGN_OR_RETURN(policy->layers, Words(item["layers"], "layers"));
      if (policy->layers.empty()) {
        return Wrong(item["layers"], "layers is empty; name some, or leave it out for all");
      }
    }
    if (item["simplify"].IsDefined()) {
      DSG_ASSIGN_OR_RETURN(policy->simplify_m, Number(item["simplify"], "simplify"));
      if (policy->simplify_m <= 0.0) return Wrong(item["simplify"], "simplify is not above 0");
    }
    if (item["simplify_rad"].IsDefined()) {
      if (!policy->IsThinning()) {
        return Wrong(item["simplify_rad"], "simplify_rad needs simplify, in metres, beside it");
      }
      DSG_ASSIGN_OR_RETURN(policy->simplify_rad, Number(item["simplify_rad"], "simplify_rad"));
    }
    if (!item["strength"].IsDefined()) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const std::string strength, Text(item["strength"], "strength"));
    if (strength != "retire" && strength != "erase") {
      return Wrong(item["strength"],
                   absl::StrCat("strength is \"", strength, "\"; give retire or erase"));
    }
    policy->strength = strength == "erase" ? PruneStrength::kErase : PruneStrength::kRetire;
    return absl::OkStatus();
  }

  absl::StatusOr<PrunePolicy> Policy(const YAML::Node& item) const {
    if (!item.IsMap()) return Wrong(item, "a policy is no map; begin with \"- name:\"");
    std::set<std::string> known = {"name", "layers", "simplify", "simplify_rad", "strength"};
    for (const auto& [key, take] : Whats()) known.insert(key);
    DSG_RETURN_IF_ERROR(CheckKeys(item, known));
    PrunePolicy policy;
    if (!item["name"].IsDefined()) return Wrong(item, "the policy has no name");
    DSG_ASSIGN_OR_RETURN(policy.name, Text(item["name"], "name"));
    DSG_RETURN_IF_ERROR(TakeWhat(item, &policy));
    DSG_RETURN_IF_ERROR(TakeRest(item, &policy));
    const absl::Status valid = policy.Validate();
    if (!valid.ok()) return Wrong(item, std::string(valid.message()));
    return policy;
  }
};

}  // namespace

absl::StatusOr<PolicyFile> ParsePolicyFile(std::string_view text, const std::string& name) {
  const PolicyReader reader(name);
  DSG_ASSIGN_OR_RETURN(const YAML::Node root, reader.Parse(text));
  return reader.Read(root);
}

absl::StatusOr<PolicyFile> ReadPolicyFile(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const std::string text, ReadYamlText("policy file", path));
  return ParsePolicyFile(text, path);
}

}  // namespace dsg
