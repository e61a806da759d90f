// Natural order of names. Pure.
#pragma once

#include <string_view>

namespace color3d {

// Returns true if `a` comes before `b`. Runs of digits compare as numbers of any length ("p2"
// before "p10"), all else as bytes. A strict total order: only identical names are equal.
bool ComesBefore(std::string_view a, std::string_view b);

}  // namespace color3d
