// Lookup in tables with one row for each kind of capture. Thread-safe.
#pragma once

#include <algorithm>
#include <iterator>
#include <string_view>

#include "core/base/error.h"
#include "core/catalogue/captures.h"

namespace color3d {

// The row whose member `kind` is `kind`. `what`: of the rows, for the message. Throws
// Error{kInternal} if there is none.
template <typename Rows>
const auto& RowOfKind(const Rows& rows, CaptureKind kind, std::string_view what) {
  const auto found =
      std::ranges::find_if(rows, [kind](const auto& row) { return row.kind == kind; });
  if (found == std::end(rows)) {
    throw Error(ErrorCode::kInternal, "no {} of the capture kind {}", what, static_cast<int>(kind));
  }
  return *found;
}

}  // namespace color3d
