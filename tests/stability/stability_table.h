// STABILITY.md: the cases and their results as a table that is committed. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "tests/stability/stability_case.h"

namespace color3d {

// Name of the committed file, beside this one.
inline constexpr const char* kStabilityTable = "STABILITY.md";

struct StabilityRow {
  StabilityCase stability_case;
  StabilityResult result;
};

// The file: how it is made, the digest of its contents that do not depend on the machine (cases and
// bounds), and a table for each group.
std::string StabilityMarkdown(const std::vector<StabilityRow>& rows);

// "group, name" of each row of a file, in order.
std::vector<std::string> CasesOfMarkdown(const std::string& markdown);
// The digest that a file states, and the one of its rows.
std::string StatedDigest(const std::string& markdown);
std::string DigestOfRows(const std::string& markdown);
// The bounds of a case's row, as the file prints them: of values, of gradients ("-": none). Throws
// std::out_of_range if there is no such row.
std::string BoundsOfCase(const std::string& markdown, const std::string& group_and_name);
std::string PrintedBounds(const StabilityResult& result);

}  // namespace color3d
