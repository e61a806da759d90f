#include "core/keycolor/words/prompt_phrases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

Pairs Parse(const std::string& prompt) {
  Pairs pairs;
  for (const ColorPhrase& phrase : ParsePrompt(prompt).phrases) {
    pairs.emplace_back(phrase.color.name, phrase.thing);
  }
  return pairs;
}

TEST(PromptPhrasesTest, ParsesColorsBeforeThings) {
  EXPECT_EQ(Parse("Red brick castle, blue sky and green grass"),
            (Pairs{{"red", "brick castle"}, {"blue", "sky"}, {"green", "grass"}}));
  EXPECT_EQ(Parse("a golden autumn forest, blue sky & white clouds"),
            (Pairs{{"golden", "autumn forest"}, {"blue", "sky"}, {"white", "clouds"}}));
  EXPECT_EQ(Parse("the owl wears a green scarf"), (Pairs{{"green", "scarf"}}));
  EXPECT_EQ(Parse("red roses in front of a grey stone wall"),
            (Pairs{{"red", "roses"}, {"grey", "stone wall"}}));
  EXPECT_EQ(Parse("red car blue door"), (Pairs{{"red", "car"}, {"blue", "door"}}));
  EXPECT_EQ(Parse("an orange on an orange table"), (Pairs{{"orange", "table"}}));
}

TEST(PromptPhrasesTest, ParsesColorsAfterThings) {
  EXPECT_EQ(Parse("the sky is blue. Roses are red"), (Pairs{{"blue", "sky"}, {"red", "roses"}}));
  EXPECT_EQ(Parse("paint the roof red"), (Pairs{{"red", "roof"}}));
  EXPECT_EQ(Parse("the house in light yellow"), (Pairs{{"light yellow", "house"}}));
  EXPECT_EQ(Parse("the door should be green, the wall white"),
            (Pairs{{"green", "door"}, {"white", "wall"}}));
}

TEST(PromptPhrasesTest, ParsesTwoWordNamesModifiersAndHex) {
  EXPECT_EQ(
      Parse("pale sky-blue shirt; #4682B4 door, reddish hair, dark night, #fff wall"),
      (Pairs{
          {"pale sky blue", "shirt"}, {"#4682b4", "door"}, {"reddish", "hair"}, {"#fff", "wall"}}));
}

TEST(PromptPhrasesTest, NotesOmittedWords) {
  const ParsedPrompt parsed = ParsePrompt("red, blue sky and a green sky");
  ASSERT_EQ(parsed.phrases.size(), 1u);
  ASSERT_EQ(parsed.notes.size(), 2u);
  EXPECT_THAT(parsed.notes[0], testing::HasSubstr("red"));
  EXPECT_THAT(parsed.notes[1], testing::HasSubstr("green"));
}

TEST(PromptPhrasesTest, RefusesPromptsWithoutColor) {
  for (const std::string prompt : {"", "a castle by the sea", "red", "#12345 wall", "\xff\xfe"}) {
    try {
      ParsePrompt(prompt);
      ADD_FAILURE() << prompt;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      EXPECT_THAT(error.what(), testing::HasSubstr("turquoise"));
    }
  }
  EXPECT_THROW(ParsePrompt(std::string(2001, 'a')), Error);
  std::string many;
  for (int i = 0; i < 33; ++i) many += "red thing" + std::to_string(i) + ", ";
  EXPECT_THROW(ParsePrompt(many), Error);
}

TEST(ColorNamesTest, FindsEveryNameOfSortedTable) {
  const std::vector<std::string> names = KnownColorNames();
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
  for (const std::string& name : names) {
    const size_t space = name.find(' ');
    std::vector<std::string> words{name.substr(0, space)};
    if (space != std::string::npos) words.push_back(name.substr(space + 1));
    const auto color = ColorAt(words, 0);
    ASSERT_TRUE(color.has_value()) << name;
    EXPECT_EQ(color->name, name);
    EXPECT_EQ(color->words, words.size());
  }
}

TEST(ColorNamesTest, HuesMatchTheirNames) {
  const auto ab = [](const char* name) {
    const auto color = ColorAt({name}, 0);
    return std::pair{color->lab.a, color->lab.b};
  };
  EXPECT_GT(ab("red").first, 30.0);
  EXPECT_LT(ab("green").first, -20.0);
  EXPECT_GT(ab("yellow").second, 40.0);
  EXPECT_LT(ab("blue").second, -25.0);
  for (const char* name : {"white", "grey", "black"}) {
    EXPECT_LT(std::hypot(ab(name).first, ab(name).second), 1.0);
  }
  EXPECT_NEAR(ab("#ff0000").first, 80.1, 0.2);
  EXPECT_LT(ColorAt({"pale", "red"}, 0)->lab.a, 0.5 * ab("red").first);
}

TEST(ColorNamesTest, ChromaFallsTowardsBlackAndWhite) {
  const LabColor color{60.0, 40.0, -20.0};
  EXPECT_DOUBLE_EQ(ChromaAtLuminance(color, 60.0).a, 40.0);
  EXPECT_DOUBLE_EQ(ChromaAtLuminance(color, 30.0).a, 20.0);
  EXPECT_DOUBLE_EQ(ChromaAtLuminance(color, 80.0).b, -10.0);
  EXPECT_DOUBLE_EQ(ChromaAtLuminance(color, 0.0).a, 0.0);
  EXPECT_DOUBLE_EQ(ChromaAtLuminance(color, 120.0).a, 0.0);
  EXPECT_TRUE(std::isfinite(ChromaAtLuminance({0.0, 1.0, 1.0}, 0.0).a));
}

}  // namespace
}  // namespace color3d
