// SPDX-License-Identifier: Apache-2.0
// Forgetting changes no answer that has nothing to do with what was forgotten: a thousand random
// questions at any revision are answered to the last bit as before, unless they name what is gone.
#include <gtest/gtest.h>

#include <cstdio>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "tests/property/question.h"

namespace dsg::test {
namespace {

constexpr int kPruneQuestionCount = 1'000;

struct Asked {
  Question question;
  ComparedAnswer before;
};

bool IsEqual(const ComparedAnswer& a, const ComparedAnswer& b) {
  return a.words == b.words && a.numbers == b.numbers;
}

bool Names(const Asked& asked, const std::vector<std::string>& gone) {
  std::string all = asked.question.text;
  for (const std::string& word : asked.before.words) absl::StrAppend(&all, " ", word);
  for (const std::string& id : gone) {
    if (absl::StrContains(all, id)) return true;
  }
  return false;
}

// The room and all that is in nothing else, as a plain walk finds it.
std::vector<std::string> BranchOf(const NaiveMap& map, NodeId root) {
  std::vector<std::string> names = {ToString(root), map.nodes.at(root).name};
  for (const NodeId id : AllBelow(map, root)) {
    const auto parents = ParentsOf(map, id);
    if (parents != std::vector<NodeId>{root}) continue;
    names.push_back(ToString(id));
    if (!map.nodes.at(id).name.empty()) names.push_back(map.nodes.at(id).name);
  }
  return names;
}

std::vector<Asked> AskSome(const QuestionWorld& world, Asker* asker, uint64_t seed) {
  std::vector<QuestionKind> kinds;
  for (const auto& some :
       {NodeQuestions(), EdgeQuestions(), LocateQuestions(), PresenceQuestions()}) {
    kinds.insert(kinds.end(), some.begin(), some.end());
  }
  Random random(seed, 900);
  std::vector<Asked> asked;
  while (asked.size() < kPruneQuestionCount) {
    const QuestionKind& kind =
        kinds[static_cast<size_t>(random.Index(static_cast<int>(kinds.size())))];
    if (kind.needs_lossless && !world.is_lossless()) continue;
    Question question = kind.make(world, &random);
    asker->page_size = 1000;
    ComparedAnswer before = question.ask(asker);
    asked.push_back({std::move(question), std::move(before)});
  }
  return asked;
}

TEST(Pruning, ChangesNoAnswerThatHasNothingToDoWithIt) {
  const uint64_t seed = TestSeed(66);
  const QuestionWorld world(seed, TrajectoryCodec::kLossless, Writing::kPlain);
  Asker asker{&world};
  const std::vector<Asked> asked = AskSome(world, &asker, seed);
  const auto gone = BranchOf(world.At(world.head()), NodeId('R', 1));

  v1::PruneRequest request;
  request.set_map(QuestionWorld::kMap);
  request.add_policies()->set_branch("R1");
  const absl::Status pruned =
      query::ReadStream(asker.call, world.core()->Prune(asker.call, request),
                        [](const v1::PruneResponse&) { return true; });
  ASSERT_TRUE(pruned.ok()) << pruned;

  int same_count = 0;
  int named_count = 0;
  for (const Asked& one : asked) {
    const ComparedAnswer after = one.question.ask(&asker);
    if (IsEqual(after, one.before)) {
      ++same_count;
    } else if (Names(one, gone)) {
      ++named_count;
    } else {
      ADD_FAILURE() << one.question.text << " was answered otherwise";
    }
  }
  std::printf("%d questions: %d answered as before, %d name what is gone\n", kPruneQuestionCount,
              same_count, named_count);
  EXPECT_GT(same_count, kPruneQuestionCount / 3);
}

}  // namespace
}  // namespace dsg::test
