#include "server/rpc/access.h"

#include <spdlog/spdlog.h>

#include <chrono>

#include "server/service_error.h"

namespace color3d {
namespace {

constexpr std::string_view kScheme = "Bearer ";

std::string_view AuthorizationOf(const grpc::CallbackServerContext& context) {
  const auto entry = context.client_metadata().find("authorization");
  if (entry == context.client_metadata().end()) return {};
  return {entry->second.data(), entry->second.size()};
}

}  // namespace

std::string_view TokenOf(std::string_view authorization) {
  return authorization.starts_with(kScheme) ? authorization.substr(kScheme.size())
                                            : std::string_view();
}

// Once a second at most: refusals must not fill the disk.
void Access::LogRefusal(const std::string& why, const grpc::CallbackServerContext& context) const {
  const int64_t now = std::chrono::duration_cast<std::chrono::seconds>(
                          std::chrono::steady_clock::now().time_since_epoch())
                          .count();
  if (last_refusal_s_.exchange(now) != now) {
    spdlog::warn("a call from {} was refused: {}", context.peer(), why);
  }
}

Caller Access::Require(Role role, const grpc::CallbackServerContext& context) const {
  if (!tokens_) return {};
  const std::string_view token = TokenOf(AuthorizationOf(context));
  if (token.empty()) {
    LogRefusal("it brings no token", context);
    throw ServiceError(ErrorCode::kFailedPrecondition,
                       "TOKEN_MISSING",
                       "this server wants a token: `color3d --token-file FILE`, or COLOR3D_TOKEN");
  }
  const std::optional<TokenRecord> record = tokens_->Find(token);
  if (!record) {
    LogRefusal("its token is unknown", context);
    throw ServiceError(ErrorCode::kFailedPrecondition,
                       "TOKEN_UNKNOWN",
                       "this server does not know the token; ask who runs it for a fresh one");
  }
  if (record->role < role) {
    LogRefusal(record->name + " may only " + RoleName(record->role), context);
    throw ServiceError(ErrorCode::kFailedPrecondition,
                       "ROLE_TOO_LOW",
                       "the token of '{}' has the role {}; this call needs {}",
                       record->name,
                       RoleName(record->role),
                       RoleName(role));
  }
  return {record->name, record->role, record->project};
}

}  // namespace color3d
