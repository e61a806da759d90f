// Fuzz target: metadata of a call, and addresses of webhooks.
#include <algorithm>
#include <cctype>
#include <optional>
#include <string_view>

#include "core/trace/trace_context.h"
#include "server/access/notify_targets.h"
#include "server/rpc/calls/access.h"
#include "server/rpc/calls/call_watch.h"
#include "tests/fuzz/request_checks.h"

namespace color3d {
namespace {

constexpr char kAllowed[] = "https://hooks.example.org/color3d";

bool IsLowHex(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }

void CheckHeaders(std::string_view text) {
  const std::optional<TraceContext> context = ParseTraceparent(text);
  const std::string trace = context ? context->trace_id : "";
  const bool is_none = !context;
  if (!is_none && (trace.size() != 32 || !std::ranges::all_of(trace, IsLowHex) ||
                   trace.find_first_not_of('0') == std::string::npos)) {
    std::abort();
  }
  const std::string id = ChooseRequestId(text);
  if (id.empty() || id.size() > 64 || !std::ranges::all_of(id, [](unsigned char c) {
        return c < 127 && (std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.');
      })) {
    std::abort();
  }
  const std::string_view token = ParseBearerToken(text);
  if (!token.empty() && !text.ends_with(token)) std::abort();
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  return {"00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
          "01-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01-more",
          "00-00000000000000000000000000000000-b7ad6b7169203331-01",
          "Bearer 0123456789abcdef",
          "3f0c9a52-7e4b-4c1d-9b1e-2f6d8a7c5b40",
          "https://hooks.example.org/color3d/done?job=7",
          "https://hooks.example.org/color3d/../secret",
          "http://[::1]:8080/x",
          "https://user@hooks.example.org/color3d",
          "https://hooks.example.org/color3d%2e%2E/x"};
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  const std::string text(reinterpret_cast<const char*>(data), size);
  CheckHeaders(text);
  AnswerOrRefuse([&] { CheckNotifyTarget(text); });
  return AnswerOrRefuse(
      [&] {
        CheckNotifyUrl(text, {kAllowed});
        if (!text.starts_with(kAllowed) || text.find("..") != std::string::npos ||
            text.find('@') != std::string::npos) {
          std::abort();
        }
      },
      {grpc::StatusCode::FAILED_PRECONDITION});
}
