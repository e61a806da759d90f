// The functions that every fuzz target defines. libFuzzer drives them in builds with COLOR3D_FUZZ;
// otherwise replay_main.cc runs the seeds and their seeded mutations as a test.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/base/error.h"

// Returns 0; aborts on a finding.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace color3d {

// Seeds: inputs that are well formed, or nearly so.
std::vector<std::string> FuzzSeeds();

// Runs the reader on one input. It may only throw Error{kInvalidArgument} with a message of one
// line; anything else is a finding.
template <typename Reader>
int ReadOrRefuse(Reader&& reader) {
  try {
    reader();
  } catch (const Error& error) {
    const std::string message = error.what();
    if (error.code() != ErrorCode::kInvalidArgument || message.empty() ||
        message.find('\n') != std::string::npos) {
      std::fprintf(stderr, "not a refusal: %s: %s\n", ErrorCodeName(error.code()), error.what());
      std::abort();
    }
  }
  return 0;
}

}  // namespace color3d
