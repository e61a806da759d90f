#include "core/keycolor/words/prompt_phrases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <string_view>
#include <utility>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr size_t kMaxPromptBytes = 2000;
constexpr size_t kMaxPhrases = 32;

const std::set<std::string_view> kArticles = {"a",
                                              "an",
                                              "the",
                                              "some",
                                              "its",
                                              "his",
                                              "her",
                                              "their",
                                              "my",
                                              "our",
                                              "your",
                                              "all",
                                              "very",
                                              "this",
                                              "that",
                                              "these",
                                              "those",
                                              "each",
                                              "every"};
// Links between a thing and a following colour: "the sky is blue", "the house in red".
const std::set<std::string_view> kLinks = {
    "is", "are", "was", "were", "be", "become", "becomes", "looks", "should", "in", "to", "as"};
const std::set<std::string_view> kBreaks = {
    "and",   "with",   "on",     "under",   "behind",  "over", "near",    "beside",  "against",
    "above", "below",  "at",     "by",      "through", "from", "next",    "front",   "while",
    "but",   "where",  "which",  "of",      "for",     "make", "paint",   "color",   "colour",
    "turn",  "keep",   "has",    "have",    "wears",   "wear", "wearing", "having",  "holding",
    "holds", "before", "around", "between", "into",    "onto", "inside",  "beneath", "along"};

enum class Boundary { kNone, kLink, kBreak };

struct Clause {
  std::vector<std::string> words;
  Boundary before = Boundary::kBreak;
};

// Splits into lower-case words, with "" where punctuation ends a clause. Hyphens separate words.
std::vector<std::string> SplitWords(const std::string& prompt) {
  std::vector<std::string> words;
  std::string word;
  const auto finish = [&] {
    if (!word.empty()) words.push_back(std::exchange(word, ""));
  };
  for (const char c : prompt) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) || byte >= 0x80 || c == '#' || c == '\'') {
      word += byte < 0x80 ? static_cast<char>(std::tolower(byte)) : c;
    } else {
      finish();
      const bool space = std::isspace(byte) || c == '-' || c == '_';
      if (!space) words.emplace_back();
    }
  }
  finish();
  return words;
}

std::vector<Clause> SplitClauses(const std::string& prompt) {
  std::vector<Clause> clauses(1);
  for (std::string& word : SplitWords(prompt)) {
    if (word.empty() || kBreaks.count(word) || kLinks.count(word)) {
      const Boundary boundary =
          !word.empty() && kLinks.count(word) ? Boundary::kLink : Boundary::kBreak;
      if (clauses.back().words.empty()) {
        // "should be": a link remains one; other kinds take precedence.
        const bool only_links =
            boundary == Boundary::kLink && clauses.back().before == Boundary::kLink;
        clauses.back().before = only_links ? Boundary::kLink : boundary;
      } else {
        clauses.push_back({{}, boundary});
      }
    } else if (!kArticles.count(word)) {
      clauses.back().words.push_back(std::move(word));
    }
  }
  return clauses;
}

std::string Joined(const std::vector<std::string>& words, size_t begin, size_t end) {
  std::string text;
  for (size_t i = begin; i < end; ++i) text += (i > begin ? " " : "") + words[i];
  return text;
}

struct Mention {
  size_t begin;
  NamedColor color;
};

std::vector<Mention> ColorsIn(const std::vector<std::string>& words) {
  std::vector<Mention> mentions;
  for (size_t i = 0; i < words.size();) {
    if (auto color = ColorAt(words, i)) {
      const size_t length = color->words;
      mentions.push_back({i, std::move(*color)});
      i += length;
    } else {
      ++i;
    }
  }
  return mentions;
}

class PhraseCollector {
 public:
  // `previous`: words of the preceding clause if it has no colour, for "the sky | is | blue".
  void AddClause(const Clause& clause, const std::string& previous) {
    const std::vector<std::string>& words = clause.words;
    const std::vector<Mention> mentions = ColorsIn(words);
    for (size_t i = 0; i < mentions.size(); ++i) {
      const size_t end = mentions[i].begin + mentions[i].color.words;
      const size_t next = i + 1 < mentions.size() ? mentions[i + 1].begin : words.size();
      std::string thing = Joined(words, end, next);
      if (thing.empty() && i == 0) thing = Joined(words, 0, mentions[i].begin);
      if (thing.empty() && i == 0 && clause.before == Boundary::kLink) thing = previous;
      Add(thing, mentions[i].color);
    }
  }
  ParsedPrompt Take() { return std::move(parsed_); }

 private:
  void Add(const std::string& thing, const NamedColor& color) {
    if (thing.empty()) {
      parsed_.notes.push_back(fmt::format("\"{}\" names no thing to colour", color.name));
      return;
    }
    for (const ColorPhrase& phrase : parsed_.phrases) {
      if (phrase.thing != thing) continue;
      parsed_.notes.push_back(fmt::format(
          "\"{}\" is {} already; \"{}\" is left out", thing, phrase.color.name, color.name));
      return;
    }
    parsed_.phrases.push_back({thing, color});
  }

  ParsedPrompt parsed_;
};

std::string ListOfColors() {
  std::string text;
  for (const std::string& name : KnownColorNames()) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

ParsedPrompt ParsePrompt(const std::string& prompt) {
  if (prompt.size() > kMaxPromptBytes) {
    throw InvalidArgument("the prompt has {} bytes, at most 2000 are allowed; shorten it",
                          prompt.size());
  }
  PhraseCollector collector;
  std::string previous;
  for (const Clause& clause : SplitClauses(prompt)) {
    collector.AddClause(clause, previous);
    if (clause.words.empty()) continue;
    previous = ColorsIn(clause.words).empty() ? Joined(clause.words, 0, clause.words.size()) : "";
  }
  ParsedPrompt parsed = collector.Take();
  if (parsed.phrases.empty()) {
    throw InvalidArgument(
        "the prompt names no coloured thing; write for example \"red roof, pale blue sky\" or "
        "\"#4682b4 door\". Known colours: {}; with light, pale, dark, bright, muted and the like "
        "before them",
        ListOfColors());
  }
  if (parsed.phrases.size() > kMaxPhrases) {
    throw InvalidArgument("the prompt names {} coloured things, at most 32 are allowed",
                          parsed.phrases.size());
  }
  return parsed;
}

}  // namespace color3d
