// UTF-8 by RFC 3629. Protobuf strings must be valid, or nobody can parse the message; file names
// and the output of other programs need not be.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace color3d {

bool IsUtf8(std::string_view text);

// `text` with every byte that is no part of valid UTF-8 replaced by '?', cut to at most `max_bytes`
// without splitting a character.
std::string CleanUtf8(std::string_view text, size_t max_bytes = 16384);

enum class Lines {
  kOne,   // line ends and tabs are escaped, too
  kMany,  // line ends and tabs stay
};

// `text` as it may stand in a log or on a terminal: valid UTF-8 in which nothing ends a line, moves
// the cursor, changes colours or turns the direction of writing. What would is written as "\n",
// "\t", "\r", "\x1b" or "\u202e"; bytes that are no UTF-8 become '?'. Not cut.
std::string EscapeControls(std::string_view text, Lines lines = Lines::kOne);

}  // namespace color3d
