// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "query/engine/search/pattern.h"
#include "query/engine/search/query_language.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/search/furnished_map.h"

namespace dsg::query {
namespace {

std::string Canonical(const std::string& text) {
  const auto pattern = ParseQuery(text);
  return pattern.ok() ? FormatQuery(*pattern) : std::string(pattern.status().message());
}

TEST(QueryLanguage, ReadsWhatPeopleSay) {
  const std::pair<const char*, const char*> examples[] = {
      {"cup", "cup"},
      {"the red cup", "cup and color = red"},
      {"any", "any"},
      {"room \"Dining room\"", "room and name = \"Dining room\""},
      {"red cup on table in \"Dining room\"",
       "cup and color = red and ON (table and IN (\"Dining room\"))"},
      {"red cup on (table) in \"Dining room\"",
       "cup and color = red and ON (table) and IN (\"Dining room\")"},
      {"cup on table and in kitchen", "cup and ON (table) and IN (kitchen)"},
      {"cup and color = red on table in (room \"Dining room\")",
       "cup and color = red and ON (table and IN (room and name = \"Dining room\"))"},
      {"class = \"dining table\" and weight > 2.5", "class = \"dining table\" and weight > 2.5"},
      {"room adjacent to kitchen", "room and ADJACENT (kitchen)"},
      {"name = \"Mug*\"", "name = Mug*"},
      {"not on table", "any and not ON (table)"},
      {"cup and not on table", "cup and not ON (table)"},
      {"chair near desk", "chair and NEAR (desk)"},
      {"object inside R3", "object and INSIDE (R3)"},
      {"room with cup", "room and reversed INSIDE (cup)"},
      {"table under lamp", "table and reversed ON (lamp)"},
      {"human holding cup", "human and reversed HELD_BY (cup)"},
      {"cup held by human", "cup and HELD_BY (human)"},
      {"has weight and has \"of oak\"", "has weight and has \"of oak\""},
      {"\"class\" = 5 and broken = TRUE", "\"class\" = 5 and broken = true"},
      {"material = oak", "material = \"oak\""},
      {"orange", "orange"},
      {"orange orange", "orange and color = orange"},
      {"cup and gray", "cup and color = grey"},
      {"robot sees human", "robot and sees (human)"},
      {"any relation \"part of\" lamp", "any and relation \"part of\" (lamp)"},
      {"((cup))", "cup"},
      {"cup or mug", "cup or mug"},
      {"red cup or mug on table", "cup and color = red or mug and ON (table)"},
      {"cup and red or mug", "cup and color = red or mug"},
      {"(cup or mug) and red", "color = red and (cup or mug)"},
      {"(cup or mug) on (table or desk)", "(cup or mug) and ON (table or desk)"},
      {"cup on table or desk", "cup and ON (table) or desk"},
      {"(cup or mug) or plate", "(cup or mug) or plate"},
      {"cup and (red or blue)", "cup and (red or blue)"},
      {"(cup or mug) and (red or blue)", "(cup or mug) and (red or blue)"},
      {"any and (red cup) and (a1 or b1)", "any and (cup and color = red) and (a1 or b1)"},
      {"not red", "any and not (color = red)"},
      {"cup and not red", "cup and not (color = red)"},
      {"cup not red", "cup and not (color = red)"},
      {"not red cup", "any and not (cup and color = red)"},
      {"not the cup on table", "any and not (cup and ON (table))"},
      {"not (cup or mug) on table", "any and not (cup or mug) and ON (table)"},
      {"object and not (cup or mug)", "object and not (cup or mug)"},
      {"object and not weight > 2", "object and not (weight > 2)"},
      {"object and not has owner", "object and not (has owner)"},
      {"not (not red)", "any and not (any and not (color = red))"},
      {"robot and not sees the table", "robot and not sees (table)"},
      {"cup on table not red", "cup and ON (table and not (color = red))"},
      {"human in level 2", "human and IN (\"level 2\")"},
      {"human in (room \"office 4\" or level -1)",
       "human and IN (room and name = \"office 4\" or \"level -1\")"},
  };
  for (const auto& [text, canonical] : examples) {
    EXPECT_EQ(Canonical(text), canonical);
    EXPECT_EQ(Canonical(canonical), canonical);
  }
}

void ExpectMistake(const std::string& text, const std::string& position,
                   const std::string& expected) {
  const auto pattern = ParseQuery(text);
  ASSERT_FALSE(pattern.ok()) << text;
  EXPECT_EQ(ReasonOf(pattern.status()), Reason::kQueryMalformed) << text;
  const ErrorMetadata metadata = MetadataOf(pattern.status());
  EXPECT_EQ(metadata.at("position"), position) << text;
  EXPECT_NE(metadata.at("expected").find(expected), std::string::npos)
      << text << ": " << metadata.at("expected");
}

TEST(QueryLanguage, SaysWhereAMistakeIsAndWhatWasExpected) {
  ExpectMistake("", "0", "a node");
  ExpectMistake("   ", "3", "a node");
  ExpectMistake("coffee cup", "7", "a relation");
  ExpectMistake("cup on", "6", "a node");
  ExpectMistake("cup on (table", "13", ")");
  ExpectMistake("cup)", "3", "the end");
  ExpectMistake("cup and", "7", "a condition");
  ExpectMistake("cup and table", "8", "a relation");
  ExpectMistake("weight >", "8", "a number");
  ExpectMistake("weight >> 3", "7", "=");
  ExpectMistake("weight > 1e999", "9", "finite");
  ExpectMistake("color = rde", "8", "\"red\"");
  ExpectMistake("class > 3", "6", "= after class");
  ExpectMistake("class = cup and class = mug", "24", "only once");
  ExpectMistake("name = \"Mug", "11", "quotation mark");
  ExpectMistake("name = \"a\\n\"", "10", "backslash");
  ExpectMistake("broken < true", "7", "flags");
  ExpectMistake("cup # 3", "4", "a word");
  ExpectMistake("cup \xff", "4", "UTF-8");
  ExpectMistake("cup or", "6", "a node");
  ExpectMistake("or cup", "0", "a node");
  ExpectMistake("cup or and red", "7", "a node");
  ExpectMistake("cup and not", "11", "a node");
  ExpectMistake("not not red", "4", "a node");
  ExpectMistake("cup and (mug or", "15", "a node");
  ExpectMistake("cup and (mug or table", "21", ")");
  ExpectMistake(std::string(5000, 'x'), "4096", "4096");
  std::string deep = "cup";
  for (int i = 0; i < 9; ++i) deep += " on table";
  ExpectMistake(deep, "79", "8 levels");
  ExpectMistake(std::string(4000, '('), "8", "8 levels");
  std::string wide = "cup";
  for (int i = 0; i < 65; ++i) wide += " and has x";
  ExpectMistake(wide, "648", "64 conditions");
  std::string many = "a1";
  for (int i = 0; i < 65; ++i) many += " or b1";
  ExpectMistake(many, "387", "64 conditions");
  std::string nested = "cup";
  for (int i = 0; i < 9; ++i) nested = "not (" + nested + ")";
  ExpectMistake(nested, "44", "8 levels");
}

TEST(QueryLanguage, ShowsTheLineWithACaret) {
  const auto pattern = ParseQuery(
      "k\xc3\xbc"
      "che\n and on = 3 on #");
  ASSERT_FALSE(pattern.ok());
  const std::string message(pattern.status().message());
  EXPECT_NE(message.find("\n   and on = 3 on #\n                 ^"), std::string::npos) << message;
}

// The first column of the table of examples.
std::vector<std::string> DocumentedQueries() {
  std::ifstream file(std::string(DSG_SOURCE_DIR) + "/docs/search.md");
  std::vector<std::string> queries;
  for (std::string line; std::getline(file, line) && line != "## Grammar";) {
    if (line.rfind("| `", 0) == 0) queries.push_back(line.substr(3, line.find("` |") - 3));
  }
  return queries;
}

TEST(QueryLanguage, ReadsTheExamplesOfItsDocument) {
  const std::vector<std::string> queries = DocumentedQueries();
  ASSERT_EQ(queries.size(), 12U);
  for (const std::string& query : queries) {
    EXPECT_TRUE(ParseQuery(query).ok()) << query << ": " << ParseQuery(query).status();
  }
}

// A name of anything that may stand in quotes.
std::string RandomText(Random* random) {
  static const char* const kTexts[] = {"cup",
                                       "dining table",
                                       "a\"b\\c",
                                       "and",
                                       "red",
                                       "on",
                                       "k\xc3\xbc"
                                       "che",
                                       "the",
                                       "true",
                                       "12",
                                       "2nd",
                                       "Mug*",
                                       "next",
                                       "class",
                                       "x-1.5",
                                       "has"};
  return kTexts[random->Index(static_cast<int>(std::size(kTexts)))];
}

NodePattern WildPattern(Random* random, int depth) {
  NodePattern pattern = test::RandomPattern(random, 0);
  if (random->Chance(0.3)) pattern.class_name = RandomText(random);
  if (random->Chance(0.3)) pattern.name = RandomText(random);
  if (random->Chance(0.2)) {
    pattern.attributes.push_back(
        {RandomText(random), Comparison::kGreater, random->Normal() * 1e3});
  }
  if (random->Chance(0.2)) {
    pattern.attributes.push_back({RandomText(random), Comparison::kNotEqual, RandomText(random)});
  }
  if (random->Chance(0.2)) {
    pattern.word = RandomText(random);
    pattern.word_is_quoted = true;
  }
  while (depth > 0 && random->Chance(0.5)) {
    RelationCondition condition;
    static const char* const kRelations[] = {
        "ON", "INSIDE",  "CO_VISIBLE", "LARGER_THAN", "NEAREST_PLACE", "SEES",    "next",
        "on", "part of", "red",        "with",        "not",           "relation"};
    condition.relation = kRelations[random->Index(static_cast<int>(std::size(kRelations)))];
    condition.reversed = random->Chance(0.3);
    condition.negated = random->Chance(0.3);
    condition.other = WildPattern(random, depth - 1);
    pattern.relations.push_back(std::move(condition));
  }
  while (depth > 0 && random->Chance(0.3)) {
    NodePattern either;
    Alternatives& alternatives = either.alternatives.emplace_back();
    for (int i = random->Integer(1, 3); i > 0; --i) {
      alternatives.any_of.push_back(WildPattern(random, depth - 1));
    }
    const bool is_one = alternatives.any_of.size() == 1;
    AddAlternatives(is_one ? NodePattern(alternatives.any_of.front()) : either, random->Chance(0.4),
                    &pattern);
  }
  return pattern;
}

TEST(QueryLanguage, ReadsBackEveryPatternThatItWrites) {
  Random random(7, 1);
  for (int i = 0; i < 20'000; ++i) {
    const NodePattern pattern = WildPattern(&random, 3);
    const std::string text = FormatQuery(pattern);
    const auto read = ParseQuery(text);
    if (!read.ok() && MetadataOf(read.status()).at("expected").find("at most") == 0) continue;
    ASSERT_TRUE(read.ok()) << text << "\n" << read.status();
    ASSERT_EQ(*read, pattern) << text;
    ASSERT_EQ(FormatQuery(*read), text);
  }
}

// Either an error with a position inside the text, or a pattern that reads back as itself.
void ExpectSane(const std::string& text) {
  const auto pattern = ParseQuery(text);
  if (!pattern.ok()) {
    ASSERT_EQ(ReasonOf(pattern.status()), Reason::kQueryMalformed) << text;
    const size_t position = std::stoul(MetadataOf(pattern.status()).at("position"));
    ASSERT_LE(position, text.size()) << text;
    return;
  }
  const std::string canonical = FormatQuery(*pattern);
  const auto read = ParseQuery(canonical);
  ASSERT_TRUE(read.ok()) << text << "\n" << canonical << "\n" << read.status();
  ASSERT_EQ(*read, *pattern) << text << "\n" << canonical;
  ASSERT_EQ(FormatQuery(*read), canonical);
}

TEST(QueryLanguage, SurvivesAHundredThousandRandomAndMutatedTexts) {
  static const char* const kPieces[] = {"cup",   "red",    "on",     "in",       "(",
                                        ")",     "and",    "not",    "any",      "\"Dining room\"",
                                        "=",     "!=",     "<",      ">=",       "2.5",
                                        "-3e2",  "has",    "weight", "reversed", "relation",
                                        "the",   "next",   "to",     "O42",      "inside",
                                        "with",  "\"",     "\\",     "class",    "name",
                                        "color", "true",   "sees",   "\xc3\xbc", "\xff",
                                        "*",     "12",     "2nd",    "adjacent", "held",
                                        "by",    "orange", "\"\"",   "or",       "+",
                                        ".",     "#",      "or",     "(cup or",  "4"};
  Random random(11, 1);
  const auto piece = [&] {
    return std::string(kPieces[random.Index(static_cast<int>(std::size(kPieces)))]);
  };
  for (int i = 0; i < 50'000; ++i) {
    std::string text;
    for (int k = random.Integer(0, 14); k > 0; --k)
      text += piece() + (random.Chance(0.8) ? " " : "");
    ASSERT_NO_FATAL_FAILURE(ExpectSane(text)) << "seed 11, text " << i;
  }
  for (int i = 0; i < 50'000; ++i) {
    std::string text = FormatQuery(WildPattern(&random, 2));
    for (int k = random.Integer(1, 4); k > 0 && !text.empty(); --k) {
      const auto at = static_cast<size_t>(random.Index(static_cast<int>(text.size())));
      switch (random.Index(3)) {
        case 0:
          text.erase(at, static_cast<size_t>(random.Integer(1, 4)));
          break;
        case 1:
          text.insert(at, piece());
          break;
        default:
          text[at] = static_cast<char>(random.Integer(0, 255));
      }
    }
    ASSERT_NO_FATAL_FAILURE(ExpectSane(text)) << "seed 11, mutation " << i;
  }
}

}  // namespace
}  // namespace dsg::query
