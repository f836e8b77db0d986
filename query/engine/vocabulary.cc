// SPDX-License-Identifier: Apache-2.0
// Answers ListVocabulary: the words that a search of a revision can use, and how often each holds.
#include <map>
#include <string>
#include <tuple>

#include "absl/container/flat_hash_map.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Nodes or edges looked at between two questions to the call.
constexpr size_t kWordsCheckPeriod = 4096;

// Type, layer, text: as the reply is sorted.
using WordKey = std::tuple<int, std::string, std::string>;

std::string WordPosition(const WordKey& key) {
  const auto& [type, layer, text] = key;
  // No layer has a NUL in its name.
  return static_cast<char>('0' + type) + layer + '\0' + text;
}

// A map of a page's question has hundreds of words; it is made anew for each page.
absl::StatusOr<std::map<WordKey, int64_t>> CountWords(const GraphView& graph,
                                                      const CallContext& call) {
  std::map<WordKey, int64_t> words;
  absl::flat_hash_map<Symbol, int64_t> relations;
  absl::Status stopped;
  size_t count = 0;
  const auto goes_on = [&] {
    if (++count % kWordsCheckPeriod == 0) stopped = call.Check();
    return stopped.ok();
  };
  for (const Layer& layer : graph.layers()) {
    absl::flat_hash_map<Symbol, int64_t> kinds;
    graph.ForEachInLayer(layer.id, [&](const ViewNode& node) {
      ++kinds[node.kind];
      graph.ForEachEdgeFrom(node.id, [&](const ViewEdge& edge) {
        ++relations[edge.relation];
        return goes_on();
      });
      return goes_on();
    });
    DSG_RETURN_IF_ERROR(stopped);
    for (const auto& [kind, nodes] : kinds) {
      words[{v1::WORD_TYPE_KIND, layer.name, graph.symbols().Text(kind)}] = nodes;
    }
    for (const auto& [name, nodes] : graph.ClassesOf(layer.id)) {
      if (name == 0) continue;
      words[{v1::WORD_TYPE_CLASS, layer.name, graph.symbols().Text(name)}] = nodes;
    }
  }
  for (const auto& [relation, edges] : relations) {
    words[{v1::WORD_TYPE_RELATION, "", graph.symbols().Text(relation)}] = edges;
  }
  return words;
}

}  // namespace

absl::Status ListVocabulary(Engine* engine, const CallContext& call,
                            const v1::ListVocabularyRequest& request,
                            v1::ListVocabularyResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListVocabulary", request));
  DSG_ASSIGN_OR_RETURN(const auto graph, page.view.Graph(call.stop()));
  DSG_ASSIGN_OR_RETURN(const auto words, CountWords(*graph, call));
  page.view.FillHeader(reply->mutable_header());
  std::string last;
  for (const auto& [key, count] : words) {
    const std::string position = WordPosition(key);
    if (!page.is_first() && position <= page.position) continue;
    if (reply->words_size() == page.size) {
      reply->set_next_page_token(page.NextToken(std::move(last)));
      break;
    }
    v1::Word* word = reply->add_words();
    word->set_type(static_cast<v1::WordType>(std::get<0>(key)));
    word->set_layer(std::get<1>(key));
    word->set_text(std::get<2>(key));
    word->set_count(count);
    last = position;
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
