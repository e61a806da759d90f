// What programs that we start learn from our environment. Reads it; thread-safe as long as nobody
// changes it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// Whether "NAME=value" may be handed on to another program: where things are, which language is
// spoken, and how libraries compute. No name that is not listed is handed on, so that no token, key
// or password is.
bool IsHandedOn(std::string_view variable);

// The variables of this process that may be handed on, as "NAME=value".
std::vector<std::string> EnvironmentToHandOn();

}  // namespace color3d
