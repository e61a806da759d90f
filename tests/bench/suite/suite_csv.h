// Rows of a suite as CSV: what its tables need, so that a suite can go on on another machine. Pure
// functions.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/suite/suite_rows.h"

namespace color3d {

// One line for each row, with a header.
std::string RowsToCsv(const std::vector<SuiteRow>& rows);

// Reads what RowsToCsv writes; columns may stand in another order, and unknown ones are left out.
// Throws Error{kInvalidArgument} with the line if one cannot be read or a column is missing.
std::vector<SuiteRow> RowsFromCsv(const std::string& csv);

}  // namespace color3d
