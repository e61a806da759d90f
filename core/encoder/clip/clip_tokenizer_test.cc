#include "core/encoder/clip/clip_tokenizer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/weights/weight_file.h"

namespace color3d {
namespace {

constexpr int kMerges = 5;
constexpr int kVocabulary = 512 + kMerges + 2;
constexpr const char* kText = "#version: 0.2\nt h\na b\nab c</w>\nth e</w>\na t</w>\n";

// Token of an ASCII letter inside of a word, and at its end.
int64_t Inside(char c) { return c - 33; }
int64_t AtEnd(char c) { return 256 + Inside(c); }
int64_t Merge(int i) { return 512 + i; }

std::vector<int64_t> Words(const std::string& text) {
  const ClipTokenizer tokenizer(kText, kVocabulary, "test");
  std::vector<int64_t> tokens = tokenizer.Tokens(text);
  EXPECT_EQ(tokens.size(), 77u);
  EXPECT_EQ(tokens[0], tokenizer.start_of_text());
  std::vector<int64_t> words;
  for (size_t i = 1; i < tokens.size() && tokens[i] != tokenizer.end_of_text(); ++i) {
    words.push_back(tokens[i]);
  }
  return words;
}

TEST(ClipTokenizerTest, MergesBestPairsFirst) {
  EXPECT_EQ(Words("the abc at"), (std::vector<int64_t>{Merge(3), Merge(2), Merge(4)}));
  // "t h" is merged first, so that "a t" has nothing to merge.
  EXPECT_EQ(Words("tha"), (std::vector<int64_t>{Merge(0), AtEnd('a')}));
  EXPECT_EQ(Words("abab"), (std::vector<int64_t>{Merge(1), Inside('a'), AtEnd('b')}));
}

TEST(ClipTokenizerTest, SplitsContractionsDigitsAndSigns) {
  EXPECT_EQ(Words("  THE\n\tThe "), (std::vector<int64_t>{Merge(3), Merge(3)}));
  EXPECT_EQ(Words("x's"), (std::vector<int64_t>{AtEnd('x'), Inside('\''), AtEnd('s')}));
  EXPECT_EQ(Words("x\xe2\x80\x99s"), Words("x's"));
  EXPECT_EQ(Words("42"), (std::vector<int64_t>{AtEnd('4'), AtEnd('2')}));
  EXPECT_EQ(Words("x!?"), (std::vector<int64_t>{AtEnd('x'), Inside('!'), AtEnd('?')}));
}

TEST(ClipTokenizerTest, ReadsAnyBytes) {
  // Composed and decomposed e with acute accent are the same text.
  EXPECT_EQ(Words("\xc3\xa9"), Words("e\xcc\x81"));
  EXPECT_EQ(Words("\xc3\xa9").size(), 2u);
  EXPECT_EQ(Words("\xff"), Words("\xef\xbf\xbd"));
  EXPECT_EQ(Words(std::string("\0", 1)).size(), 1u);
  EXPECT_TRUE(Words("").empty());
}

TEST(ClipTokenizerTest, TruncatesLongText) {
  std::string text;
  for (int i = 0; i < 200; ++i) text += "the ";
  const ClipTokenizer tokenizer(kText, kVocabulary, "test");
  const std::vector<int64_t> tokens = tokenizer.Tokens(text);
  ASSERT_EQ(tokens.size(), 77u);
  EXPECT_EQ(tokens[75], Merge(3));
  EXPECT_EQ(tokens[76], tokenizer.end_of_text());
  EXPECT_THROW(tokenizer.Tokens(std::string(2001, 'a')), Error);
}

TEST(ClipTokenizerTest, RefusesOtherFilesAsVocabulary) {
  EXPECT_THROW(ClipTokenizer(kText, kVocabulary + 1, "test"), Error);
  EXPECT_THROW(ClipTokenizer("header\na b c\n", 515, "test"), Error);
  EXPECT_THROW(ClipTokenizer("header\nab\n", 515, "test"), Error);
  EXPECT_THROW(ClipTokenizer(kText, 100, "test"), Error);
  EXPECT_THROW(ClipTokenizer::FromFile("/nonexistent", 515), Error);
}

TEST(ClipTokenizerTest, ReadsPlainFile) {
  const ScratchFolder folder;
  WriteFileAtomic(folder.path() / "merges.txt", kText);
  const auto tokenizer = ClipTokenizer::FromFile(folder.path() / "merges.txt", kVocabulary);
  EXPECT_EQ(tokenizer.Tokens("the")[1], Merge(3));
}

TEST(ClipTokenizerTest, AgreesWithAuthorsTokens) {
  const std::filesystem::path data = COLOR3D_SHARED_DATA;
  const std::filesystem::path vocabulary = data / "weights/clip_vocab/bpe_simple_vocab_16e6.txt.gz";
  const std::filesystem::path expected = data / "golden/clip_mini.expected.safetensors";
  if (!std::filesystem::exists(vocabulary) || !std::filesystem::exists(expected)) {
    GTEST_SKIP() << "no shared data";
  }
  const auto tokenizer = ClipTokenizer::FromFile(vocabulary, 49408);
  const WeightArray tokens = ReadWeightFile(expected).at("tokens");
  const char* prompts[] = {"red roses in front of a grey stone wall",
                           "a golden autumn forest, blue sky & white clouds",
                           "the owl wears a green scarf; 1945's photo",
                           "caf\xc3\xa9 \xe2\x80\x94 na\xc3\xafve fa\xc3\xa7"
                           "ade"};
  for (int i = 0; i < 4; ++i) {
    const std::vector<int64_t> ours = tokenizer.Tokens(prompts[i]);
    const std::vector<int64_t> theirs(tokens.values.begin() + 77 * i,
                                      tokens.values.begin() + 77 * (i + 1));
    EXPECT_EQ(ours, theirs) << prompts[i];
  }
}

}  // namespace
}  // namespace color3d
