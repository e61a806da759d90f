// Names in the order in which people count them. Pure.
#pragma once

#include <string_view>

namespace color3d {

// Whether `a` comes before `b`: runs of digits count as numbers ("p2" before "p10", of any length),
// all else as bytes. Strict and total: only equal names are equal.
bool ComesBefore(std::string_view a, std::string_view b);

}  // namespace color3d
