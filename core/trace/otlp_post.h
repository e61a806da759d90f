// One HTTP request to a collector of traces. Stateless.
#pragma once

#include <atomic>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace color3d {

struct TraceTarget {
  std::string url;  // http://... or https://..., with the path; empty: none
  std::vector<std::pair<std::string, std::string>> headers;
  std::string certificate;  // PEM file with authorities in place of the system's; may be empty
  std::chrono::milliseconds limit{10'000};
};

struct TraceAnswer {
  int status = 0;                            // of HTTP; 0: no answer
  std::string problem;                       // why there was no answer
  std::chrono::milliseconds retry_after{0};  // asked for by the collector; 0: not
};

// Takes at most `target.limit`, less once `stop` is set. Follows no redirects, uses no proxy, reads
// at most 64 KiB of the answer.
TraceAnswer PostTraces(const TraceTarget& target,
                       const std::string& json,
                       const std::atomic<bool>& stop);

}  // namespace color3d
