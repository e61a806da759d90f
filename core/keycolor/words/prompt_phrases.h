// Colour phrases of a prompt: "a red brick castle under a blue sky" is {red, brick castle} and
// {blue, sky}. English word order; no model, no torch. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "core/keycolor/words/color_names.h"

namespace color3d {

struct ColorPhrase {
  std::string thing;  // "brick castle"
  NamedColor color;
};

struct ParsedPrompt {
  std::vector<ColorPhrase> phrases;
  std::vector<std::string> notes;  // omitted words with reasons, for the report
};

// A thing is the words after a colour, up to the next punctuation mark, preposition, verb or colour
// ("white clouds over green hills"), or the words before it ("the sky is blue", "paint the roof
// red"). The first colour of a thing counts. Throws Error{kInvalidArgument} if the prompt is longer
// than 2000 bytes, names more than 32 things, or none (listing the known colours).
ParsedPrompt ParsePrompt(const std::string& prompt);

}  // namespace color3d
