#include "core/trace/trace_context.h"

#include <sys/random.h>

#include <algorithm>

#include "core/base/digest.h"

namespace color3d {
namespace {

constexpr size_t kTraceDigits = 32;
constexpr size_t kSpanDigits = 16;

bool IsLowHex(std::string_view text) {
  return std::ranges::all_of(
      text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool IsId(std::string_view text, size_t digits) {
  return text.size() == digits && IsLowHex(text) &&
         text.find_first_not_of('0') != std::string_view::npos;
}

// `digits`: even, at most 32.
std::string RandomHex(size_t digits) {
  unsigned char bytes[kTraceDigits / 2];
  const size_t wanted = digits / 2;
  for (size_t have = 0; have < wanted;) {
    const ssize_t got = ::getrandom(bytes + have, wanted - have, 0);
    if (got > 0) have += static_cast<size_t>(got);
  }
  std::string id;
  for (size_t i = 0; i < wanted; ++i) {
    constexpr char kDigits[] = "0123456789abcdef";
    id += kDigits[bytes[i] >> 4];
    id += kDigits[bytes[i] & 15];
  }
  return id;
}

}  // namespace

std::optional<TraceContext> ParseTraceparent(std::string_view traceparent) {
  // version "-" trace id "-" parent id "-" flags; later versions may append fields.
  if (traceparent.size() < 55 || traceparent[2] != '-' || traceparent[35] != '-' ||
      traceparent[52] != '-') {
    return std::nullopt;
  }
  const std::string_view version = traceparent.substr(0, 2), flags = traceparent.substr(53, 2);
  const bool is_whole = version == "00" ? traceparent.size() == 55
                                        : traceparent.size() == 55 || traceparent[55] == '-';
  if (!is_whole || version == "ff" || !IsLowHex(version) || !IsLowHex(flags)) return std::nullopt;
  TraceContext context;
  context.trace_id = traceparent.substr(3, kTraceDigits);
  context.span_id = traceparent.substr(36, kSpanDigits);
  // The lowest bit of the last digit.
  context.sampled = std::string_view("13579bdf").find(flags[1]) != std::string_view::npos;
  if (!IsId(context.trace_id, kTraceDigits) || !IsId(context.span_id, kSpanDigits)) {
    return std::nullopt;
  }
  return context;
}

std::string ToTraceparent(const TraceContext& context) {
  return "00-" + context.trace_id + "-" + context.span_id + (context.sampled ? "-01" : "-00");
}

std::string TraceIdOf(std::string_view text) {
  if (IsId(text, kTraceDigits)) return std::string(text);
  const std::optional<TraceContext> context = ParseTraceparent(text);
  return context ? context->trace_id : "";
}

std::string NewTraceId() { return RandomHex(kTraceDigits); }

std::string NewSpanId() { return RandomHex(kSpanDigits); }

std::string DerivedSpanId(const std::string& trace_id, const std::string& name) {
  return Sha256Hex(trace_id + " " + name).substr(0, kSpanDigits);
}

}  // namespace color3d
