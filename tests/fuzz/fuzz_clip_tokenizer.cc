// Fuzz target: CLIP's tokenizer. The first byte is the share of the rest that is the vocabulary; 0:
// the rest is a prompt for a valid vocabulary, which is much faster than constructing a tokenizer.
#include <cstdlib>
#include <string_view>

#include "core/encoder/clip/clip_tokenizer.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

constexpr int kMerges = 4;
constexpr int kSize = 2 * 256 + 2 + kMerges;
constexpr int kContext = 77;
constexpr char kSound[] = "#version\nr e\nre d</w>\nb l\nu e</w>\n";

void Tokenize(const color3d::ClipTokenizer& tokenizer, const std::string& text) {
  const std::vector<int64_t> tokens = tokenizer.Tokens(text, kContext);
  if (tokens.size() != kContext || tokens[0] != tokenizer.start_of_text()) std::abort();
  for (int64_t token : tokens) {
    if (token < 0 || token >= kSize) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const std::string_view input(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string_view merges = input.substr(0, data[0]);
  const std::string text(input.substr(merges.size()));
  return color3d::ReadOrRefuse([&] {
    static const color3d::ClipTokenizer sound(kSound, kSize, "vocabulary");
    if (data[0] == 0) {
      Tokenize(sound, text);
    } else {
      Tokenize(color3d::ClipTokenizer(merges, kSize, "vocabulary"), text);
    }
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  const std::string sound(kSound), prompt(1, '\0');
  return {std::string(1, static_cast<char>(sound.size())) + sound + "a red door",
          prompt + "a red door, blue sky 42's",
          prompt + "\xe2\x80\x9cGr\xc3\xbcn\xe2\x80\x9d \xf0\x9f\x8e\xa8 \xff\xfe",
          prompt + "<|startoftext|>   <|endoftext|>"};
}

}  // namespace color3d
