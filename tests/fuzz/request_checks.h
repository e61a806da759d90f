// Checks of fuzz targets of requests.
#pragma once

#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <utility>

#include "server/rpc/calls/error_mapping.h"
#include "tests/fuzz/fuzz_target.h"

namespace color3d {

// Checks that the error has a message of one line and a code that blames the request:
// INVALID_ARGUMENT, NOT_FOUND, or one of `others`.
template <class Reader>
int AnswerOrRefuse(Reader&& reader, std::initializer_list<grpc::StatusCode> others = {}) {
  const grpc::Status status = Guard(std::forward<Reader>(reader));
  const grpc::StatusCode code = status.error_code();
  const bool good = status.ok() || code == grpc::StatusCode::INVALID_ARGUMENT ||
                    code == grpc::StatusCode::NOT_FOUND ||
                    std::ranges::find(others, code) != others.end();
  if (!good || status.error_message().find('\n') != std::string::npos) {
    std::fprintf(stderr, "not a refusal: %s\n", status.error_message().c_str());
    std::abort();
  }
  return 0;
}

// Returns false for bytes that are not such a message, without logging them.
template <class Request>
bool ParseRequest(const uint8_t* data, size_t size, Request* request) {
  static const auto kNoLog = google::protobuf::SetLogHandler(nullptr);
  (void)kNoLog;
  return request->ParseFromArray(data, static_cast<int>(size));
}

}  // namespace color3d
