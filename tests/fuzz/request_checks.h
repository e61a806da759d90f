// For fuzz targets of requests.
#pragma once

#include <google/protobuf/stubs/logging.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "server/rpc/error_mapping.h"
#include "tests/fuzz/fuzz_target.h"

namespace color3d {

// What clients are told is of one line, whatever they had sent, and blames the request.
template <class Reader>
int AnswerOrRefuse(Reader&& reader) {
  const grpc::Status status = Guard(std::forward<Reader>(reader));
  const bool good = status.ok() || status.error_code() == grpc::StatusCode::INVALID_ARGUMENT ||
                    status.error_code() == grpc::StatusCode::NOT_FOUND;
  if (!good || status.error_message().find('\n') != std::string::npos) {
    std::fprintf(stderr, "not a refusal: %s\n", status.error_message().c_str());
    std::abort();
  }
  return 0;
}

// False for bytes that are no such message; without a line in the log for each.
template <class Request>
bool ParseRequest(const uint8_t* data, size_t size, Request* request) {
  static const auto kNoLog = google::protobuf::SetLogHandler(nullptr);
  (void)kNoLog;
  return request->ParseFromArray(data, static_cast<int>(size));
}

}  // namespace color3d
