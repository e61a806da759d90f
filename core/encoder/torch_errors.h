// Converts exceptions of torch into Error, for modules that call torch.
#pragma once

#include <c10/util/Exception.h>

#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/memory.h"

namespace color3d {

// Calls `body`; a c10::Error becomes Error{kInternal}, or kResourceExhausted if memory ran out.
// `what` starts the message.
template <typename Body>
auto WithTorchErrors(const char* what, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (const c10::Error& error) {
    const std::string text = error.what_without_backtrace();
    const bool memory = text.find("allocate memory") != std::string::npos;
    const std::string line = text.substr(0, text.find('\n'));
    if (!memory) throw Error(ErrorCode::kInternal, "{}: {}", what, line);
    throw Error(ErrorCode::kResourceExhausted,
                "{} ran out of memory ({}); use fewer or smaller pictures, or {}",
                what,
                line,
                MemoryRemedy());
  }
}

}  // namespace color3d
