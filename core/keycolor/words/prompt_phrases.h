// What a prompt says about colour: "a red brick castle under a blue sky" is {red, brick castle} and
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
  std::vector<std::string> notes;  // what was left out and why, for the report
};

// A thing is what follows a colour up to the next sign, preposition, verb or colour ("white clouds
// over green hills"), or what comes before it ("the sky is blue", "paint the roof red"). The first
// colour of a thing counts. Throws Error{kInvalidArgument} when the prompt is longer than 2000
// bytes, names more than 32 things, or none (with the colours that are known).
ParsedPrompt ParsePrompt(const std::string& prompt);

}  // namespace color3d
