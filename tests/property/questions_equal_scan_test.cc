// SPDX-License-Identifier: Apache-2.0
// Every kind of question, ten thousand times: what the engine answers from its indexes is what a
// scan of everything answers, at any revision, in pages of any size, however the map was written.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

#include "tests/property/question.h"

namespace dsg::test {
namespace {

constexpr int kWorldCount = 5;
constexpr int kQuestionCount = 10'000;
constexpr int kQuestionCountAcrossWritings = 500;

std::vector<QuestionKind> AllKinds() {
  std::vector<QuestionKind> all;
  for (const auto& some :
       {NodeQuestions(), EdgeQuestions(), LocateQuestions(), PresenceQuestions(),
        CollisionQuestions(), PathQuestions(), DiffQuestions(), SearchQuestions()}) {
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

int AnyPageSize(Random* random) {
  if (random->Chance(0.1)) return random->Integer(1, 4);
  return random->Chance(0.4) ? random->Integer(5, 40) : 1000;
}

bool IsClose(double got, double expected, const Question& question) {
  return got >= expected - question.tolerance &&
         got <= expected * (1.0 + question.stretch) + question.tolerance;
}

std::string Print(const ComparedAnswer& answer) {
  std::string text;
  for (const std::string& word : answer.words) text += testing::PrintToString(word) + " ";
  for (const double number : answer.numbers) text += testing::PrintToString(number) + " ";
  return text;
}

testing::AssertionResult IsSameAnswer(const ComparedAnswer& got, const ComparedAnswer& expected,
                                      const Question& question) {
  bool same = got.words == expected.words && got.numbers.size() == expected.numbers.size();
  for (size_t i = 0; same && i < got.numbers.size(); ++i) {
    same = IsClose(got.numbers[i], expected.numbers[i], question);
  }
  if (same) return testing::AssertionSuccess();
  return testing::AssertionFailure()
         << question.text << "\n     got: " << Print(got) << "\nexpected: " << Print(expected);
}

bool IsEmpty(const ComparedAnswer& answer) {
  return answer.words.empty() || answer.words.front().starts_with("error") ||
         answer.words.front() == "no path" || answer.words.front() == "nothing";
}

std::vector<std::unique_ptr<QuestionWorld>> MakeWorlds(uint64_t seed) {
  std::vector<std::unique_ptr<QuestionWorld>> worlds;
  for (uint64_t i = 0; i < kWorldCount; ++i) {
    const auto codec = i % 2 == 0 ? TrajectoryCodec::kLossless : TrajectoryCodec::kQuantized;
    worlds.push_back(std::make_unique<QuestionWorld>(seed + i, codec, Writing::kPlain));
  }
  return worlds;
}

TEST(Questions, AreAnsweredAsByAScanAtAnyRevisionInPagesOfAnySize) {
  const uint64_t seed = TestSeed(51);
  const auto worlds = MakeWorlds(seed);
  uint64_t stream = 100;
  for (const QuestionKind& kind : AllKinds()) {
    SCOPED_TRACE(kind.name);
    Random random(seed, stream++);
    int empty_count = 0;
    int wrong_count = 0;
    for (int i = 0; i < kQuestionCount && wrong_count < 3; ++i) {
      // Every other world is lossless.
      const auto any = static_cast<size_t>(random.Index(kWorldCount));
      const QuestionWorld& world = *worlds[kind.needs_lossless ? any / 2 * 2 : any];
      const Question question = kind.make(world, &random);
      Asker asker{&world, AnyPageSize(&random)};
      const ComparedAnswer expected = question.scan();
      const testing::AssertionResult same = IsSameAnswer(question.ask(&asker), expected, question);
      EXPECT_TRUE(same) << "question " << i;
      if (!same) ++wrong_count;
      if (IsEmpty(expected)) ++empty_count;
    }
    std::printf("%s: %d questions, %d empty\n", kind.name, kQuestionCount, empty_count);
    // A test of questions that find nothing would prove little.
    EXPECT_LT(empty_count, kQuestionCount * 3 / 4);
  }
}

TEST(Questions, AreAnsweredTheSameHoweverTheMapWasWritten) {
  const uint64_t seed = TestSeed(61);
  const QuestionWorld plain(seed, TrajectoryCodec::kLossless, Writing::kPlain);
  const QuestionWorld mixed(seed, TrajectoryCodec::kLossless, Writing::kShuffledAndSplit);
  ASSERT_GT(mixed.StoredRevision(mixed.head()), plain.head());
  uint64_t stream = 200;
  for (const QuestionKind& kind : AllKinds()) {
    SCOPED_TRACE(kind.name);
    Random random(seed, stream++);
    for (int i = 0; i < kQuestionCountAcrossWritings && !HasFailure(); ++i) {
      Question question = kind.make(plain, &random);
      // Now to the last digit.
      question.tolerance = 0.0;
      question.stretch = 0.0;
      Asker one{&plain, AnyPageSize(&random)};
      Asker other{&mixed, AnyPageSize(&random)};
      EXPECT_TRUE(IsSameAnswer(question.ask(&other), question.ask(&one), question))
          << "question " << i;
    }
  }
}

}  // namespace
}  // namespace dsg::test
