// SPDX-License-Identifier: Apache-2.0
#include "query/view/graph_view.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

namespace dsg::query {
namespace {

std::string TextOf(int i) {
  // Some short enough for a string's own bytes, some not.
  return (i % 2 == 0 ? "s" : "a rather long name of something ") + std::to_string(i);
}

TEST(SymbolTable, CallsTheEmptyTextNought) {
  SymbolTable symbols;
  EXPECT_EQ(symbols.Intern(""), 0U);
  EXPECT_EQ(symbols.Find(""), Symbol{0});
  EXPECT_EQ(symbols.Text(0), "");
}

TEST(SymbolTable, GivesEachTextOneNumberAndTheTextBack) {
  SymbolTable symbols;
  std::vector<Symbol> numbers;
  for (int i = 0; i < 20'000; ++i) numbers.push_back(symbols.Intern(TextOf(i)));
  for (int i = 0; i < 20'000; ++i) {
    const Symbol symbol = numbers[static_cast<size_t>(i)];
    ASSERT_EQ(symbols.Text(symbol), TextOf(i));
    ASSERT_EQ(symbols.Intern(TextOf(i)), symbol);
    ASSERT_EQ(symbols.Find(TextOf(i)), symbol);
  }
  EXPECT_EQ(symbols.Find("never seen"), std::nullopt);
  EXPECT_GT(symbols.memory_bytes(), 20'000 * sizeof(std::string));
}

TEST(SymbolTable, FindsTextsWhateverTheirLetterCase) {
  SymbolTable symbols;
  const Symbol small = symbols.Intern("cup of tea");
  symbols.Intern("cups of tea");
  const Symbol capital = symbols.Intern("Cup of Tea");
  const Symbol all_capitals = symbols.Intern("CUP OF TEA");
  const Symbol umlaut = symbols.Intern(
      "K\xc3\xbc"
      "CHE");
  const std::vector<Symbol> all = {small, capital, all_capitals};
  for (const char* text : {"cup of tea", "Cup of Tea", "cUP OF TEA"}) {
    EXPECT_EQ(symbols.FindIgnoringCase(text), all) << text;
  }
  EXPECT_EQ(symbols.FindIgnoringCase("k\xc3\xbc"
                                     "che"),
            std::vector<Symbol>{umlaut});
  // Letters beyond A to Z have one case.
  EXPECT_TRUE(symbols
                  .FindIgnoringCase("k\xc3\x9c"
                                    "che")
                  .empty());
  EXPECT_TRUE(symbols.FindIgnoringCase("cup").empty());
}

TEST(SymbolTable, AgreesAmongManyThreads) {
  SymbolTable symbols;
  constexpr int kThreads = 6;
  constexpr int kTexts = 4'000;
  std::vector<std::vector<Symbol>> numbers(kThreads);
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&symbols, &mine = numbers[static_cast<size_t>(t)], t] {
      mine.resize(kTexts);
      for (int k = 0; k < kTexts; ++k) {
        const int i = (k * 7 + t * 501) % kTexts;
        const Symbol symbol = symbols.Intern(TextOf(i));
        mine[static_cast<size_t>(i)] = symbol;
        EXPECT_EQ(symbols.Text(symbol), TextOf(i));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& mine : numbers) EXPECT_EQ(mine, numbers.front());
}

}  // namespace
}  // namespace dsg::query
