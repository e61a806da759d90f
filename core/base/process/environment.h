// Environment variables passed to child programs. Thread-safe unless another thread changes the
// environment.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// Returns true if "NAME=value" may be passed to a child program: variables of paths, language and
// numeric libraries. Names that are not listed are not passed, so that no token, key or password
// leaks.
bool IsInherited(std::string_view variable);

// Variables of this process that may be passed on, as "NAME=value".
std::vector<std::string> InheritedEnvironment();

}  // namespace color3d
